# A mesh in any format is described, too.
maille info cube.ply
maille info tetra.stl
maille info --json cube.ply | json 'j["edges"], j["mode"], j["arrays"][0]["ranges"]'
maille info - --input-format ply < wave.ply | head -6
head -4 tetra.off > open.off
printf '0 0 0\n1 0 0\n0 1 0\n0 0 1\n' > points.txt
printf 'OFF\n4 3 0\n' | cat - points.txt > open.off
printf '3 0 1 2\n3 0 1 3\n3 0 1 2\n' >> open.off
maille info open.off | grep closed
maille generate -q blockMeshDict hexes.vtu
maille info hexes.vtu | grep -E 'types|compress'
try maille info --chunks cube.ply
