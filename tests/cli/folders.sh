# A folder is a mesh where OpenFOAM left one; it never is a .maille file, whatever it is called.
mkdir case case.maille
try maille info case
try maille verify case.maille
try maille decompress case.maille out.ply
try maille convert case out.ply
try maille convert case.maille out.ply
try maille compress wave.ply case
try maille compress wave.ply case/wave.maille -q
