# Values of later times: appended one by one or from a list, listed, read each by itself.
python3 - <<'PY'
def write(name, t):
    n = 3
    points = [(x, y, z) for z in range(n) for y in range(n) for x in range(n)]
    cells = [[x + 3 * y + 9 * z + d for d in (0, 1, 4, 3, 9, 10, 13, 12)] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    with open(name, "w") as f:
        f.write("# vtk DataFile Version 3.0\nstep\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 27 float\n")
        for p in points: f.write("%d %d %d\n" % p)
        f.write("CELLS 8 72\n")
        for c in cells: f.write("8 " + " ".join(map(str, c)) + "\n")
        f.write("CELL_TYPES 8\n" + "12\n" * 8)
        f.write("POINT_DATA 27\nSCALARS p float 1\nLOOKUP_TABLE default\n")
        for i in range(27): f.write("%g\n" % (i * 0.5 + t))
        f.write("CELL_DATA 8\nSCALARS id int 1\nLOOKUP_TABLE default\n" + "".join("%d\n" % i for i in range(8)))
for t in range(4): write("flow_%d.vtk" % t, t)
open("run.pvd", "w").write('<VTKFile type="Collection"><Collection><DataSet timestep="0.2" file="flow_2.vtk"/>'
                           '<DataSet timestep="0.3" file="flow_3.vtk"/></Collection></VTKFile>')
PY
maille compress -q flow_0.vtk flow.maille
maille append flow.maille flow_1.vtk --time 0.1
maille append flow.maille run.pvd
maille info --json flow.maille | json '[step["time"] for step in j["steps"]]'
for step in 0 1 2 3; do
  maille decompress -q -f --step $step flow.maille step.vtk && maille diff step.vtk flow_$step.vtk
done
maille decompress -q -f --time 0.3 flow.maille step.vtk && maille diff step.vtk flow_3.vtk
maille verify flow.maille
# A step that is damaged, and one that was cut short.
at=$(maille info --json --chunks flow.maille | json '[c["offset"] for c in j["chunks"] if c["type"] == "SVAL"][-1]')
cp flow.maille flipped.maille
printf '\377\377' | dd of=flipped.maille bs=1 seek=$((at + 30)) conv=notrunc status=none
head -c $((at + 30)) flow.maille > short.maille
for file in flipped short; do
  maille verify $file.maille > answer 2>&1
  echo "$file: verify $?"
  maille verify $file.maille --against flow_0.vtk > answer 2>&1
  echo "$file: verify --against $?"
done
maille compress -q run.pvd && maille info --json run.maille | json '[step["time"] for step in j["steps"]]'
maille decompress -q -f --time 0.2 run.maille step.vtk && maille diff step.vtk flow_2.vtk
try maille decompress -q -f --time 0.4 flow.maille step.vtk
try maille decompress -q -f --step 9 flow.maille step.vtk
try maille append -q flow.maille cube.ply
sed 's/^2 2 2$/2 2 2.5/' flow_1.vtk > moved.vtk
try maille append -q flow.maille moved.vtk
sed 's/^8 0 1 4 3 9/8 1 0 4 3 9/' flow_1.vtk > turned.vtk
try maille append -q flow.maille turned.vtk
maille compress -q cube.ply && try maille append -q cube.maille cube.ply
try maille append -q flow.maille flow_1.vtk --error 0.1
# All of a series or nothing; of many steps not all are told.
sed 's/flow_3/lost/' run.pvd > broken.pvd
try maille compress -q broken.pvd
files_like '*broken*'
maille compress -f run.pvd 2>&1 | grep -e '^run.pvd' -e 'of time' | sed 's/;.*//'
maille compress -f --json run.pvd | json 'j["steps"], j["output"], j["file_bytes"] == __import__("os").path.getsize("run.maille")'
for time in 0.4 0.5 0.6 0.7 0.8 0.9 1.0 1.1 1.2; do maille append -q run.maille flow_1.vtk --time $time; done
try maille decompress run.maille step.vtk --time 0.52
maille append run.maille flow_2.vtk --time 0.5
# As a list again: a mesh's own values are a time where the steps do not say the same, and there are any.
maille compress -q -f flow_0.vtk again.maille && maille append -q again.maille flow_0.vtk flow_1.vtk
maille decompress -q -f again.maille again.pvd && grep -o 'timestep="[^"]*"' again.pvd
maille compress -q -f flow_0.vtk later.maille && maille append -q later.maille flow_1.vtk
maille decompress -q -f later.maille later.pvd && grep -o 'timestep="[^"]*"' later.pvd
maille compress -q -f --drop p,id flow_0.vtk bare.maille && maille append -q bare.maille flow_0.vtk flow_1.vtk
maille decompress -q -f bare.maille bare.pvd && grep -o 'timestep="[^"]*"' bare.pvd
# A step that was appended by mistake says nothing new, and is taken away again.
cp again.maille before.maille
maille append again.maille flow_1.vtk
maille append --remove-last again.maille
cmp again.maille before.maille && maille append -q --json --remove-last again.maille | json 'j["removed_step"], j["time"]'
maille append -q --remove-last again.maille && try maille append --remove-last again.maille
try maille append again.maille
try maille append again.maille flow_1.vtk --remove-last
# What is of the mesh as a whole, but its time, is in no step: a note says so.
sed 's/^DATASET UNSTRUCTURED_GRID$/&\nFIELD FieldData 1\nload 1 1 float\n7/' flow_1.vtk > loaded.vtk
maille append flow.maille loaded.vtk --time 7 | sed 's/,.*//'
# Steps and components that cannot be.
try maille extract -q flow.maille none.vtu --where 'p > 5' --step -1
try maille extract -q flow.maille none.vtu --where 'p[1] > 5' --step 2
# Solvers add up their steps of time: shown and found as the time that is meant.
maille compress -q flow_0.vtk sums.maille
maille append -q sums.maille flow_3.vtk --time 0.30000000000000004
maille info sums.maille | grep -c ' 0\.3 '
maille decompress -q -f sums.maille last.vtu --time 0.3
try maille decompress -f sums.maille last.vtu --time 9
