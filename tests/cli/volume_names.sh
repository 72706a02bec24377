# Whoever makes it, a file of solids is a stream; what came from a volume is called by cells.
maille generate -q blockMeshDict cube.vtu
maille generate -q blockMeshDict generated.maille
maille convert -q cube.vtu converted.maille
maille compress -q cube.vtu
for file in generated converted cube; do maille info $file.maille | head -1; done
maille verify cube.maille
try maille compress cube.vtu cube.maille.gz
maille decompress -q cube.maille --output-format vtk
ls cube.vtk
