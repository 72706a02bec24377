# A glTF file that keeps everything but its geometry, which a .maille file in it holds.
maille convert -q wave.ply wave.glb
maille compress wave.glb wave.maille.glb
maille info wave.maille.glb | head -3
maille verify wave.maille.glb --against wave.glb
maille diff wave.glb wave.maille.glb
maille decompress wave.maille.glb back.glb
maille diff -q wave.glb back.glb
maille compress wave.glb wave.maille.gltf --bits 12 --json | grep compressed
maille verify wave.maille.gltf --against wave.glb
try maille compress wave.maille.glb again.maille.glb
try maille compress wave.ply wave2.maille.glb
try maille decompress wave.maille.glb back.ply
try maille compress --mode random wave.glb wave3.maille.glb

# What has no nodes gets positions as the scene shows them.
python3 - <<'PYTHON'
import base64, json, struct
data = struct.pack('<9f', 0, 0, 0, 1, 0, 0, 0, 1, 0)
json.dump({'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0, 1]}],
           'nodes': [{'mesh': 0}, {'mesh': 0, 'translation': [0, 0, 4], 'scale': [2, 2, 2]}],
           'meshes': [{'primitives': [{'attributes': {'POSITION': 0}}]}],
           'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 3, 'type': 'VEC3'}],
           'bufferViews': [{'buffer': 0, 'byteLength': 36}],
           'buffers': [{'byteLength': 36, 'uri': 'data:application/octet-stream;base64,' + base64.b64encode(data).decode()}]},
          open('two.gltf', 'w'))
PYTHON
maille convert -q two.gltf two.off
grep '^[02] [02] 4' two.off
maille convert -q --as-stored two.gltf one.off
sed -n 2p one.off
maille compress -q two.gltf two.maille
maille decompress two.maille again.off
cmp two.off again.off
