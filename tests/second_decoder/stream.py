"""Section 16 of docs/format.md: mode stream, but steps and cells given by faces."""

import numpy as np

import mixed
import pieces
import values
from cells import Connectivity
from container import Fields, require
from description import POINTS, Array, Mesh, plain
from entropy import MixedSequence
from gates import Gates
from order import mesh_order


class StreamDescription:
    """16.1."""

    def __init__(self, stream):
        fields = Fields(stream)
        size = fields.count()
        tables = Fields(plain(Fields(fields.section()), size) if size else b"")
        fields = Fields(plain(fields))
        self.effort = fields.count(9)
        self.any_order, self.order_apart, self.mixed, self.mixed_values, self.gated = (fields.u8() for _ in range(5))
        self.positions = Array(fields, stream=True)
        self.arrays = fields.list(lambda: Array(fields, stream=True))
        self.mesh_arrays = fields.list(lambda: (fields.text(), fields.u8(), fields.count(), fields.u8(), fields.list(fields.text), fields.section()))
        self.metadata = fields.list(lambda: (fields.text(), fields.text()))
        self.provenance = fields.text()
        require(fields.count() == 1 + len(self.arrays), "maps of other arrays")
        self.maps = [fields.list(lambda: values.stream_map(fields, a.type, tables)) for a in [self.positions] + self.arrays]
        self.allowed = fields.list(fields.f64)
        runs = lambda: fields.list(lambda: (fields.count(), fields.count()))
        self.numbered = fields.list(lambda: (fields.count(), runs())) if self.order_apart & 2 else []
        fields.end()


def decode(container):
    d = StreamDescription(container.stream("DESC"))
    mesh = pieces.decode(container, d, decode) if container.required else one_file(container, d)
    for place, runs in d.numbered:
        numbers = [first + k for n, first in runs for k in range(n)]
        require(len(numbers) == len(mesh.values[place + 1]), "numbers of other elements")
        mesh.values[place + 1] = np.array(numbers).astype(mesh.arrays[place + 1].dtype).reshape(-1, 1)
    return mesh


def one_file(container, d):
    walk, cells, batch = (Gates if d.gated else Connectivity)(d.mixed, not d.any_order), [], 0
    mesh, places, coders = Mesh(d, [], []), {}, []
    for i, (array, m, allowed) in enumerate(zip(mesh.arrays, d.maps, d.allowed)):
        is_mixed = (d.mixed_values == 2 or d.mixed_values and allowed) and array.components <= 16
        coders.append(mixed.MixedValues(array, m, places if i else None) if is_mixed else values.Values(array, m))
    rows = [{} for _ in coders]  # by number
    while container.has("CELL", batch):
        fields = Fields(container.stream("CELL", batch))
        head = Fields(fields.section())
        records, n_cells, n_points, size = (head.count() for _ in range(4))
        begins = head.list(lambda: (head.count(), head.text(), head.u8()))
        head.end()
        sequences = MixedSequence(fields.take(size)), MixedSequence(fields.rest())
        made = walk.batch(*sequences, records, begins)
        for sequence in sequences:
            sequence.end()
        require(len(made) == n_cells and len(walk.born) == n_points, "other cells or points than announced")
        born, came = walk.born, [(len(cells) + i, *element) for i, element in enumerate(walk.came)]
        cells += made
        for i, (array, coder) in enumerate(zip(mesh.arrays, coders)):
            elements = born if array.domain == POINTS else came
            if elements:
                key = ("ARRY", batch, i - 1) if i else ("POSI", batch)
                numbers = [element[0] for element in elements]
                rows[i].update(zip(numbers, coder.batch(container.stream(*key), [element[1:] for element in elements], numbers)))
            if not i:
                places.update((p[0], np.array(rows[0][p[0]], "u8").astype("u" + array.dtype[1]).view(array.dtype).astype("f8")) for p in born)
        batch += 1
    for array, by_number in zip(mesh.arrays, rows):
        ordered = np.array([by_number[k] for k in range(len(by_number))], "u8").reshape(-1, array.components)
        mesh.values.append(ordered.astype("u" + array.dtype[1]).view(array.dtype))
    ends = np.cumsum([0] + [n for _, _, n in walk.blocks]).tolist()
    blocks = list(zip(ends, ends[1:]))
    if d.order_apart & 1:
        points, order = mesh_order(container.stream("ordr"), [walk.kept[a:b] for a, b in blocks], len(mesh.values[0]))
        number = {p: i for i, p in enumerate(points)}
        cells = [(cells[c][0], [number[p] for p in cells[c][1]]) for c in order]
        mesh.values = [v[points if a.domain == POINTS else order] for a, v in zip(mesh.arrays, mesh.values)]
    mesh.blocks = [cells[a:b] for a, b in blocks]
    return mesh

