# What compress says, and that it hints at lossy coding only when all is lossless.
maille compress wave.ply
maille compress --bits 12 --bits normal=10 wave.ply lossy.maille
maille compress -q wave.ply quiet.maille
maille compress --lossless wave.ply lossless.maille 2>&1 | grep -c 'smaller files'
files_like '*.maille'
# Not every value is kept where something of the input was left out.
printf '$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Banana\n1\n$EndBanana\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n' > banana.msh
printf '$Elements\n1\n1 2 2 0 1 1 2 3\n$EndElements\n' >> banana.msh
maille compress banana.msh 2>&1 | sed -n '1p;$p'
