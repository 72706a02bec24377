# Both schemes keep the points and the topology; the result goes to any format, or on by a pipe.
maille subdivide tetra.off fine.ply --levels 3
maille subdivide tetra.off fine.off --levels 3 --scheme sqrt3
maille subdivide -q tetra.off - --levels 3 | maille diff - fine.ply --input-format ply
maille subdivide --json tetra.off fine.obj | json 'j["scheme"], j["points"], j["faces"], j["input_faces"]'
maille convert -q fine.obj a.ply
maille subdivide -q a.ply b.ply
maille subdivide -q tetra.off c.ply --levels 2
maille compress -q c.ply c.maille
maille verify -q c.maille --against c.ply
maille subdivide -q c.maille d.ply --scheme sqrt3
try maille subdivide cube.ply x.ply
try maille subdivide tetra.off x.maille
try maille subdivide tetra.off fine.ply
try maille subdivide tetra.off x.ply --levels 0
try maille subdivide tetra.off x.ply --scheme loop
files_like 'x.*'
