# exit: 2
maille squeeze cube.ply
