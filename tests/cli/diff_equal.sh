# Another order of vertices and faces, another first corner: still equal, but not in the same order.
try maille diff cube.ply cube_shuffled.ply
try maille diff --same-order cube.ply cube_shuffled.ply
try maille diff --same-order cube.ply cube.ply
try maille diff -q cube.ply cube_shuffled.ply
try maille diff - cube.ply < cube_shuffled.ply
