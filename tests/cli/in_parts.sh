# Volumes go from file to file in parts, and through pipes as they are made; nothing is left behind.
cat > blockMeshDict <<'END'
vertices ((0 0 0) (1 0 0) (1 1 0) (0 1 0) (0 0 1) (1 0 1) (1 1 1) (0 1 1));
blocks (hex (0 1 2 3 4 5 6 7) (16 15 14) simpleGrading (1 2 3));
boundary (inlet { type patch; faces ((0 1 2 3)); });
END
mkdir tmp
export TMPDIR=$PWD/tmp
try maille generate -q blockMeshDict cube.vtu
try maille compress -q --memory 64M cube.vtu
try maille compress -q cube.maille again.maille
try maille decompress -q again.maille back.vtu
try maille diff --same-order cube.vtu back.vtu
maille generate -q --any-order blockMeshDict - | maille compress -q -9 - - | maille verify -
maille generate -q --any-order blockMeshDict - | maille decompress -q - piped.vtu
maille generate -q --any-order blockMeshDict piped.maille -f
try maille diff piped.maille cube.vtu
maille compress -q - shape.maille < cube.vtu
try maille diff --same-order shape.maille cube.vtu
files_like 'tmp/*'
files_like '.*part'
# Cells held back: their order changes, the mesh does not.
try maille compress -q --any-order --delay 1000 cube.vtu delayed.maille
try maille diff delayed.maille cube.vtu
maille generate -q blockMeshDict - | maille compress -q --any-order --delay 50 - - | maille verify -
files_like 'tmp/*'
# A generated stream has the patches of its dictionary, and polyMesh written in parts is the one written whole.
maille generate -q --any-order blockMeshDict - > generated.maille
try maille decompress -q generated.maille --output-format polymesh whole
try maille decompress -q --memory 3M generated.maille --output-format polymesh parts
for file in whole/constant/polyMesh/*; do cmp "$file" "parts/constant/polyMesh/${file##*/}"; done
sed -n "/^(/,\$p" parts/constant/polyMesh/boundary
files_like 'tmp/*'
# Polyhedra come through pipes, too; a file with steps of time is compressed again without them, and says so.
maille compress -q "$HERE/../formats/polyhedra.vtu" - | maille compress -q - polyhedra.maille
maille diff polyhedra.maille "$HERE/../formats/polyhedra.vtu"
maille append -q --time 1 again.maille cube.vtu
maille compress -f again.maille once.maille 2>&1 | grep note
maille diff --same-order again.maille once.maille
