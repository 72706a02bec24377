# Exit code 4, naming file, line or byte, element; no output.
try maille compress cube_index.ply out.maille
try maille compress cube_truncated.ply out.maille
try maille convert cube_index.ply out.obj
printf 'v 0 0 0\nv 1 0 0\nf 1 2 7\n' > index.obj
try maille convert index.obj out.ply
files_like 'out*'
# A file with the name of another format.
cp cube.ply renamed.obj
try maille compress renamed.obj
try maille compress -q --input-format ply renamed.obj
