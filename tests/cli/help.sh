# Every verb explains itself; the texts of the command and of compress are read word by word here.
maille --help
maille compress --help
for verb in compress decompress info verify diff convert completion; do
  maille "$verb" --help > help || echo "$verb: exit $?"
  grep -q "^Usage: maille $verb" help || echo "$verb: no usage"
  grep -q "^Examples:" help || echo "$verb: no examples"
  maille help "$verb" | cmp - help
done
maille c --help | cmp - <(maille compress --help)
