# --memory bounds the process: below the least, which is named, it refuses; from there on it keeps to it.
cat > box.py <<'END'
import array, random, sys
n, layers, shuffled = int(sys.argv[1]), int(sys.argv[2]), len(sys.argv) > 4
points = [(x, y, z) for z in range(layers + 1) for y in range(n + 1) for x in range(n + 1)]
at = lambda x, y, z: (z * (n + 1) + y) * (n + 1) + x
corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
cells = [[at(x + a, y + b, z + c) for a, b, c in corners] for z in range(layers) for y in range(n) for x in range(n)]
if shuffled:
    random.seed(1)
    places = random.sample(range(len(points)), len(points))
    points = [p for _, p in sorted(zip(places, points))]
    random.shuffle(cells)
    cells = [[places[p] for p in cell] for cell in cells]
columns = [('Float32', 'Points', 3, array.array('f', sum(points, ()))),
           ('Int32', 'connectivity', 1, array.array('i', [p for cell in cells for p in cell])),
           ('Int32', 'offsets', 1, array.array('i', range(8, 8 * len(cells) + 1, 8))),
           ('UInt8', 'types', 1, array.array('B', [12] * len(cells)))]
tags, offset = [], 0
for kind, name, components, values in columns:
    tags.append(f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" format="appended" offset="{offset}"/>')
    offset += 8 + len(values.tobytes())
with open(sys.argv[3], 'wb') as f:
    f.write(('<VTKFile type="UnstructuredGrid" byte_order="LittleEndian" header_type="UInt64"><UnstructuredGrid>'
             f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}"><Points>{tags[0]}</Points>'
             f'<Cells>{"".join(tags[1:])}</Cells></Piece></UnstructuredGrid><AppendedData encoding="raw">_').encode())
    for *_, values in columns:
        f.write(len(values.tobytes()).to_bytes(8, 'little') + values.tobytes())
    f.write(b'</AppendedData></VTKFile>')
END
cat > bound.py <<'END'
import os, re, shutil, subprocess, sys
sanitized = b'__asan_init' in open(shutil.which('maille'), 'rb').read()  # takes memory of its own

def compress(limit, arguments):
    p = subprocess.Popen(['maille', 'compress', '-q', '-f', '--memory', str(limit), *arguments], stderr=subprocess.PIPE)
    said = p.stderr.read().decode()
    _, status, usage = os.wait4(p.pid, 0)
    return os.waitstatus_to_exitcode(status), usage.ru_maxrss * 1024, said

least, code = 1 << 20, 7
for attempt in range(4):  # what can be told before cells are put in order is less
    code, _, said = compress(least, sys.argv[1:])
    if code == 0:
        break
    assert code == 7 and not os.path.exists('packed.maille'), said
    least = int(re.search('([0-9]+) MiB of memory are the least', said).group(1)) << 20
assert code == 0 and attempt > 0, said
for limit in least, least * 3 // 2, least * 4:
    code, used, said = compress(limit, sys.argv[1:])
    if code or used > limit and not sanitized:
        print(f'{sys.argv[1:]}: {used >> 20} of {limit >> 20} MiB, exit {code} {said}')
END
python3 box.py 40 12 sweep.vtu
python3 box.py 22 22 shuffled.vtu yes
maille convert -q shuffled.vtu shuffled.mesh
mkdir tmp
export TMPDIR=$PWD/tmp
for way in "sweep.vtu" "shuffled.vtu" "--any-order shuffled.vtu" "-9 --any-order shuffled.vtu" "--any-order shuffled.mesh"; do
  rm -f packed.maille
  # shellcheck disable=SC2086
  python3 bound.py $way packed.maille
done
maille diff packed.maille shuffled.vtu
files_like 'tmp/*'
