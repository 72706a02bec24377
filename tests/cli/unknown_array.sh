# exit: 2
maille compress --bits normal=10 cube.ply
