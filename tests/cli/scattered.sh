# A volume whose cells and points come in no order, as many generators write them: coded in another order with theirs
# beside it, and back in theirs whatever way it is read.
python3 - <<'PY'
import random
random.seed(3)
n = 12
places = list(range((n + 1) ** 3))
random.shuffle(places)
cells = [[places[x + (n + 1) * (y + (n + 1) * z) + d] for d in (0, 1, n + 2, n + 1, (n + 1) ** 2, (n + 1) ** 2 + 1, (n + 1) ** 2 + n + 2, (n + 1) ** 2 + n + 1)]
         for z in range(n) for y in range(n) for x in range(n)]
random.shuffle(cells)
points = [None] * len(places)
for i, place in enumerate(places): points[place] = (i % (n + 1), i // (n + 1) % (n + 1), i // (n + 1) ** 2)
with open("scattered.vtk", "w") as f:
    f.write("# vtk DataFile Version 3.0\nscattered\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS %d float\n" % len(points))
    for p in points: f.write("%d %d %d\n" % p)
    f.write("CELLS %d %d\n" % (len(cells), 9 * len(cells)))
    for c in cells: f.write("8 " + " ".join(map(str, c)) + "\n")
    f.write("CELL_TYPES %d\n" % len(cells) + "12\n" * len(cells))
    f.write("CELL_DATA %d\nSCALARS id int 1\nLOOKUP_TABLE default\n" % len(cells) + "".join("%d\n" % i for i in range(len(cells))))
PY
maille compress -q scattered.vtk
maille info --json scattered.maille | json '(j["order"], any(c["type"] == "ordr" for c in j["chunks"]))'
maille verify scattered.maille --against scattered.vtk
maille decompress -q scattered.maille parts.vtu && maille diff --same-order scattered.vtk parts.vtu
maille decompress -q scattered.maille whole.vtk && maille diff --same-order scattered.vtk whole.vtk
maille convert -q scattered.vtk file.vtu && maille compress -q file.vtu
maille info --json file.maille | json 'any(c["type"] == "ordr" for c in j["chunks"])'
cat scattered.maille | maille decompress -q - piped.vtu && maille diff --same-order scattered.vtk piped.vtu
maille append -q scattered.maille parts.vtu --time 1
maille decompress -q scattered.maille step.vtu --step 1 && maille diff --same-order scattered.vtk step.vtu
