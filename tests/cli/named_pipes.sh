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
# Volumes, which are written in parts where they are files.
maille generate -q blockMeshDict cube.vtu
maille convert -q cube.vtu volume.maille
mkfifo cells.maille
for output in "" parts.vtu; do
  cat volume.maille > cells.maille &
  try timeout 20 maille decompress -q cells.maille $output
done
maille diff cube.vtu cells.vtu
maille diff cube.vtu parts.vtu
cat one.maille > scan.pipe &
try timeout 20 maille decompress -q scan.pipe surface.vtu
maille diff wave.ply surface.vtu
# Nobody writes into this one: what is wrong with the output is said without waiting for it.
try timeout 20 maille decompress scan.pipe back.xyz
try timeout 20 maille decompress scan.pipe back.maille
