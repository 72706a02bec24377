# What is wrong with the words, not with the word CLI11 stumbles over.
try maille compress -0 tetra.off w.maille
try maille compress tetra.off w.maille -0
try maille compress -0 tetra.off
try maille compress -12 tetra.off
try maille decompress -5 w.maille
try maille convert tetra.off w.ply c  # also the short form of compress
try maille convert tetra.off cube.ply house.obj wave.ply
try maille convert --no-such-option tetra.off w.ply c
try maille diff tetra.off cube.ply house.obj
try maille info tetra.off cube.ply
files_like 'w.maille'
# Behind the verb, even the name of a verb is a file.
cp tetra.off info
maille convert -q info d --output-format off
maille diff info d
# A word nearly right is told from one that is not.
try maille comprss tetra.off
try maille compress --lossles tetra.off w.maille
try maille compress --best tetra.off w.maille
try maille compress --level=9 tetra.off w.maille
try maille info --Peices w.maille
try maille inf w.maille
