# Exit code 1 and what differs.
try maille diff cube.ply cube_moved.ply
try maille diff cube.ply tetra.off
try maille diff -q cube.ply tetra.off
maille convert -q cube.ply cube.off
try maille diff --no-arrays cube.ply cube.off
