# A pipe under a name is opened once: neither the name of the output nor what a message says needs a second look.
maille compress -q --no-provenance wave.ply one.maille
mkfifo scan.maille scan.pipe
cat one.maille > scan.maille &
try timeout 20 maille decompress -q scan.maille
maille diff wave.ply scan.ply
cat one.maille > scan.pipe &
try timeout 20 maille info scan.pipe | head -1
cat tetra.off > scan.pipe &
try timeout 20 maille decompress scan.pipe back.ply
try maille decompress - < tetra.off
# Nobody writes into this one: what is wrong with the output is said without waiting for it.
try timeout 20 maille decompress scan.pipe back.xyz
try timeout 20 maille decompress scan.pipe back.maille
