# With --keep-order everything comes back at its place.
for mesh in cube_shuffled.ply house.obj wave.ply; do
  maille compress -q --keep-order "$mesh" "$mesh.maille"
  maille diff --same-order "$mesh" "$mesh.maille"
done
