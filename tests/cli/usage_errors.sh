# Each is one sentence and exit code 2, and nothing is written.
try maille compress
try maille diff cube.ply
try maille verify
try maille completion
try maille completion tcsh
try maille compress --no-such-option cube.ply
try maille convert cube.ply out.maille another
try maille compress --mode tiny cube.ply
try maille compress --input-format doc cube.ply
try maille compress --error
try maille compress --error small cube.ply
try maille compress --error 0 cube.ply
try maille compress --error -1 cube.ply
try maille compress --error nan cube.ply
try maille compress --bits 3.5 cube.ply
try maille compress --bits 0 cube.ply
try maille compress --bits red=99 cube.ply
try maille compress --lossless --bits 12 cube.ply
try maille compress --error 0.1 --bits 12 cube.ply
try maille compress --error red=1 --rel-error red=0.1 cube.ply
try maille compress --error position=1 -e 2 cube.ply
try maille compress --keep-order --any-order cube.ply
try maille compress -1 -9 cube.ply
try maille compress --threads 99999 cube.ply
try maille compress --memory lots cube.ply
try maille compress --json cube.ply -
try maille compress --progress loud cube.ply
try maille convert cube.ply -
try maille convert cube.ply cube.xyz
try maille convert cube.ply cube.foam
try maille convert cube.ply cube.pvtu
try maille convert cube.ply cube.glb.gz
try maille convert cube.ply no_extension
try maille convert cube.ply folder.d/no_extension
try maille diff - -
try maille verify - --against -
files_like '*.maille'
try maille compress --delay 100 cube.ply
try maille compress --any-order --delay 0 cube.ply
try maille compress --any-order --delay 100 --mode single cube.ply
