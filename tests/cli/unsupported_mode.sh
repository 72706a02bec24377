# Exit code 5: known, but not there yet.
try maille compress --mode random cube.ply
