# Exit code 6 for every damage, whoever finds it; no output is left.
maille compress -q wave.ply
size=$(stat -c %s wave.maille)
head -c $((size / 2)) wave.maille > half.maille
head -c 5 wave.maille > stub.maille
: > empty.maille
cp wave.maille flipped.maille
printf '\377' | dd of=flipped.maille bs=1 seek=$((size / 2)) conv=notrunc status=none
printf 'this is no mesh at all' > text.maille
for file in half stub empty flipped text; do
  maille verify $file.maille > answer 2>&1
  echo "$file: verify $?"
  maille decompress $file.maille out.ply 2> error
  echo "$file: decompress $?, $(wc -l < error) line"
  maille diff $file.maille wave.ply > answer 2>&1
  echo "$file: diff $?"
done
files_like 'out*'
files_like '.*part'
maille verify flipped.maille | head -1
maille verify --json flipped.maille | json 'len(j["damage"]) > 0'
