"""Section 17 of docs/format.md: mode random."""

import around
import single
from container import Fields, hash64, require
from description import CELLS, CORNERS, MESH, NODES, POINTS, TRIANGLE, Block, Description
from entropy import CodedSequence
from fans import fan_tables


class TableSet:
    """17.7: what charts share."""

    def __init__(self, stream, array):
        fields = Fields(stream)
        fans = CodedSequence(fields.section())
        # whether the set is for polygons is said behind the tables that depend on it
        self.topo = 2 if Fields(fields.data, fields.at).count() & around.POLYGONS else 1
        self.fan_tables = fan_tables(fans, self.topo)
        fans.end()
        self.header = around.Header(fields, array.type, 3, shared=True)
        fields.end()


def sphere(fields):
    return [fields.number("H") for _ in range(4)]


class Directory:
    """17.1."""

    def __init__(self, stream, arrays):
        fields = Fields(stream)
        self.groups = fields.count(2**32 - 1)
        levels = fields.count(255)
        self.faces, self.charts = (fields.list(fields.count) for _ in range(2))
        require(self.groups and levels and len(self.faces) == len(self.charts) == levels, "a directory that cannot be")
        self.low, self.size = [fields.f64() for _ in range(3)], fields.f64()
        require(self.size > 0, "a frame without size")
        for _ in range(2):
            totals = fields.count(), fields.list(fields.count), fields.count()
            require(len(totals[1]) <= arrays + 1, "totals of other arrays")
        self.pages = fields.list(lambda: (fields.number("Q"), fields.number("I")))
        require(len(self.pages) == (self.groups - 1) // 256 + 1, "other pages than groups")
        fields.end()


class Group:
    """17.2: an entry of the index."""

    def __init__(self, fields, number):
        self.level, self.view_error, self.bound = fields.u8(), fields.number("f"), fields.number("f")
        self.sphere, self.offset = sphere(fields), fields.number("Q")
        self.replaces, count = fields.count(2**32 - 1), fields.count(2**32 - 1)
        self.charts = []
        for _ in range(count):
            around_, half, producer = sphere(fields), fields.take(3), fields.count()
            self.charts.append((number + producer if producer else None, fields.count(), fields.count(), fields.number("I")))


def groups(container, directory):
    found = []
    for page in range(len(directory.pages)):
        fields = Fields(container.stream("CIDX", page))
        for _ in range(min(256, directory.groups - 256 * page)):
            found.append(Group(fields, len(found)))
        fields.end()
    return found


class Reduced:
    """The description of a chart: of the file, or at coarser levels of triangles and some arrays."""

    def __init__(self, description, level, arrays):
        self.positions, self.welded = description.positions, False
        self.blocks = description.blocks if level == 0 else [Block("", TRIANGLE, 0)]
        self.arrays = description.arrays if level == 0 else arrays


def chart(data, description, level, tables_):
    """17.3: a patch, and the points that other charts have, too."""
    fields = Fields(data)
    points = fields.count(2**32 - 2)
    blocks = Reduced(description, level, []).blocks
    cells = [fields.count() for _ in blocks]
    fixed = all(NODES[b.type] for b in blocks)
    corners = sum(n * NODES[b.type] for n, b in zip(cells, blocks)) if fixed else fields.count()
    shared = fields.section() if level == 0 else None
    arrays = description.arrays
    if level:
        count = fields.count()
        arrays = [a for a in arrays if a.domain in (POINTS, CELLS, CORNERS)]
        if count != len(arrays) + 1:
            arrays = [a for a in arrays if a.domain == POINTS]
        require(count == len(arrays) + 1, "a chart of other arrays")
    codings = fields.count(255)
    names = [("TOPO", codings % 16), ("POSI", codings // 16)]
    names += [("ARRY", i) for i in range(len(arrays))]
    sizes = [fields.count() for _ in names[:-1]]
    streams = {name: fields.take(size) for name, size in zip(names, sizes)}
    streams[names[-1]] = fields.rest()
    streams = {name: data for name, data in streams.items() if data or name[0] != "ARRY"}
    patch = single.Patch(streams, Reduced(description, level, arrays), points, corners, cells, tables_)
    if level:
        return patch, None
    nodes = [n for block in patch.blocks for _, n in block]
    return patch, single.shared_points(shared, single.border_points(nodes, points))


def decode(container):
    """The mesh (level 0), with the patches of all coarser charts by level."""
    d = Description(container.stream("DESC"))
    sets = [TableSet(container.stream("CTAB", i), d.positions) if container.has("CTAB", i) else None for i in range(2)]
    directory = Directory(container.stream("CDIR"), len(d.arrays))
    finest, shared, coarser = [], [], []
    for g, group in enumerate(groups(container, directory)):
        fields = Fields(container.stream("CHRT", g))
        head = fields.count(), fields.count(), fields.number("f"), fields.number("f")
        require(head == (group.level, group.replaces, group.view_error, group.bound), "a head that differs from the index")
        listed = fields.list(lambda: (fields.count(), fields.count(), fields.count()))
        own = [(0 if producer is None else 1 + producer, faces, size) for producer, faces, size, _ in group.charts]
        require(listed == own, "charts that differ from the index")
        for _, faces, size, check in group.charts:
            data = fields.take(size)
            require(hash64(data) & 0xFFFFFFFF == check, "a chart is damaged")
            patch, points = chart(data, d, group.level, sets[min(group.level, 1)])
            require(sum(map(len, patch.blocks)) == faces, "other cells than the index says")
            if group.level == 0:
                finest.append(patch)
                shared.append(points)
            else:
                coarser.append((group.level, patch))
        fields.end()
    whole = [None] * (1 + len(d.arrays))
    for i, array in enumerate(d.arrays):
        if array.domain == MESH:
            whole[i + 1] = single.mesh_array(container.stream("ARRY", 0, i), array)
    mesh = single.join(d, finest, shared, whole)
    if d.form & 1:
        single.reorder(mesh, container.stream("ORDR"))
    mesh.coarser = coarser
    return mesh
