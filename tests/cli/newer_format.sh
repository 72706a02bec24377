# Exit code 5: a file of a later version of the format. (Byte 8: the major version, docs/format.md.)
maille compress -q cube.ply
printf '\143' | dd of=cube.maille bs=1 seek=8 conv=notrunc status=none
maille info cube.maille 2> error
echo "info $?"
maille decompress cube.maille out.ply 2>> error
echo "decompress $?"
wc -l < error
grep -c 'newer\|needs maille\|version' error
