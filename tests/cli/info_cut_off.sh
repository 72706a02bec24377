# A file cut off or damaged still tells what it can; that it is not whole stands on standard error, with exit code 6.
maille compress -q wave.ply
size=$(stat -c %s wave.maille)
for kept in $((size - 1)) $((size / 2)); do
  head -c $kept wave.maille > cut.maille
  try maille info cut.maille > answer
  grep -e '^points' -e '^exit' answer
  try maille info --json cut.maille > answer
  tail -n 1 answer
  sed '$d' answer | json 'j["points"], len(j["problems"]) > 0'
done
maille info --json wave.maille | json 'j["problems"]'
