# exit: 3
maille compress nothing_here.ply
