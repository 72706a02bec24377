# What users get wrong, each time one sentence that says what to do, and the exit code of its kind.
maille compress -q tetra.off tetra.maille
maille compress -q --mode random cube.ply cube.maille
maille generate -q blockMeshDict hexes.vtu
maille compress -q hexes.vtu hexes.maille
mkdir folder
# Verbs and names.
try maille extrakt tetra.maille out.ply
try maille unpack tetra.maille
try maille tetra.off
try maille --compress tetra.off
try maille compress tetra.of
try maille compress folder
try maille compress -r folder
try maille decompress tetra.off
try maille decompress tetra.maille tetra.maile
try maille decompress tetra.maille folder
try maille decompress tetra.maille nowhere/tetra.ply
try maille compress tetra.off tetra.maille
try maille compress tetra.off tetra.ply
try maille convert tetra.off
try maille info folder
try maille verify folder
# Options and levels.
try maille compress -10 tetra.off
try maille compress tetra.off out.maille -10
try maille compress -f --keep_order tetra.off
try maille compress -f --quality 9 tetra.off
try maille compress -f --threads=many tetra.off
try maille compress -f --memory 0 tetra.off
try maille compress -f --for printing tetra.off
try maille compress -f --mode randomm tetra.off
try maille compress -f --input-format PLY tetra.off
try maille decompress -f --output-format jpg tetra.maille
# Bounds.
try maille compress -f -e 0.1mm tetra.off
try maille compress -f -e 0,1 tetra.off
try maille compress -f -e 5px tetra.off
try maille compress -f --bits normal tetra.off
try maille compress -f --bits normal=10 --bits txcoord=12 tetra.off
try maille compress -f --bits 14=position tetra.off
try maille compress -f --error T=0.5 tetra.off
try maille compress -q -f --psnr -3 tetra.off
try maille compress -f --psnr loud tetra.off
# Pipes.
try maille compress - out.maille < /dev/null
try maille decompress - out.ply < tetra.off
try maille convert - out.ply < /dev/null
try maille compress --pieces auto tetra.off pieces.maille
# Steps, parts and places.
try maille decompress -f tetra.maille out.ply --step 3
try maille decompress -f hexes.maille out.vtu --time 0.5
try maille append tetra.maille tetra.off
try maille append hexes.maille tetra.off
try maille extract tetra.maille out.ply --triangles 100
try maille extract cube.maille out.ply --box 0,0,0,1,1
try maille extract cube.maille out.ply --box 1,1,1,0,0,0
try maille extract cube.maille out.ply --box=9,9,9,10,10,10
try maille extract cube.maille out.ply --triangles few
try maille extract hexes.maille out.vtu --where 'T > 5'
try maille slice cube.maille out.vtu
try maille probe hexes.maille 1,2
files_like 'out.*'
