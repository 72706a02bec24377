# Any format to any other; the mesh stays the same, and quads stay quads.
maille convert cube.ply cube.obj
maille convert cube.obj cube.off
maille convert cube.off back.ply
maille diff --no-arrays cube.ply back.ply
maille convert -q cube.ply cube.vtp
maille diff cube.ply cube.vtp
maille convert -q tetra.stl tetra.ply
maille diff --no-arrays tetra.off tetra.ply
