# docs/command.md is what the command says now; if not: maille completion markdown > docs/command.md
maille completion markdown | diff "$HERE/../../docs/command.md" -
maille completion man > maille.1
head -2 maille.1
for verb in compress decompress info verify diff convert stencil subdivide generate extract serve bench completion; do
  grep -q "^\.SS $verb" maille.1 || echo "$verb is missing"
done
if command -v groff > /dev/null; then groff -man -ww -z maille.1; fi
