# A mesh of blocks, counted, refined, written; what is not supported or wrong is named with its place.
maille generate blockMeshDict --count
maille generate blockMeshDict --count --any-order --refine 10
maille generate --json blockMeshDict --count | json 'j["points"], j["cells"], j["patches"][2]'
maille generate blockMeshDict a.maille
maille generate --json blockMeshDict b.maille --any-order | json 'j["cell_types"]'
maille info -q --json a.maille | json 'j["points"], j["cells"]'
maille diff a.maille b.maille
# From a pipe, with what it includes from the current folder.
maille generate - --count < blockMeshDict
maille generate -q - piped.maille < blockMeshDict && maille diff a.maille piped.maille
head -n 3 blockMeshDict > front && tail -n +4 blockMeshDict > rest
(cat front && echo '#include "rest"') | maille generate - --count
echo 'vertices ((0 0)' | try maille generate - --count
sed 's/boundary/mergePatchPairs ((a b)); boundary/' blockMeshDict > merge
try maille generate merge --count
sed 's/right (\$n 3 2)/right ($n 2 2)/' blockMeshDict > uneven
try maille generate uneven --count
sed 's/(2 0 0)/(2 0)/' blockMeshDict > short
try maille generate short --count
try maille generate blockMeshDict
try maille generate blockMeshDict x.maille --count
try maille generate blockMeshDict a.maille
try maille generate blockMeshDict x.maille --refine 1000 --memory 1M
try maille generate blockMeshDict x.maille --any-order --refine 40 --memory 2M
files_like 'x.*'
# Other formats are written as the mesh comes, too: the same mesh, within memory that would not hold it.
maille generate blockMeshDict parts.vtu --refine 8 --memory 1M
maille generate -q blockMeshDict parts.msh --refine 8 --any-order --memory 1M
maille generate -q blockMeshDict case/constant/polyMesh --refine 8
maille info -q --json parts.vtu | json 'j["points"], j["cells"]'
maille info -q --json case | json 'j["points"], j["cells"]'
maille generate blockMeshDict --any-order - | maille compress --json - streamed.maille | json 'j["input_bytes"] > 500'
