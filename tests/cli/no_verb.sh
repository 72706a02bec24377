# exit: 2
maille
