"""Section 17 of docs/format.md: mode random."""
from types import SimpleNamespace
import arrays
import single
from around import POLYGONS, Header
from container import Fields, beyond, hash64
from description import CELLS, CORNERS, MESH, NODES, POINTS, TRIANGLE, Description, cells_by_block
from entropy import CodedSequence
from fans import fan_tables

class TableSet:
    """17.7: what charts share."""

    def __init__(self, stream, array):
        fields = Fields(stream)
        fans = CodedSequence(fields.section())
        # whether the set is for polygons is said behind the tables that depend on it
        self.topo = 2 if Fields(fields.data, fields.at).count() & POLYGONS else 1
        self.fan_tables = fan_tables(fans, self.topo)
        self.header = Header(fields, array.type, 3, shared=True)
        fields.end()

def index_entry(fields, number):
    """17.2: the head that a group must have, its charts, and checks of these."""
    level, error, bound, _ = fields.numbers("Bff16s")  # and sphere, offset
    replaces, charts, checks = fields.count(), [], []
    for _ in range(fields.count()):
        fields.take(11)  # sphere, half-axes
        producer = fields.count()
        charts.append((producer and 1 + number + producer, fields.count(), fields.count()))
        checks.append(fields.number("I"))
    return (level, replaces, error, bound), charts, checks

def chart(data, description, level, table_set):
    """17.3: a patch, and the section of points that other charts have, too."""
    fields = Fields(data)
    points, own = fields.count(), description.arrays
    blocks = description.blocks if level == 0 else [SimpleNamespace(type=TRIANGLE)]
    cells = cells_by_block(fields, len(blocks))
    fixed = all(NODES[b.type] for b, n in zip(blocks, cells) if n)
    corners = sum(n * NODES[b.type] for n, b in zip(cells, blocks)) if fixed else fields.count()
    shared = fields.section() if level == 0 else None
    if level:  # triangles, and some arrays
        count = fields.count() - 1
        own = [a for a in own if a.domain in (POINTS, CELLS, CORNERS)]
        own = own if count == len(own) else [a for a in own if a.domain == POINTS]
    codings = fields.count()
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
    groups = Fields(container.stream("CDIR")).count()  # 17.1: the rest is for those who read some charts
    pages = [Fields(container.stream("CIDX", i)) for i in range((groups + 255) // 256)]
    finest, shared, coarser = [], [], []
    for g in range(groups):
        head, charts, checks = index_entry(pages[g // 256], g)
        fields = Fields(container.stream("CHRT", g))
        assert head == (fields.count(), fields.count(), *fields.numbers("ff")), "a head that differs from the index"
        found = fields.list(lambda: (fields.count(), fields.count(), fields.count()))
        assert charts == found, "charts that differ from the index"
        for (_, faces, size), check in zip(charts, checks):
            data = fields.take(size)
            assert hash64(data) & 0xFFFFFFFF == check, "a chart is damaged"
            patch, section = chart(data, d, head[0], sets[min(head[0], 1)])
            assert sum(map(len, patch.blocks)) == faces, "other cells than the index says"
            if head[0] == 0:
                finest.append(patch)
                shared.append(single.shared_points(section, single.border_of(patch)))
            else:
                coarser.append((head[0], patch))
        fields.end()
    of_mesh = [(i, a) for i, a in enumerate(d.arrays) if a.domain == MESH]
    whole = {i + 1: arrays.decode(container.stream("ARRY", 0, i), a, None) for i, a in of_mesh}
    mesh = single.join(d, finest, shared, whole)
    if d.ordered:
        beyond("an order that is kept")(mesh, container.stream("ORDR"))
    mesh.coarser = coarser
    return mesh
