"""Section 16.14 of docs/format.md: volumes in pieces."""
from collections import Counter, defaultdict
from types import SimpleNamespace
import numpy as np
import single
from cells import SHAPES
from container import Container, Fields
from description import POINTS, Mesh
from entropy import CodedSequence

BY_TYPE = {shape.type: shape for shape in SHAPES.values()}

def border_points(mesh_cells):
    """Points that a border face has, each in rising order."""
    faces = defaultdict(Counter)
    for type_, nodes in mesh_cells:
        shape = BY_TYPE.get(type_)
        nodes = [nodes[i] for i in shape.order] if shape else nodes
        n = shape.corners if shape else len(nodes)
        for cycle in shape.faces if shape and shape.dimension == 3 else [range(n)]:
            on, nodes_on = [nodes[i] for i in cycle], zip(nodes[n:], shape.nodes if shape else [])
            faces[tuple(sorted(on))].update(on + [p for p, lies_on in nodes_on if set(lies_on) <= set(cycle)])
    return sorted({p for points in faces.values() for p, n in points.items() if n % 2})

def sides(places):
    if not len(places):
        return set()
    low, high = np.where(np.isnan(places), np.inf, places).min(0), np.where(np.isnan(places), -np.inf, places).max(0)
    return set(np.nonzero(((places == low) | (places == high)).any(1))[0].tolist())

def runs(sequence, total):
    """GIDS: rising numbers, as runs."""
    sequence.forget()
    before, after, numbers, g, l, number, first = [(0, 0)] * 3, {}, [], 0, 0, 0, 1
    while len(numbers) < total:
        H = 0
        for gap, length in before:
            H = (H ^ gap) * 0x9E3779B1 & 0xFFFFFFFF
            H = (H ^ length) * 0x85EBCA6B & 0xFFFFFFFF
        expected = after.get(H >> 18, (0, 0))
        context = min(before[0][0].bit_length(), 7) if before[0][1] == 1 else 0
        same = expected[1] > 0 and g % 2 and sequence.bit("GapHit", g)
        gap = expected[0] if same else sequence.count("Gap", context) + 1 - first
        g = (2 * g + (gap == expected[0])) % 16
        same = expected[1] > 0 and g % 2 and l % 2 and sequence.bit("LengthHit", l)
        length = expected[1] if same else sequence.count("Length", min(gap.bit_length(), 7)) + 1
        l = (2 * l + (length == expected[1])) % 16
        numbers += range(number + gap, number + gap + length)
        number, first, after[H >> 18], before = numbers[-1] + 1, 0, (gap, length), [(gap, length)] + before[:2]
    return numbers

def decode(container, d, decode_file):
    tail = Fields(container.stream("TAIL"))
    d.points, n_cells, _, n_pieces, _, _ = (tail.count() for _ in range(6))
    n_blocks = len(tail.list(lambda: (tail.text(), tail.u8(), tail.count())))
    patches, shared, ids = [], [], []
    for i in range(n_pieces):
        fields = Fields(container.stream("PIEC", i))
        numbers, section = fields.list(fields.count), fields.section()
        mesh = decode_file(Container(bytes(255 - b for b in fields.rest())))
        blocks = [dict(zip(numbers, mesh.blocks)).get(b, []) for b in range(n_blocks)]
        patches.append(SimpleNamespace(values=mesh.values, points=len(mesh.values[0]), blocks=blocks))
        shared.append(single.shared_points(section, border_points(mesh.cells()), sides(mesh.values[0].astype("f8"))))
        if d.order_apart & 1:
            sequence = CodedSequence(container.stream("GIDS", i))
            ids.append([runs(sequence, len(mesh.cells())), runs(sequence, len(mesh.values[0]))])
    if not ids:
        return single.join(d, patches, shared, None)
    mesh, by_number = Mesh(d, [], []), {}
    for patch, (own_cells, own_points) in zip(patches, ids):
        flat = [(b, cell) for b, block in enumerate(patch.blocks) for cell in block]
        for i, (b, (type_, nodes)) in zip(own_cells, flat):
            by_number[i] = b, (type_, [own_points[p] for p in nodes])
    mesh.blocks = [[cell for _, (b, cell) in sorted(by_number.items()) if b == block] for block in range(n_blocks)]
    for i, array in enumerate(mesh.arrays):
        points = array.domain == POINTS
        mesh.values.append(np.zeros((d.points if points else n_cells, array.components), array.dtype))
        for patch, own in zip(patches, ids):
            mesh.values[i][own[points]] = patch.values[i]
    return mesh
