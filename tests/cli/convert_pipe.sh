# Standard input and output; only the mesh is on standard output.
maille convert - - --input-format off --output-format ply < tetra.off > tetra.ply
maille diff tetra.off tetra.ply
# The format is recognised by the first bytes, too.
maille convert -q - - --output-format off < tetra.ply > back.off
maille diff tetra.off back.off
# A pipe under a name.
maille convert -q <(cat cube.ply) out.obj
maille diff --no-arrays cube.ply out.obj
