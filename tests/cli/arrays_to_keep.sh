# --arrays and --drop choose what is compressed, by the names of the mesh or of the role.
arrays() { maille info --json "$1" | json '[a["name"] for a in j["arrays"]]'; }
arrays_of() { maille compress -q -f "$@" wave.ply kept.maille && arrays kept.maille; }
arrays_of --arrays normal
arrays_of --arrays ''
arrays_of --drop normals
arrays_of --drop normal,quality
arrays_of --arrays quality,uv
try maille compress -f --drop qualty wave.ply kept.maille
try maille compress -f --arrays normal --drop normals wave.ply kept.maille
# Of a mesh in parts, too.
maille generate -q blockMeshDict hexes.vtu
maille compress -q -f --pieces 1 --arrays '' hexes.vtu volume.maille
arrays volume.maille
