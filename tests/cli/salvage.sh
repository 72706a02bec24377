# A stream that was cut gives what came before the cut, exit code 6.
cp "$HERE/../golden/stream/bricks.maille" whole.maille
maille decompress -q --salvage whole.maille whole.vtu
echo "whole: $?"
size=$(stat -c %s whole.maille)
head -c $((size - 5)) whole.maille > cut.maille
maille decompress -q --salvage cut.maille cut.vtu
echo "cut: $?"
maille diff cut.vtu whole.vtu
head -c 250 whole.maille > short.maille
maille decompress -q --salvage short.maille short.vtu
echo "short: $?"
try maille decompress -q cut.maille out.vtu
