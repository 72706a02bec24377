# A mesh goes into a case of OpenFOAM and comes back; an older one only goes with -f, and nothing stays of what
# cannot be written.
cat > blockMeshDict <<'END'
vertices ((0 0 0) (1 0 0) (1 1 0) (0 1 0) (0 0 1) (1 0 1) (1 1 1) (0 1 1));
blocks (hex (0 1 2 3 4 5 6 7) (4 3 2) simpleGrading (1 2 3));
boundary (inlet { type patch; faces ((0 1 2 3)); } walls { type wall; faces ((0 4 7 3)(1 2 6 5)); }
          outlet { type patch; faces ((4 5 6 7)); } sides { type empty; faces ((0 1 5 4)(3 7 6 2)); });
END
maille generate -q blockMeshDict cube.maille
try maille decompress cube.maille case --output-format polymesh
ls case case/constant case/constant/polyMesh
try maille decompress cube.maille case
try maille decompress -f cube.maille case --ascii
grep -A 3 inlet case/constant/polyMesh/boundary
try maille compress -q case again.maille
try maille convert -q case other/polyMesh
try maille convert case case -f
try maille decompress -q again.maille case2 --output-format polymesh
try maille diff other case2
for name in points faces owner neighbour boundary; do cmp other/polyMesh/$name case2/constant/polyMesh/$name; done
# What stands beside the mesh stays, its zones do not.
touch case/constant/polyMesh/cellZones case/constant/polyMesh/notes
try maille convert -q other case/here.foam -f
ls case/constant/polyMesh
try maille decompress cube.maille - --output-format polymesh
try maille decompress cube.maille nowhere
try maille convert cube.ply new/polyMesh
ls
