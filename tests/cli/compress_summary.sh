# What compress says, and that it hints at lossy coding only when all is lossless.
maille compress wave.ply
maille compress --bits 12 --bits normal=10 wave.ply lossy.maille
maille compress -q wave.ply quiet.maille
maille compress --lossless wave.ply lossless.maille 2>&1 | grep -c 'smaller files'
files_like '*.maille'
