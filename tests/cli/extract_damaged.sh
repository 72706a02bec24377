# A damaged chart costs only itself: the others are written, exit code 6. The whole mesh is refused.
maille subdivide -q --levels 7 tetra.off fine.ply
maille compress -q --mode random fine.ply
middle=$(maille info --json fine.maille | json '[c["offset"] + c["size"] // 2 for c in j["chunks"] if c["type"] == "CHRT"][-1]')
cp fine.maille flipped.maille
printf '\377\377' | dd of=flipped.maille bs=1 seek="$middle" conv=notrunc status=none
try maille extract -q flipped.maille left.ply
try maille decompress -q flipped.maille all.ply
files_like 'all*'
head -c "$middle" fine.maille > cut.maille
maille extract -q cut.maille left.ply -f 2> problems
echo "exit $?, $(wc -l < problems) charts"
maille extract --json cut.maille left.ply -f 2> problems | json 'j["damaged_charts"] > 0, j["cells"] > 1000'
# The index is made anew from the charts: here the directory is hit.
place=$(maille info --json fine.maille | json '[c["offset"] for c in j["chunks"] if c["type"] == "CDIR"][0]')
cp fine.maille lost.maille
printf '\377\377\377\377' | dd of=lost.maille bs=1 seek=$((place + 20)) conv=notrunc status=none
maille extract -q lost.maille whole.ply
maille diff whole.ply fine.ply
try maille info lost.maille > answer
