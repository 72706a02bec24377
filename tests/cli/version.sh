maille --version
maille -V
