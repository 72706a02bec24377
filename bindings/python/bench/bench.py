"""What the Python package costs beside a call of the library: python bench.py PROGRAM (bench/decode.cpp).

Both take turns, and processor times are compared, so that other work on the machine disturbs both alike.
"""

import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import maille

ROUNDS = 15


def wavy(n=1000):
    """n * n points, 2 (n - 1)^2 triangles, an array of floats."""
    x, y = (part.ravel() for part in np.meshgrid(np.arange(n, dtype=np.float32), np.arange(n, dtype=np.float32)))
    z = (10 * np.sin(x / 40) * np.cos(y / 30)).astype(np.float32)
    number = np.arange(n * n, dtype=np.uint32).reshape(n, n)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    triangles = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return np.column_stack([x, y, z]), triangles, np.hypot(x, y)


def processor(work):
    begin = time.process_time()
    result = work()
    return time.process_time() - begin, result


points, triangles, field = wavy()
seconds, mesh = processor(lambda: maille.Mesh(points, {"triangle": triangles}, point_data={"r": field}))
shared = all(np.shares_memory(a, b) for a, b in ((mesh.points, points), (mesh.point_data["r"], field),
                                                 (mesh.cells[0].connectivity, triangles)))
print(f"Mesh(...) from numpy: {1000 * seconds:.1f} ms; copies of the input: {0 if shared else 'some'}")
seconds, data = processor(lambda: maille.encode(mesh, effort=1))
print(f"encode, effort 1: {seconds:.2f} s of processor time, {len(data)} bytes")

with tempfile.NamedTemporaryFile(suffix=".maille") as file:
    file.write(data)
    file.flush()
    with subprocess.Popen([sys.argv[1], file.name], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        theirs, ours = [], []
        for _ in range(ROUNDS):
            other.stdin.write("\n")
            other.stdin.flush()
            theirs.append(float(other.stdout.readline()))
            ours.append(processor(lambda: maille.decode(data))[0])
        other.stdin.close()
ratio = statistics.median(ours) / statistics.median(theirs)
print(f"decode: Python {statistics.median(ours):.3f} s, C++ {statistics.median(theirs):.3f} s of processor time: "
      f"{ratio:.3f} (least of each: {min(ours) / min(theirs):.3f})")

times = []
for _ in range(50):
    fresh = maille.Mesh._of(mesh._core)
    times.append(processor(lambda: (fresh.points, fresh.cells, fresh.point_data["r"]))[0])
print(f"views of positions, connectivity and one array: {1e6 * statistics.median(times):.0f} us")
