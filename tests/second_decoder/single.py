"""Sections 11, 12.5 and 15 of docs/format.md: mode single."""
from functools import cached_property
from types import SimpleNamespace
import numpy as np
import around
import arrays
from container import Fields, Unread, beyond
from description import CELLS, CORNERS, MESH, POINTS, TWINS, Description, Mesh
from entropy import CodedSequence
from fans import Fans
from normals import Twins
from surface import Surface

def ranges(sizes):
    ends = np.cumsum(sizes).astype(int).tolist()
    return [range(end - n, end) for n, end in zip(sizes, ends)]

def joined(lists): return [x for part in lists for x in part]

class Patch:
    """A mesh or a part of it: its streams by name and number, and the counts of 11.1."""

    def __init__(self, streams, description, points, corners, cells, shared=None, whole=False):
        """`shared`: tables of charts (17.7)."""
        self.points = points
        here = [b for b, n in enumerate(cells) if n or whole]  # 11: a part has the blocks with cells
        described = [SimpleNamespace(type=description.blocks[b].type, cells=cells[b]) for b in here]
        topo = next(n for name, n in streams if name == "TOPO")
        if topo == 0:
            raise Unread("connectivity over a front: efforts 7 to 9")
        self.fans = fans = Fans(topo, streams["TOPO", topo], points, corners, described, shared if topo == 3 else None)
        self.loose = joined(fans.loose)
        self.cells = [(described[b].type, face) for b, face in zip(fans.block, fans.faces)] + self.loose
        number = iter(range(len(fans.faces), len(self.cells)))  # 12.5: order in the mesh, by block
        self.order = [[] for _ in cells]
        for b, loose in enumerate(fans.loose):
            self.order[here[b]] = [f for f, own in enumerate(fans.block) if own == b] + [next(number) for _ in loose]
        self.blocks = self.in_blocks(self.cells)
        if ("POSI", 0) in streams:
            positions = arrays.decode(streams["POSI", 0], description.positions, self)
        else:
            coding, header = (3, shared.header) if ("POSI", 3) in streams else (1, None)
            positions = around.positions(Fields(streams["POSI", coding]), fans, points, description.positions, header)
        self.numbers = np.where(np.isfinite(positions), positions, 0).astype("f8")
        if description.welded:
            self.made_twins = Twins(streams["TWIN", 0], self)
            by_corner = dict(zip(self.surface.corner_of, self.made_twins.of))
            self.twins = [by_corner[c] for c in range(len(by_corner))]  # of the mesh's faces
        self.values = [positions]
        for i, array in enumerate(description.arrays):
            coded = arrays.decode(streams["ARRY", i], array, self) if ("ARRY", i) in streams else None
            self.values.append(self.in_mesh_order(array, coded) if array.domain in (CELLS, CORNERS) else coded)

    @cached_property
    def surface(self): return Surface(self.fans.faces, self.points)

    @cached_property
    def corners(self): return arrays.Corners(self.fans.faces)

    @cached_property
    def references(self):
        """13.2, for points: elements by number, and valences."""
        return arrays.element_references(self.corners, self.corners.point, self.points)

    def in_blocks(self, of_cells): return [[of_cells[i] for i in block] for block in self.order]

    def in_mesh_order(self, array, values):
        """13.1: tuples of cells and corners follow these."""
        places = ranges([len(nodes) if array.domain == CORNERS else 1 for _, nodes in self.cells])
        return values[joined(joined(self.in_blocks(places)))]

def split_twins(mesh, patch):
    """13.7: each twin becomes a point."""
    twins = patch.made_twins
    own = np.repeat(np.arange(patch.points), np.diff(twins.first))
    points = [twins.point(twin) for twin in patch.twins + twins.loose]
    by_twin = np.zeros(twins.first[-1], int)  # a corner of each
    by_twin[points] = np.arange(len(points))
    places = {TWINS: by_twin, POINTS: own}
    mesh.values = [v[places.get(a.domain, slice(None))] for a, v in zip(mesh.arrays, mesh.values)]
    point = iter(points)
    mesh.blocks = patch.in_blocks([(type_, [next(point) for _ in nodes]) for type_, nodes in patch.cells])

def border_of(patch):
    return np.flatnonzero(around.on_border([nodes for _, nodes in joined(patch.blocks)], patch.points)).tolist()

def shared_points(section, border, side=frozenset()):
    """15.1: copies by point, rising; those on a side (16.14) have a context of their own."""
    if not section:
        return dict.fromkeys(border, 0)
    sequence, shared, next_, before, copies, copy = CodedSequence(section), set(), 0, {False: 1, True: 1}, {}, 0
    for _ in range(sequence.count("number")):
        next_ += sequence.count("step") + 1
        shared.add(next_ - 1)
    for p in border:
        before[p in side] = sequence.bit("there", p in side, before[p in side])
        shared |= {p} if before[p in side] else set()
    for p in sorted(shared):
        copies[p] = copy = sequence.count("copy", copy > 0)
    return copies

def join(description, patches, shared, mesh_values):
    """15.1: the mesh of parts. `shared` by patch; `mesh_values` of arrays of the mesh as a whole."""
    known, count, taken, cells = {}, 0, [], []
    for patch, copies in zip(patches, shared):
        number, own = [], []
        for p in range(patch.points):
            key = (patch.values[0][p].tobytes(), copies[p]) if p in copies else (len(taken), p)
            number.append(known.setdefault(key, count))
            if number[-1] == count:
                own.append(p)
                count += 1
        taken.append(own)
        cells.append([[(type_, [number[p] for p in nodes]) for type_, nodes in block] for block in patch.blocks])
    mesh = Mesh(description, [joined(of_block) for of_block in zip(*cells)], [])
    for i, array in enumerate(mesh.arrays):
        if array.domain == MESH:
            mesh.values.append(mesh_values[i])
        elif array.domain == POINTS:
            mesh.values.append(np.concatenate([patch.values[i][own] for patch, own in zip(patches, taken)]))
        else:
            pieces = []  # by patch and block
            for patch in patches:
                size = (lambda nodes: 1) if array.domain == CELLS else len
                sizes = [sum(size(nodes) for _, nodes in block) for block in patch.blocks]
                pieces.append(np.split(patch.values[i], np.cumsum(sizes).astype(int)))
            mesh.values.append(np.concatenate(joined(list(zip(*pieces))[:-1])))
    return mesh

def decode(container):
    d, by_patch = Description(container.stream("DESC")), {}
    for (kind, patch, number), data in container.streams.items():
        by_patch.setdefault(patch, {})[kind, number] = data
    if d.parts:
        sections = Fields(container.stream("JOIN"))
        patches = [Patch(by_patch[i], d, *part) for i, part in enumerate(d.parts)]
        shared = [shared_points(sections.section(), border_of(patch)) for patch in patches]
        mesh = join(d, patches, shared, patches[0].values)
    else:
        patch = Patch(by_patch[0], d, d.points, d.corners, [b.cells for b in d.blocks], whole=True)
        mesh = Mesh(d, patch.blocks, patch.values)
        if d.welded:
            split_twins(mesh, patch)
    if d.ordered:
        beyond("an order that is kept")(mesh, container.stream("ORDR"))
    return mesh
