# --for stands for options that could be given one by one; those beside it come first.
maille compress -q -f --no-provenance --for web wave.ply a.maille
maille compress -q -f --no-provenance -2 --bits 14 --bits normal=10 wave.ply b.maille
cmp a.maille b.maille
maille compress -q -f --no-provenance --for web --bits 10 -5 wave.ply a.maille
maille compress -q -f --no-provenance -5 --bits 10 --bits normal=10 wave.ply b.maille
cmp a.maille b.maille
maille compress -q -f --no-provenance --for print wave.ply a.maille
maille compress -q -f --no-provenance --error 0.0005 --drop normals wave.ply b.maille
cmp a.maille b.maille
maille compress -q -f --no-provenance --for print --lossless wave.ply a.maille
maille compress -q -f --no-provenance wave.ply b.maille
cmp a.maille b.maille
maille compress -q -f --no-provenance --for archive wave.ply a.maille
maille compress -q -f --no-provenance -9 --keep-order wave.ply b.maille
cmp a.maille b.maille
maille compress -q -f --for scan wave.ply a.maille
maille info --json a.maille | json 'j["mode"]'
maille generate -q blockMeshDict hexes.vtu
maille compress -q -f --for simulation hexes.vtu a.maille
maille info --json a.maille | json 'j["mode"]'
try maille compress -f --for fun wave.ply a.maille
try maille compress wave.ply x.maille --for webb
