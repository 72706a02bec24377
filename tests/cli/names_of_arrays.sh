# What other programs call colours and normals is understood; what no array means is a note, so that one line serves
# many files. Other names are mistakes.
maille compress --bits color=6 --bits uv=12 --bits normals=10 cube.ply cube.maille
maille info cube.maille | grep colour
try maille compress -f --bits colr=6 cube.ply cube.maille
try maille compress -f --bits speed=6 cube.ply cube.maille
# A percentage is one of the size of the mesh, or of the range of an array.
maille compress -q -f -e 1% -e color=2% cube.ply percent.maille
maille compress -q -f --rel-error 0.01 --rel-error colour=0.02 cube.ply fraction.maille
maille diff percent.maille fraction.maille
try maille compress -f -e 0,01 cube.ply cube.maille
try maille compress -f --bits 10% cube.ply cube.maille
try maille compress -f -e 1e30 cube.ply cube.maille
try maille compress -f --pw-rel-error 100% --mode stream cube.ply cube.maille
