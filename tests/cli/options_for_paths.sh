# -i and -o are the same as the positional arguments, in any mix.
maille compress -q -i cube.ply -o a.maille
maille compress -q -o b.maille cube.ply
maille compress -q --input cube.ply c.maille
cmp a.maille b.maille
cmp a.maille c.maille
maille decompress -q -o a.ply -i a.maille
maille diff cube.ply a.ply
