# Exit code 9: missing folder, full disk, a folder as output, answers that cannot be printed.
try maille convert cube.ply no/such/folder/out.obj
try maille convert cube.ply /dev/full --output-format obj
maille convert cube.ply --output-format obj - > /dev/full
echo "exit $?"
mkdir folder.obj
try maille convert -f cube.ply folder.obj
maille --help > /dev/full
echo "exit $?"
maille diff cube.ply cube.ply > /dev/full
echo "exit $?"
