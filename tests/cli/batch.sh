# Many meshes at once: beside their inputs, in a folder, or from folders; what fails does not stop the others.
maille compress cube.ply tetra.off house.obj
maille compress -q -f cube.ply house.obj
maille compress -q -f cube.ply house.maille
mkdir -p scans/deep scans/.hidden
cp cube.ply tetra.off scans
cp wave.ply scans/deep
cp cube.ply scans/.hidden/no.ply
cp cube.ply scans/tetra.ply
echo 'no mesh' > scans/broken.ply
try maille compress -r scans --output-folder packed
(cd packed && find . -type f | sort)
rm packed/broken.maille 2> /dev/null
try maille decompress -r packed --output-folder back --output-format obj
(cd back && find . -type f | sort)
maille diff cube.ply packed/cube.maille
try maille compress cube.ply - tetra.off
try maille compress -r back/deep --output-folder back -o x
try maille compress -r scans/.hidden --output-folder none
maille compress -f --json cube.ply tetra.off | grep '"input"'
files_like '*.maille'
