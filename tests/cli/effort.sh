# Every effort gives a file that holds the mesh.
for effort in 1 2 3 4 5 6 7 8 9; do
  maille compress -q -f -$effort wave.ply wave.maille
  maille diff -q wave.ply wave.maille || echo "-$effort: exit $?"
  maille info --json wave.maille | json 'j["effort"]'
done
