maille compress -q cube.ply
maille decompress cube.maille cube.off
maille decompress --json cube.maille cube.obj | json 'sorted(j), j["points"], j["cells"]'
maille decompress -q --ascii cube.maille text.ply
head -2 text.ply
try maille decompress cube.maille cube.xyz
try maille decompress cube.maille again.maille
try maille decompress --json cube.maille -
