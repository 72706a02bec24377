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
