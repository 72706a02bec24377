"""Section 17 of docs/format.md: mode random."""

from types import SimpleNamespace

import around
import arrays
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


def count_of_groups(stream, arrays):
    """17.1: the directory, of which only this is needed to read all."""
    fields = Fields(stream)
    groups, levels = fields.count(2**32 - 1), fields.count(255)
    faces, charts = fields.list(fields.count), fields.list(fields.count)
    require(groups and levels and len(faces) == len(charts) == levels, "a directory that cannot be")
    fields.take(24)
    require(fields.f64() > 0, "a frame without size")
    for _ in range(2):
        totals = fields.count(), fields.list(fields.count), fields.count()
        require(len(totals[1]) <= arrays + 1, "totals of other arrays")
    pages = fields.list(lambda: fields.take(12))
    require(len(pages) == (groups - 1) // 256 + 1, "other pages than groups")
    fields.end()
    return groups


def index_entry(fields, number):
    """17.2: the head that a group must have, its charts, and checks of these."""
    level, error, bound = fields.u8(), fields.number("f"), fields.number("f")
    fields.take(16)  # sphere, offset
    replaces, charts, checks = fields.count(2**32 - 1), [], []
    for _ in range(fields.count(2**32 - 1)):
        fields.take(11)  # sphere, half-axes
        producer = fields.count()
        charts.append((1 + number + producer if producer else 0, fields.count(), fields.count()))
        checks.append(fields.number("I"))
    return (level, replaces, error, bound), charts, checks


def chart(data, description, level, table_set):
    """17.3: a patch, and the section of points that other charts have, too."""
    fields = Fields(data)
    points = fields.count(2**32 - 2)
    blocks = description.blocks if level == 0 else [Block("", TRIANGLE, 0)]
    cells = [fields.count() for _ in blocks]
    fixed = all(NODES[b.type] for b in blocks)
    corners = sum(n * NODES[b.type] for n, b in zip(cells, blocks)) if fixed else fields.count()
    shared = fields.section() if level == 0 else None
    own = description.arrays
    if level:  # triangles, and some arrays
        count = fields.count() - 1
        own = [a for a in own if a.domain in (POINTS, CELLS, CORNERS)]
        own = own if count == len(own) else [a for a in own if a.domain == POINTS]
        require(count == len(own), "a chart of other arrays")
    codings = fields.count(255)
    names = [("TOPO", codings % 16), ("POSI", codings // 16)] + [("ARRY", i) for i in range(len(own))]
    sizes = [fields.count() for _ in names[:-1]]
    contents = [fields.take(size) for size in sizes] + [fields.rest()]
    streams = {name: data for name, data in zip(names, contents) if data or name[0] != "ARRY"}
    reduced = SimpleNamespace(positions=description.positions, welded=False, blocks=blocks, arrays=own)
    return single.Patch(streams, reduced, points, corners, cells, table_set), shared


def decode(container):
    """The mesh (level 0), with the patches of all coarser charts by level."""
    d = Description(container.stream("DESC"))
    sets = [TableSet(container.stream("CTAB", i), d.positions) if container.has("CTAB", i) else None for i in range(2)]
    groups = count_of_groups(container.stream("CDIR"), len(d.arrays))
    pages = [Fields(container.stream("CIDX", page)) for page in range((groups - 1) // 256 + 1)]
    finest, shared, coarser = [], [], []
    for g in range(groups):
        head, charts, checks = index_entry(pages[g // 256], g)
        fields = Fields(container.stream("CHRT", g))
        require(head == (fields.count(), fields.count(), fields.number("f"), fields.number("f")), "a head that differs from the index")
        require(charts == fields.list(lambda: (fields.count(), fields.count(), fields.count())), "charts that differ from the index")
        level = head[0]
        for (_, faces, size), check in zip(charts, checks):
            data = fields.take(size)
            require(hash64(data) & 0xFFFFFFFF == check, "a chart is damaged")
            patch, section = chart(data, d, level, sets[min(level, 1)])
            require(sum(map(len, patch.blocks)) == faces, "other cells than the index says")
            if level == 0:
                finest.append(patch)
                shared.append(single.shared_points(section, single.border_of(patch)))
            else:
                coarser.append((level, patch))
        fields.end()
    for page in pages:
        page.end()
    whole = {i: arrays.decode(container.stream("ARRY", 0, i - 1), a, None) for i, a in enumerate(d.arrays, 1) if a.domain == MESH}
    mesh = single.join(d, finest, shared, whole)
    if d.form & 1:
        single.reorder(mesh, container.stream("ORDR"))
    mesh.coarser = coarser
    return mesh
