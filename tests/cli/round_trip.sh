# The main job: compress, decompress, compare. Lossless, every format, arrays included.
for mesh in cube.ply cube_shuffled.ply house.obj tetra.off tetra.stl wave.ply; do
  maille compress -q "$mesh" "$mesh.maille"
  maille decompress -q "$mesh.maille" "$mesh.back.ply"
  maille diff "$mesh" "$mesh.maille"
  maille diff "$mesh" "$mesh.back.ply"
done
