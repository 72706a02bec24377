# A mesh of another format given to a verb that wants .maille.
try maille decompress cube.ply cube.obj
try maille info house.obj
try maille verify tetra.off
