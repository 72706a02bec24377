# Exit code 7: the mesh does not fit into what -M allows.
maille compress -q wave.ply
try maille decompress -M 100 wave.maille out.ply
try maille diff -M 1K wave.maille wave.ply
files_like 'out*'
