# A mesh of another format given to a verb that wants .maille.
try maille decompress cube.ply cube.obj
try maille verify house.obj
try maille verify tetra.off
# One packed with gzip: nothing here reads through it, so say how to go on.
maille compress -q cube.ply packed.maille
gzip packed.maille
mv packed.maille.gz packed
cp packed packed.maille.gz
cp packed packed.maille
try maille info packed.maille.gz
try maille info packed.maille
try maille verify packed
try maille info - < packed
try maille decompress packed.maille.gz cube.obj
try maille convert packed.maille.gz cube.obj
gunzip -c packed.maille.gz | maille info - | head -1
