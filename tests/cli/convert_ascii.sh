maille convert -q --ascii tetra.off tetra.ply
head -2 tetra.ply
maille convert -q tetra.off tetra2.ply
head -c 30 tetra2.ply
maille diff --same-order tetra.ply tetra2.ply
