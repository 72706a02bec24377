# Output equals input, also by another name, also with -f; the input stays as it was.
cp cube.ply copy.ply
cp cube.ply cube
ln cube.ply hard_link.maille
ln -s cube.ply soft_link.maille
try maille compress cube cube
try maille compress -f cube ./cube
try maille compress -f cube.ply hard_link.maille
try maille compress -f cube.ply soft_link.maille
try maille convert -f cube.ply cube.ply
cmp cube.ply copy.ply
cmp cube copy.ply
