# A part of a mesh at any level of detail; at full detail it is that part of the mesh, bit for bit.
maille subdivide -q --levels 6 tetra.off fine.ply
maille compress -q --mode random fine.ply
maille info --tree fine.maille | grep -A9 -e '^levels of'
maille info --json fine.maille | json 'len(j["levels"]), j["levels"][0]["faces"] == j["cells"]'
maille extract -q fine.maille whole.ply
maille diff fine.ply whole.ply
# Without a limit it is the mesh in every respect: a point of no face, comments, the order.
sed -e 's/^element vertex 8/element vertex 9/' -e '/^0 1 1 /a 5 5 5 0 0 0' cube.ply > loose.ply
maille compress -q --mode random --keep-order loose.ply
maille extract -q loose.maille loose_whole.ply
maille diff --same-order loose.ply loose_whole.ply
maille extract -q fine.maille corner.ply --box 0,0,0,0.3,0.3,2
maille extract -q fine.maille ball.ply --sphere 0,0,0,0.3 --chart-numbers
maille extract --json -q fine.maille small.ply --triangles 6000 | json '0 < j["cells"] <= 6000'
maille extract -q fine.maille seen.ply --eye 0,0,9 --pixel-error 20
maille extract --json -q fine.maille rough.ply --error 0.1 | json 'j["faces_read"] < 20000, j["damaged_charts"]'
maille extract --json -q fine.maille near.ply --nearest 0,0,9 --count 5 | json 'j["points"], j["cells"], j["faces_read"] < 20000'
maille extract --json -q fine.maille part.ply --component 0,0,9 | json 'j["cells"]'
maille diff part.ply whole.ply
try maille extract -q fine.maille none.ply --nearest 0,0,9 --level 1
try maille extract -q fine.maille none.ply --box 7,7,7,8,8,8
try maille extract -q fine.maille none.ply --box 7,7,7
try maille extract -q fine.maille none.ply --box 1,1,1,0,0,0
try maille extract -q fine.maille none.ply --level 99
maille compress -q cube.ply
try maille extract -q cube.maille none.ply
files_like 'none*'
