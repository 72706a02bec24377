# Without OUT: beside the input, with another extension; never over an existing file.
mkdir folder
cp wave.ply folder/wave.v2.ply
maille c -q folder/wave.v2.ply
files_like '*.maille'
try maille d -q folder/wave.v2.maille
rm folder/wave.v2.ply
maille d -q folder/wave.v2.maille
maille diff wave.ply folder/wave.v2.ply
gzip -k tetra.off
mkdir packed
mv tetra.off.gz packed
try maille c -q packed/tetra.off.gz
try maille c -q packed/tetra.off.gz
files_like 'tetra.maille'
# The extension is that of the format asked for.
maille d -q folder/wave.v2.maille --output-format obj
maille diff --no-arrays wave.ply folder/wave.v2.obj
