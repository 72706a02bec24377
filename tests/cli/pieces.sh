# A volume in pieces: any part of it alone, the same cells as in the whole; slices and values at places.
maille generate -q blockMeshDict grid.vtu --refine 6
maille compress -q --pieces 2000 grid.vtu grid.maille
maille compress -q grid.vtu plain.maille
maille verify grid.maille --against grid.vtu
maille diff --same-order grid.vtu grid.maille
maille info --json --pieces grid.maille | json 'len(j["pieces"]) > 3, sum(p["cells"] for p in j["pieces"]) == j["cells"]'
maille extract --json grid.maille part.vtu --box 0,0,0,0.05,0.02,0.05 --numbers > part.json
maille extract -q plain.maille same.vtu --box 0,0,0,0.05,0.02,0.05 --numbers
maille diff --same-order part.vtu same.vtu
json 'j["pieces"] < j["of_pieces"], 0 < j["cells"] < j["cells_read"]' < part.json
maille extract -q grid.maille first.vtu --cells 0:100
maille compress -q first.vtu first.maille; maille info --json first.maille | json 'j["cells"]'
maille extract -q grid.maille coarse.vtu --coarse
maille compress -q coarse.vtu coarse.maille; maille info --json coarse.maille | json 'j["cells"] == j["points"], j["cells"]'
maille slice -q grid.maille cut.ply --plane 0.15,0,0,1,0.2,0
maille slice -q grid.vtu same.ply --plane 0.15,0,0,1,0.2,0
maille diff cut.ply same.ply
# A normal of any length.
maille slice -q grid.vtu same.ply -f --plane 0.15,0,0,1e300,0.2e300,0; maille diff cut.ply same.ply
maille slice -q grid.vtu same.ply -f --plane 0.15,0,0,1e-300,0.2e-300,0; maille diff cut.ply same.ply
# Only those that can be read alone are called pieces.
maille info grid.maille | grep -c '^pieces:'; maille info plain.maille | grep -e '^pieces:' -e '^batches:' || echo neither
maille info --pieces plain.maille | grep -c piece
try maille probe grid.maille --at 0.05,0.05,0.05 --at 99,0,0
try maille extract grid.maille none.vtu --box 1,1,1,0,0,0
try maille extract grid.maille none.vtu --where 'T > 5'
try maille extract grid.maille none.vtu --where 'T'
try maille extract grid.maille none.vtu --where 'T != 5'
try maille extract grid.maille none.vtu --level 2
try maille extract plain.maille none.vtu --coarse
try maille extract grid.maille none.vtu --coarse --box 0,0,0,1,1,1
try maille slice grid.maille none.vtu --plane 0,0,0,0,0,0
try maille compress --pieces 10 --mode single grid.vtu none.maille
try maille compress --pieces 10 cube.ply none.maille
files_like 'none*'
# From a pipe, from the generator, and back in parts: the same mesh.
maille compress -q grid.vtu - | maille compress -q --pieces 2000 - piped.maille
maille diff --same-order grid.vtu piped.maille
maille generate -q --pieces 2000 blockMeshDict generated.maille --refine 6
maille generate -q blockMeshDict - --refine 6 > stream.maille
maille diff generated.maille stream.maille
try maille generate --pieces 2000 blockMeshDict none.vtu --refine 6
maille generate -q blockMeshDict large.vtu --refine 12
maille compress -q -2 --pieces 10000 --memory 60M large.vtu parts.maille
maille verify parts.maille
maille decompress -q parts.maille back.vtu
maille diff --same-order large.vtu back.vtu
maille compress -q -2 --any-order --pieces 10000 large.vtu any.maille
maille decompress -q any.maille any.vtu
maille diff large.vtu any.vtu
maille decompress -q any.maille any.msh; maille compress -q any.msh msh.maille; maille info --json msh.maille | json 'j["cells"]'
try maille compress --pieces 100000 --memory 32M large.vtu none.maille
# A step of time, of which a region is read.
maille append -q --time 2.5 grid.maille grid.vtu
maille extract -q grid.maille step.vtu --box 0,0,0,0.05,0.02,0.05 --step 1 --numbers
maille diff --same-order step.vtu same.vtu
try maille extract grid.maille none.vtu --step 2
maille decompress -q grid.maille later.vtu --time 2.5000000001
try maille probe grid.maille --at 0.05,0.05,0.05 --arrays T
try maille extract grid.maille none.vtu --sphere 0,0,0,-1
maille verify grid.maille
files_like 'none*'
# Of surfaces: charts of that size, where a small box decodes less.
maille subdivide -q wave.ply fine.ply --levels 4
maille compress -q --mode random fine.ply usual.maille
maille compress -q --mode random --pieces auto fine.ply auto.maille; cmp usual.maille auto.maille
maille compress -q --mode random --pieces 1024 fine.ply small.maille
maille verify -q small.maille --against fine.ply
maille info --json usual.maille | json 'j["levels"][0]["charts"]'; maille info --json small.maille | json 'j["levels"][0]["charts"]'
