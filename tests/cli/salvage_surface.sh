# Modes single and random give what is whole, and say what is lost; exit code 6.
damage() {
  # MESH NAME TYPE: a bit in the middle of the last chunk of that type
  python3 - "$HERE/../golden/$1.maille" "$2" "$(maille info --chunks --json "$HERE/../golden/$1.maille" |
    json "[(c['offset'], c['size']) for c in j['chunks'] if c['type'] == '$3'][-1]")" <<'PY'
import ast
import sys

data = bytearray(open(sys.argv[1], "rb").read())
offset, size = ast.literal_eval(sys.argv[3])
data[offset + max(size // 2, 12)] ^= 16
open(sys.argv[2], "wb").write(data)
PY
}
damage single/textured_quads array.maille ARRY
try maille decompress -q --salvage array.maille array.ply
maille info array.ply | grep -e faces: -e uv
damage single/keep_order order.maille ORDR
try maille decompress -q --salvage order.maille order.ply
damage single/twins twins.maille TWIN
try maille decompress -q --salvage twins.maille twins.ply
damage single/twins positions.maille POSI
try maille decompress -q --salvage positions.maille positions.ply
damage random/keep_order chart.maille CHRT
try maille decompress -q --salvage chart.maille chart.ply
damage random/keep_order index.maille CIDX
try maille decompress -q --salvage index.maille index.ply
maille decompress -q "$HERE/../golden/random/keep_order.maille" whole.ply
maille diff index.ply whole.ply
