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
# So do those of a VTKHDF file.
cp "$HERE/../formats/steps.hdf" .
maille compress -q steps.hdf
maille info --json steps.maille | json '[(step["time"], step["arrays"]) for step in j["steps"]]'
