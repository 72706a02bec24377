# Every way to allow a loss keeps its bound, as verify measures it on the decoded file.
for options in '-e 0.01' '--rel-error 0.001' '--bits 8' '-e quality=0.5' '--rel-error quality=0.01' '--bits quality=9' \
  '-e position=0.01' '--bits normal=8' '-e 0.003 --bits quality=8 -e normal=0.01' '--bits 10 --keep-order'; do
  # shellcheck disable=SC2086
  maille compress -q -f $options wave.ply wave.maille
  maille verify --json wave.maille --against wave.ply | json \
    'j["same"], [a["name"] + (" lossless" if a["lossless"] else " lossy") for a in j["arrays"] if a["good"]]'
done
# A bound for another unit than the file's is told, and kept.
maille compress -f -e 0.1 cube.ply out.maille 2>&1 | grep 'note'
maille compress -f -e 0.01 cube.ply out.maille 2>&1 | grep 'note'
maille compress -q -f -e 0.1 cube.ply out.maille 2>&1
