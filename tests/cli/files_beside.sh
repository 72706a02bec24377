# What a file names beside itself counts as input: buffers of a .gltf, values of XDMF and EnSight, pieces of a .pvtu.
python3 - <<'PY'
import json, struct
points = [(x, y, 0.1 * x * y) for y in range(20) for x in range(20)]
faces = [(a, a + 1, a + 21, a, a + 21, a + 20) for y in range(19) for a in range(20 * y, 20 * y + 19)]
data = b"".join(struct.pack("<3f", *p) for p in points) + b"".join(struct.pack("<6H", *f) for f in faces)
split = 12 * len(points)
json.dump({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
           "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
           "buffers": [{"uri": "wave.bin", "byteLength": len(data)}],
           "bufferViews": [{"buffer": 0, "byteLength": split}, {"buffer": 0, "byteOffset": split, "byteLength": len(data) - split}],
           "accessors": [{"bufferView": 0, "componentType": 5126, "count": 400, "type": "VEC3", "min": [0, 0, 0], "max": [19, 19, 36.1]},
                         {"bufferView": 1, "componentType": 5123, "count": 6 * len(faces), "type": "SCALAR"}]}, open("wave.gltf", "w"))
open("wave.bin", "wb").write(data)
PY
cp "$HERE"/../formats/ensight/{all,le_stars}* "$HERE"/../formats/pieces*.{pvtu,vtu} .
bytes() { cat "$@" | wc -c; }
says() { json "j[\"input_bytes\"] == $1"; }
maille compress -q --json wave.gltf | says "$(bytes wave.gltf wave.bin)"
maille convert -q -f --json wave.gltf wave.ply | says "$(bytes wave.gltf wave.bin)"
maille compress -q --json all.case | says "$(bytes all.{case,geo,sym,vec})"
maille compress -q --json pieces.pvtu | says "$(bytes pieces*.pvtu pieces_?.vtu)"
maille info --json wave.gltf | json "j['file_bytes'] == $(bytes wave.gltf wave.bin)"
# All files of a series, each once; and of several inputs.
sed -i -e 's/^model: .*/model: le_stars002.geo/' le_stars.case
maille compress -q --json le_stars.case | says "$(bytes le_stars.case le_stars002.geo le_stars*.p le_stars*.v)"
rm -f wave.maille all.maille
maille compress wave.gltf all.case 2>&1 | grep '^2 files' | sed 's/ (.*//'
