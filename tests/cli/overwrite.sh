# Nothing is overwritten without -f.
echo precious > tetra.ply
try maille convert tetra.off tetra.ply
cat tetra.ply
try maille convert -f -q tetra.off tetra.ply
maille diff tetra.off tetra.ply
