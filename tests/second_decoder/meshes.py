"""Small random meshes, written as VTU files: what the encoder makes of them is this decoder's food."""
import numpy as np

HEAD = """<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64"><UnstructuredGrid>
"""


def write_vtu(path, points, cells, point_arrays=(), cell_arrays=(), corner_arrays=()):
    """Cells are (type, points); arrays (name, values)."""
    blobs, types = [], {"f": "Float", "i": "Int", "u": "UInt"}

    def data_array(name, values, more=""):
        more += ' maille_role="normal"' if name == "normal" else ""
        values = np.ascontiguousarray(values)
        type_ = f"{types[values.dtype.kind]}{8 * values.dtype.itemsize}"
        components, offset = values.shape[1] if values.ndim > 1 else 1, sum(map(len, blobs))
        blobs.append(np.uint64(values.nbytes).tobytes() + values.tobytes())
        tag = f'<DataArray type="{type_}" Name="{name}" NumberOfComponents="{components}"'
        return f'{tag}{more} format="appended" offset="{offset}"/>'

    def section(name, arrays, more=lambda values: ""):
        return [f"<{name}>", *(data_array(array, values, more(values)) for array, values in arrays), f"</{name}>"]

    corner = lambda values: f' NumberOfTuples="{len(values)}" maille_domain="corner"'
    nodes = ("connectivity", np.array([p for _, nodes in cells for p in nodes], "i8"))
    ends = ("offsets", np.cumsum([len(nodes) for _, nodes in cells], dtype="i8"))
    tags = section("FieldData", corner_arrays, corner)
    tags.append(f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">')
    tags += section("Points", [("Points", points)])
    tags += section("PointData", point_arrays) + section("CellData", cell_arrays)
    tags += section("Cells", [nodes, ends, ("types", np.array([t for t, _ in cells], "u1"))])
    tags.append('</Piece></UnstructuredGrid><AppendedData encoding="raw">_')
    with open(path, "wb") as file:
        file.write((HEAD + "\n".join(tags)).encode() + b"".join(blobs) + b"\n</AppendedData>\n</VTKFile>\n")


def values_for(rng, x, n_components, dtype):
    """Smooth over the places x, or noise, of few or many different numbers."""
    way = rng.integers(4)
    v = np.stack([np.sin(x @ rng.normal(size=x.shape[1]) * 2 + k) for k in range(n_components)], 1)
    if way == 1:
        v = rng.normal(size=v.shape)
    elif way == 2:
        v = np.round(v * 3) / 4
    if dtype[0] != "f":
        info = np.iinfo(dtype)
        v = np.clip(np.round(v * min(100, info.max)), info.min, info.max)
    v = v.astype(dtype)
    if dtype[0] == "f" and rng.integers(3) == 0 and len(v):
        v[rng.integers(len(v)), 0] = [np.nan, np.inf, -0.0][rng.integers(3)]
    return v


def place_cells(points, cells):
    return np.array([points[nodes].mean(0) for _, nodes in cells]) if cells else np.zeros((0, 3))


def some_arrays(rng, x, most=3):
    made = []
    for i in range(rng.integers(most)):
        kind = ["f4", "f8", "i4", "u1", "i8", "u2", "f4"][rng.integers(7)]
        made.append((f"a{i}", values_for(rng, x, int(rng.integers(1, 6)), kind)))
    return made


def grid_faces(rng, n, m, kind):
    faces = []
    for i in range(n - 1):
        for j in range(m - 1):
            a, b, c, d = i * m + j, (i + 1) * m + j, (i + 1) * m + j + 1, i * m + j + 1
            if kind == "quads" or kind == "mixed" and rng.integers(2):
                faces.append([a, b, c, d])
            else:
                faces += [[a, b, c], [a, c, d]]
    return faces


def merged(rng, faces, times):
    """Joins faces at a common edge to larger polygons."""
    faces = [list(f) for f in faces]
    for _ in range(times):
        f = int(rng.integers(len(faces)))
        k = int(rng.integers(len(faces[f])))
        a, b = faces[f][k], faces[f][(k + 1) % len(faces[f])]
        for g, other in enumerate(faces):
            if g != f and b in other and other[(other.index(b) + 1) % len(other)] == a:
                at = other.index(b)
                turned = other[at:] + other[:at]
                own = faces[f][k + 1 :] + faces[f][: k + 1]
                whole = own + turned[2:]
                if len(set(whole)) == len(whole):
                    faces[f] = whole
                    del faces[g]
                break
    return faces


def terrain(rng, path, n):
    """Large enough for several levels."""
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    points = np.stack([u.ravel(), v.ravel(), np.sin(6 * u * v).ravel()], 1) + rng.normal(size=(n * n, 3)) * 0.001
    cells = [(5, face) for face in grid_faces(rng, n, n, "triangles")]
    write_vtu(path, points.astype("f4"), cells, [("t", np.sin(3 * points).astype("f4"))])


def surface(rng, path):
    n, m = rng.integers(3, 14, 2)
    kind = ["triangles", "quads", "mixed", "polygons"][rng.integers(4)]
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, m), indexing="ij")
    points = np.stack([u.ravel(), v.ravel(), np.sin(3 * u * v).ravel()], 1)
    if rng.integers(3) == 0:
        around, out = 6.3 * u.ravel(), 1 + v.ravel()
        points = np.stack([np.cos(around) * out, np.sin(around) * out, v.ravel()], 1)
    points += rng.normal(size=points.shape) * [0, 0.01, 0.1][rng.integers(3)]
    if rng.integers(2):
        points = np.round(points, 3)
    faces = grid_faces(rng, n, m, "mixed" if kind == "polygons" else kind)
    if kind == "polygons":
        faces = merged(rng, faces, len(faces) // 3)
    if rng.integers(2):  # holes
        faces = [f for f in faces if rng.integers(8)]
    if rng.integers(3) == 0:  # a second sheet that shares points, two faces again, one turned over
        faces += [f[::-1] if rng.integers(2) else list(f) for f in faces[: rng.integers(1 + len(faces))]]
    if rng.integers(3) == 0 and len(faces) > 2:
        faces += [[int(p) for p in rng.permutation(len(points))[:3]] for _ in range(rng.integers(6))]
    if rng.integers(2):
        faces = [faces[i] for i in rng.permutation(len(faces))]
    cells = [({3: 5, 4: 9}.get(len(f), 7), f) for f in faces] or [(5, [0, 1, 2])]
    if rng.integers(4) == 0:
        cells += [(3, [0, 1]), (1, [2]), (4, [0, 1, 2, 3])]
    points = points.astype(["f4", "f8", "f4"][rng.integers(3)])
    if rng.integers(4) == 0:
        points, cells = split(rng, points, cells)
    finish(rng, path, points, cells, bool(rng.integers(3) == 0))


def face_normals(points, cells):
    made = []
    for _, nodes in cells:
        p = points[nodes].astype("f8")
        n = np.cross(p[1:-1] - p[0], p[2:] - p[0]).sum(0) if len(nodes) > 2 else np.zeros(3)
        made.append(n)
    return np.array(made)


def normals(rng, points, cells):
    """(where, values): of points, cells or corners, nearly as positions say."""
    n = face_normals(points, cells)
    where = ["p", "c", "k"][rng.integers(3)]
    if where == "p":
        total = np.zeros((len(points), 3))
        for (_, nodes), v in zip(cells, n):
            for p in nodes:
                total[p] += v
        n = total
    if where == "k":
        n = np.repeat(n, [len(nodes) for _, nodes in cells], 0)
    size = np.linalg.norm(n, axis=1, keepdims=True)
    if rng.integers(6):
        n = n / np.where(size > 0, size, 1)
    n = n + rng.normal(size=n.shape) * [0, 0, 1e-6, 0.01][rng.integers(4)]
    if rng.integers(3) == 0:
        n = np.round(n, 3)
    return where, (-n if rng.integers(4) == 0 else n).astype(["f4", "f4", "f8"][rng.integers(3)])


def split(rng, points, cells):
    """Gives some corners points of their own at the same place."""
    points, made = list(points), []
    known = {}
    for type_, nodes in cells:
        side = int(points[nodes[0]][0] > 0.4)
        made.append((type_, [known.setdefault((p, side), len(known)) for p in nodes]))
    return np.array([points[p] for p, _ in known]), made


def finish(rng, path, points, cells, corners):
    x = points.astype("f8")
    corner_places = np.array([x[p] for _, nodes in cells for p in nodes])
    point_arrays, cell_arrays = some_arrays(rng, x), some_arrays(rng, place_cells(x, cells))
    corner_arrays = some_arrays(rng, corner_places, 2) if corners else []
    if corner_arrays and rng.integers(2):  # a seam
        name, values = corner_arrays[0]
        values[corner_places[:, 0] > 0.5] = values[0]
    if rng.integers(3) == 0:
        where, values = normals(rng, points, cells)
        {"p": point_arrays, "c": cell_arrays, "k": corner_arrays}[where].append(("normal", values))
    named = lambda kind, arrays: [(name if name == "normal" else f"{kind}_{name}", v) for name, v in arrays]
    write_vtu(path, points, cells, named("p", point_arrays), named("c", cell_arrays), named("k", corner_arrays))


def all_types(rng, path, sizes):
    """A cell of each type, then these cells again; `sizes`: nodes by type."""
    ends = np.cumsum(list(sizes.values()))
    cells = [(type_, list(range(end - n, end))) for (type_, n), end in zip(sizes.items(), ends)]
    write_vtu(path, rng.normal(size=(ends[-1], 3)).astype("f4"), 2 * cells)


def quadratic(rng, path):
    """Tetrahedra of a row of cubes, with nodes in the middle of edges, which neighbours share; one cube in four is none."""
    node_of, points = {}, []

    def node(place):
        if node_of.setdefault(place, len(points)) == len(points):
            points.append(place)
        return node_of[place]

    def tetrahedron(*corners):
        edges = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
        places = list(corners) + [tuple((a + b) / 2 for a, b in zip(corners[i], corners[j])) for i, j in edges]
        return 24, [node(place) for place in places]

    cells = []
    for a, b in np.ndindex(6, 3):
        x = [(a + i, b + j, l) for l in (0, 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
        if rng.integers(4):
            cells += [tetrahedron(x[0], x[i], x[j], x[6]) for i, j in ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))]
    write_vtu(path, np.array(points, "f4"), cells)


def volume(rng, path):
    """Hexahedra, wedges and quads, or tetrahedra of a block, in the order of a grid or in none."""
    n, m, k = (int(x) for x in rng.integers(2, 7, 3))
    grid = np.meshgrid(np.arange(n + 1), np.arange(m + 1), np.arange(k + 1), indexing="ij")
    points = np.stack(grid, -1).reshape(-1, 3) / 4
    points = points + rng.normal(size=points.shape) * [0, 0.001, 0.1][rng.integers(3)]
    if rng.integers(2):
        points = np.round(points, 3)
    cells, tets, wedges = [], bool(rng.integers(2)), bool(rng.integers(3) == 0)
    for a, b, c in np.ndindex(n, m, k):
        corners = [(i, j, l) for l in (0, 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
        x = [((a + i) * (m + 1) + b + j) * (k + 1) + c + l for i, j, l in corners]
        if rng.integers(12) == 0:
            continue
        if tets:
            cells += [(10, [x[0], x[i], x[j], x[6]]) for i, j in ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))]
        elif wedges and rng.integers(3) == 0:
            cells += [(13, [x[i] for i in (0, 1, 2, 4, 5, 6)]), (13, [x[i] for i in (0, 2, 3, 4, 6, 7)])]
        else:
            cells += [(12, x)] + ([(9, x[:4])] if wedges and rng.integers(2) else [])
    cells = cells or [(10, [0, 1, 2, 4])]
    if rng.integers(3) == 0:
        cells = [cells[i] for i in rng.permutation(len(cells))]
    point_arrays = [(f"p_{name}", v) for name, v in some_arrays(rng, points)]
    cell_arrays = [(f"c_{name}", v) for name, v in some_arrays(rng, place_cells(points, cells))]
    write_vtu(path, points.astype(["f4", "f8", "f4"][rng.integers(3)]), cells, point_arrays, cell_arrays)
