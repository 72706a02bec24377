# Exit code 9, one sentence; the answer of info and verify counts, too.
maille compress -q cube.ply
try maille compress cube.ply /dev/full
maille compress -q cube.ply - > /dev/full
echo "exit $?"
try maille decompress cube.maille /dev/full
maille info cube.maille > /dev/full
echo "exit $?"
maille verify cube.maille > /dev/full
echo "exit $?"
test -c /dev/full
