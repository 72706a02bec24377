# A .maille file under the name of another format would be one nothing can open. A pattern of the shell that gives two
# meshes names two inputs, also with -f: the second is not overwritten.
cp tetra.off second.off
cp cube.ply third.PLY
try maille compress -q -f *.off
try maille compress -q -f tetra.off third.PLY
try maille compress -q -f tetra.off none.PLY
try maille compress -q tetra.off fresh.ply.gz
try maille compress -q tetra.off -o fresh.STL
cmp tetra.off second.off
cmp cube.ply third.PLY
files_like 'fresh*'
# Other extensions mean nothing.
try maille compress -q tetra.off model.v2
try maille compress -q tetra.off model
try maille compress -q tetra.off model.bin
cmp model model.bin
maille info model.v2 | head -1
