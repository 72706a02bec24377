# The time steps of an Exodus file become steps of one file; each comes back as the file has it.
cp "$HERE/../formats/small.e" run.e
maille compress -q run.e
maille info --json run.maille | json '[(step["time"], step["arrays"]) for step in j["steps"]]'
for step in 1 2; do
  maille decompress -q -f --step $step --ascii run.maille step.vtk && grep -A 2 '^T 1 ' step.vtk | tail -n +2 | cut -c 1-40
done
maille compress -q --any-order run.e last.maille
maille info --json last.maille | json 'j["steps"]'
maille decompress -q last.maille last.vtu
maille diff last.vtu run.e 2> /dev/null
maille append run.maille run.e -q
maille info --json run.maille | json 'len(j["steps"])'
# So do the steps of a VTKHDF file.
cp "$HERE/../formats/steps.hdf" .
maille compress -q steps.hdf
maille info --json steps.maille | json '[(step["time"], step["arrays"]) for step in j["steps"]]'
# All steps against the series, and a note where a file takes one of them only.
maille compress -q -f run.e series.maille
maille verify series.maille --against run.e | head -2
maille decompress series.maille back.vtu 2>&1 | grep note
maille decompress -q -f --step 1 series.maille back.vtu
maille decompress -q series.maille run.pvd
# The mesh's own values are of its last time, which is another file of the list than the first.
maille verify series.maille --against run.pvd | sed -n 2p
maille compress -q run.pvd again.maille
maille verify again.maille --against run.pvd | head -2
cp run_1.vtu run_0.vtu
try maille verify -q again.maille --against run.pvd
