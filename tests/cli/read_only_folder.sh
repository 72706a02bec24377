# Exit code 9 without permission; root may write anywhere, so a folder of /proc stands in.
try maille convert cube.ply /proc/out.obj
