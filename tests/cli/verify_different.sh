# Exit code 1: not the mesh it is held against.
maille compress -q cube.ply
try maille verify cube.maille --against cube_moved.ply
try maille verify cube.maille --against tetra.off
maille compress -q --bits 6 cube.ply coarse.maille
maille verify -q coarse.maille --against cube_shuffled.ply
try maille verify coarse.maille --against tetra.off
try maille verify coarse.maille --against cube_moved.ply
maille compress -q --keep-order -e 0.01 cube.ply kept.maille
try maille verify kept.maille --against cube_moved.ply
