# Mode random holds surfaces; a sentence says what to do with solids.
maille generate -q blockMeshDict solid.vtu
try maille compress --mode random solid.vtu
files_like '*.maille'
