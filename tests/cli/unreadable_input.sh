# Exit code 3 with the system's reason.
try maille info no/such/folder/x.maille
try maille diff . cube.ply
try maille convert missing.obj out.ply
files_like 'out*'
