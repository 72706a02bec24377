# --arrays chooses what comes back.
maille compress -q wave.ply
maille decompress -q --arrays normal wave.maille normals.ply
maille info --json wave.maille | json '[a["name"] for a in j["arrays"]]'
grep -a '^property' normals.ply
maille decompress -q --arrays '' wave.maille bare.ply
grep -a '^property' bare.ply
maille decompress -q --arrays normal,quality wave.maille both.ply
maille diff wave.ply both.ply
try maille decompress --arrays colour wave.maille none.ply
files_like 'none.ply'
