# Volumes are streams without being told, and come back as VTU in their order.
cat > blockMeshDict <<'END'
vertices ((0 0 0) (1 0 0) (1 1 0) (0 1 0) (0 0 1) (1 0 1) (1 1 1) (0 1 1));
blocks (hex (0 1 2 3 4 5 6 7) (6 5 4) simpleGrading (1 2 3));
boundary ();
END
try maille generate -q blockMeshDict cube.vtu
try maille compress cube.vtu
try maille info cube.maille | head -1
try maille decompress cube.maille back.vtu
try maille diff --same-order cube.vtu back.vtu
try maille compress -f --any-order -e 0.001 cube.vtu small.maille
try maille decompress -f small.maille
ls small.vtu
