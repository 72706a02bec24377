# The user's own meshes at all levels. Which other codecs there are depends on what was installed when maille was built.
maille bench wave.ply cube.ply --codec maille --levels 2,9
maille bench tetra.off --codec maille --levels 5 --lossless --no-whole-file
maille convert -q --output-format ply tetra.off - | maille bench - --codec maille --levels 5 --no-whole-file
echo "a file that cannot be read does not keep the next from being measured:"
try maille bench --codec maille --levels 5 missing.ply tetra.off cube_truncated.ply
echo "v 0 0 0" > points.obj
try maille bench points.obj --levels 5 --codec maille
try maille bench tetra.off --codec nonsense
try maille bench tetra.off --levels 10
try maille bench tetra.off --bits 12 --lossless
try maille bench tetra.off --against nonsense
try maille bench
