# A glTF file that keeps everything but its geometry, which a .maille file in it holds.
maille convert -q wave.ply wave.glb
maille compress wave.glb wave.maille.glb
maille info wave.maille.glb | head -3
maille verify wave.maille.glb --against wave.glb
# A file that is there is the output, too, not a second input.
try maille compress wave.glb wave.maille.glb
maille compress -f wave.glb wave.maille.glb
maille diff wave.glb wave.maille.glb
maille decompress wave.maille.glb back.glb
maille diff -q wave.glb back.glb
maille compress wave.glb wave.maille.gltf --bits 12 --json | grep compressed
maille verify wave.maille.gltf --against wave.glb
# A point in another place is no rounding; a format without primitives cannot say what was rounded.
sed 's/^0.142857 0.000000 0.138524/0.142857 0.000000 0.638524/' wave.ply > other.ply
maille convert -q other.ply other.glb
try maille verify wave.maille.gltf --against other.glb
try maille verify wave.maille.gltf --against wave.ply
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

# Weights that were rounded, and meshes of which two share a lattice and one is too large, are held against the original, too.
python3 - <<'PYTHON'
import base64, json, struct
n = 12
points = [(x, y, (x * y) % 5 / 7) for y in range(n) for x in range(n)]
weights = [(x / 13, 1 - x / 13, 0, 0) for y in range(n) for x in range(n)]
corners = [c for y in range(n - 1) for x in range(n - 1) for a in [y * n + x]
           for c in (a, a + 1, a + n, a + 1, a + n + 1, a + n)]
data = b''.join(struct.pack('<3f', *(scale * v for v in p)) for scale in (1, 2, 200) for p in points)
data += b''.join(struct.pack('<4f', *w) for w in weights) + struct.pack(f'<{len(corners)}H', *corners)
data += struct.pack('<4B', 0, 1, 0, 0) * n * n
sizes = [12 * n * n, 12 * n * n, 12 * n * n, 16 * n * n, 2 * len(corners), 4 * n * n]
kinds = [('VEC3', 5126), ('VEC3', 5126), ('VEC3', 5126), ('VEC4', 5126), ('SCALAR', 5123), ('VEC4', 5121)]
json.dump({'asset': {'version': '2.0'},
           'meshes': [{'primitives': [{'indices': 4, 'attributes': {'POSITION': m, 'WEIGHTS_0': 3, 'JOINTS_0': 5}}]}
                      for m in (0, 1, 2)],
           'accessors': [{'bufferView': i, 'type': t, 'componentType': c, 'count': len(corners) if i == 4 else n * n}
                         for i, (t, c) in enumerate(kinds)],
           'bufferViews': [{'buffer': 0, 'byteOffset': sum(sizes[:i]), 'byteLength': s} for i, s in enumerate(sizes)],
           'buffers': [{'byteLength': len(data),
                        'uri': 'data:application/octet-stream;base64,' + base64.b64encode(data).decode()}]},
          open('skins.gltf', 'w'))
PYTHON
maille compress -q skins.gltf skins.maille.glb --bits 12 --bits weights=8
maille verify skins.maille.glb --against skins.gltf
maille compress -q skins.gltf weights.maille.glb --bits weights=8
maille verify weights.maille.glb --against skins.gltf | tail -n +2
