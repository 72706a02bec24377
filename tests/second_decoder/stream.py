"""Section 16 of docs/format.md: mode stream, but steps and cells given by faces."""
import numpy as np
from cells import Cells
from container import MORE, Fields, beyond
from description import POINTS, Array, Mesh, plain, unpacked
from entropy import Asker
from maps import Map
from single import ranges
from values import Values

class StreamDescription:
    """16.1."""

    def __init__(self, stream):
        fields = Fields(stream)
        size = fields.count()
        tables = Fields(plain(Fields(fields.section()), size) if size else b"")
        size = fields.count()
        fields = Fields(unpacked(fields.rest(), size))
        _, self.any_order, self.order_apart, self.mixed, self.mixed_values, self.gated = fields.take(6)
        self.positions = Array(fields, stream=True)
        self.arrays = fields.list(lambda: Array(fields, stream=True))
        f = fields  # arrays of the mesh as a whole, metadata, provenance, the number of maps
        f.list(lambda: (f.text(), f.u8(), f.count(), f.u8(), f.list(f.text), f.section()))
        f.list(lambda: (f.text(), f.text())), f.text(), f.count()
        self.maps = [f.list(lambda: Map(f, a.type, tables)) for a in [self.positions] + self.arrays]
        self.allowed = f.list(f.f64)
        runs = lambda: f.list(lambda: (f.count(), f.count()))
        self.numbered = f.list(lambda: (f.count(), runs())) if self.order_apart & 2 else []

def decode(container):
    d = StreamDescription(container.stream("DESC"))
    if container.required:
        mesh = beyond("volumes in pieces")(container, d, decode)
    else:
        mesh = one_file(container, d)
    for place, runs in d.numbered:
        numbers = [first + k for n, first in runs for k in range(n)]
        mesh.values[place + 1] = np.array(numbers).astype(mesh.arrays[place + 1].dtype).reshape(-1, 1)
    return mesh

def coders_of(d, places):
    for i, (array, m, allowed) in enumerate(zip([d.positions] + d.arrays, d.maps, d.allowed)):
        if (d.mixed_values == 2 or d.mixed_values and allowed) and array.components <= 16:
            yield beyond("mixed values")(array, m, places if i else None)
        else:
            yield Values(array, m)

def one_file(container, d):
    ask = beyond("mixed decisions")() if d.mixed else Asker()
    walk = (beyond("cells at gates") if d.gated else MORE.get("cells of all kinds", Cells))(ask, not d.any_order)
    mesh, cells, places, batch = Mesh(d, [], []), [], {}, 0
    coders = list(coders_of(d, places))
    rows = [{} for _ in coders]  # by number
    while container.has("CELL", batch):
        fields = Fields(container.stream("CELL", batch))
        head = Fields(fields.section())
        records, _, _, size = (head.count() for _ in range(4))
        begins = {at: type_ for at, _, type_ in head.list(lambda: (head.count(), head.text(), head.u8()))}
        made = walk.batch(fields.take(size), fields.rest(), records, begins)
        came = [(len(cells) + i, *element) for i, element in enumerate(walk.came)]
        cells += made
        for i, (array, coder) in enumerate(zip(mesh.arrays, coders)):
            elements = walk.born if array.domain == POINTS else came
            if elements:
                data = container.stream("ARRY", batch, i - 1) if i else container.stream("POSI", batch)
                rows[i].update(zip((element[0] for element in elements), coder.batch(data, elements)))
            if not i:
                places.update((p[0], in_type([rows[0][p[0]]], array)[0].astype("f8")) for p in walk.born)
        batch += 1
    mesh.values = [in_type([of[k] for k in range(len(of))], array) for array, of in zip(mesh.arrays, rows)]
    blocks = ranges([n for _, n in walk.blocks])
    mesh.blocks = [cells[block.start : block.stop] for block in blocks]
    if d.order_apart & 1:
        beyond("another order than that of the file")(mesh, walk, blocks, container.stream("ordr"))
    return mesh

def in_type(rows, array):
    """Rows of bits as numbers."""
    return np.array(rows, "u8").reshape(-1, array.components).astype(array.of_bits).view(array.dtype)
