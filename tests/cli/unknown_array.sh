# exit: 2
maille compress --bits speed=10 cube.ply
