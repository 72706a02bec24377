# The file says where it is from, unless it shall not; the folder is nobody's business.
mkdir secret
cp cube.ply secret
maille compress -q --error 0.25 secret/cube.ply with.maille
maille info with.maille | grep '^written by'
maille compress -q --no-provenance secret/cube.ply without.maille
maille info without.maille | grep -c '^written by'
maille info --json without.maille | json 'j["provenance"]'
