# Good files, alone and against their original.
maille compress -q wave.ply
try maille verify wave.maille
try maille verify wave.maille --against wave.ply
maille compress -q --bits 10 -e quality=0.5 wave.ply lossy.maille
try maille verify lossy.maille --against wave.ply
try maille verify -q wave.maille --against wave.ply
maille verify --json wave.maille --against wave.ply | json 'sorted(j), j["same"], j["damage"]'
