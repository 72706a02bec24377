"""Section 16 of docs/format.md: mode stream, but steps and cells given by faces."""
import numpy as np
import pieces
from cells import Connectivity
from container import Fields
from description import POINTS, Array, Mesh, plain
from gates import Gates
from maps import Map
from mixed import MixedValues
from order import mesh_order
from values import Values

class StreamDescription:
    """16.1."""

    def __init__(self, stream):
        fields = Fields(stream)
        size = fields.count()
        tables = Fields(plain(Fields(fields.section()), size) if size else b"")
        fields = Fields(plain(fields))
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
    mesh = pieces.decode(container, d, decode) if container.required else one_file(container, d)
    for place, runs in d.numbered:
        numbers = [first + k for n, first in runs for k in range(n)]
        mesh.values[place + 1] = np.array(numbers).astype(mesh.arrays[place + 1].dtype).reshape(-1, 1)
    return mesh

def one_file(container, d):
    walk, cells, batch = (Gates if d.gated else Connectivity)(d.mixed, not d.any_order), [], 0
    mesh, places, coders = Mesh(d, [], []), {}, []
    for i, (array, m, allowed) in enumerate(zip(mesh.arrays, d.maps, d.allowed)):
        is_mixed = (d.mixed_values == 2 or d.mixed_values and allowed) and array.components <= 16
        coders.append(MixedValues(array, m, places if i else None) if is_mixed else Values(array, m))
    rows = [{} for _ in coders]  # by number
    while container.has("CELL", batch):
        fields = Fields(container.stream("CELL", batch))
        head = Fields(fields.section())
        records, _, _, size = (head.count() for _ in range(4))
        begins = head.list(lambda: (head.count(), head.text(), head.u8()))
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
    ends = np.cumsum([0] + [n for _, _, n in walk.blocks]).tolist()
    blocks = list(zip(ends, ends[1:]))
    if d.order_apart & 1:
        points, order = mesh_order(container.stream("ordr"), [walk.kept[a:b] for a, b in blocks], len(mesh.values[0]))
        number = {p: i for i, p in enumerate(points)}
        cells = [(cells[c][0], [number[p] for p in cells[c][1]]) for c in order]
        mesh.values = [v[points if a.domain == POINTS else order] for a, v in zip(mesh.arrays, mesh.values)]
    mesh.blocks = [cells[a:b] for a, b in blocks]
    return mesh

def in_type(rows, array):
    """Rows of bits as numbers."""
    return np.array(rows, "u8").reshape(-1, array.components).astype(array.of_bits).view(array.dtype)
