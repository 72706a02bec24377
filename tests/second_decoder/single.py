"""Sections 11, 12.5 and 15 of docs/format.md: mode single."""

from functools import cached_property

import numpy as np

import around
import arrays
from container import Fields, Unread, require, unzigzag
from description import CELLS, CORNERS, MESH, POINTS, TWINS, Block, Description, Mesh
from entropy import CodedSequence, bits, counts
from fans import Fans
from normals import Twins
from surface import Surface


def ranges(sizes):
    ends = np.cumsum(sizes).astype(int).tolist()
    return [range(end - n, end) for n, end in zip(sizes, ends)]


def joined(lists):
    return [x for part in lists for x in part]


class Patch:
    """A mesh or a part of it: its streams by name and number, and the counts of 11.1."""

    def __init__(self, streams, description, points, corners, cells, shared=None):
        """`shared`: tables of charts (17.7)."""
        self.streams, self.points = streams, points
        described = [Block(b.name, b.type, n) for b, n in zip(description.blocks, cells)]
        (topo,) = (n for name, n in streams if name == "TOPO")
        if topo == 0:
            raise Unread("connectivity over a front: efforts 7 to 9")
        require(topo < 3 or topo == 3 and shared, "connectivity of another kind, or without the tables of charts")
        self.fans = fans = Fans(topo, streams["TOPO", topo], points, corners, described, shared if topo == 3 else None)
        self.face_types = [described[b].type for b in fans.block]
        self.blocks = self.in_blocks(list(zip(self.face_types, fans.faces)), fans.loose)
        require(sum(len(nodes) for _, nodes in joined(self.blocks)) == corners, "other corners than announced")
        positions = self.positions(description.positions, shared)
        self.numbers = np.where(np.isfinite(positions), positions, 0).astype("f8")
        if description.welded:
            self.read_twins()
        self.values = [positions]
        for i, array in enumerate(description.arrays):
            coded = arrays.decode(streams["ARRY", i], array, self) if ("ARRY", i) in streams else None
            self.values.append(coded if coded is None or array.domain not in (CELLS, CORNERS) else self.in_mesh_order(array, coded))

    def positions(self, array, shared):
        for kind, header in ((1, None), (3, shared and shared.header)):
            if ("POSI", kind) in self.streams:
                return around.positions(Fields(self.streams["POSI", kind]), self.fans, self.points, array, header)
        return arrays.decode(self.streams["POSI", 0], array, self)

    @cached_property
    def surface(self):
        return Surface(self.fans.faces, self.points)

    @cached_property
    def corners(self):
        return arrays.Corners(self.fans.faces)

    @cached_property
    def references(self):
        return arrays.element_references(self.corners, self.corners.point, self.points)

    def point_references(self):
        """13.2, for points: elements by number, and valences."""
        return self.references

    def read_twins(self):
        """13.7: twins by half-edge, and by corner of the mesh's faces."""
        self.made_twins = Twins(self.streams["TWIN", 0], self)
        by_corner = dict(zip(self.surface.corner_of, self.made_twins.of))
        self.twins = [by_corner[c] for c in range(len(by_corner))]

    def in_blocks(self, of_faces, of_loose):
        """12.5: items of faces and of loose cells (by block) in the order of the mesh's cells, by block."""
        return [[item for item, own in zip(of_faces, self.fans.block) if own == b] + loose for b, loose in enumerate(of_loose)]

    def in_mesh_order(self, array, values):
        """13.1: tuples of cells and corners follow these."""
        loose = joined(self.fans.loose)
        places = ranges([len(x) if array.domain == CORNERS else 1 for x in self.fans.faces + [nodes for _, nodes in loose]])
        of_loose = iter(places[len(self.fans.faces) :])
        ordered = self.in_blocks(places[: len(self.fans.faces)], [[next(of_loose) for _ in cells] for cells in self.fans.loose])
        return values[joined(joined(ordered))]


def split_twins(mesh, patch):
    """13.7: each twin becomes a point."""
    twins, total = patch.made_twins, patch.made_twins.first[-1]
    require(total == mesh.description.split_points, "other points than announced")
    own = np.repeat(np.arange(patch.points), np.diff(twins.first))
    points = [twins.point(twin) for twin in patch.twins + twins.loose]
    by_twin = np.zeros(total, int)  # a corner of each
    by_twin[points] = np.arange(len(points))
    mesh.values = [v[by_twin] if a.domain == TWINS else v[own] if a.domain == POINTS else v for a, v in zip(mesh.arrays, mesh.values)]
    point = iter(points)
    faces = [(type_, [next(point) for _ in face]) for type_, face in zip(patch.face_types, patch.fans.faces)]
    mesh.blocks = patch.in_blocks(faces, [[(type_, [next(point) for _ in nodes]) for type_, nodes in cells] for cells in patch.fans.loose])


def permutation(sequence, n):
    """15.2: the number of each of n elements."""
    models, number, c, numbers = counts(), -1, 0, []
    for _ in range(n):
        u = sequence.count(models[c])
        number = number + 1 + unzigzag(u) & 0xFFFFFFFF
        c = min(u.bit_length(), 15)
        numbers.append(number)
    require(sorted(numbers) == list(range(n)), "an order that is no permutation")
    return numbers


def reorder(mesh, stream):
    """15.2."""
    sequence, cells = CodedSequence(stream), mesh.cells()
    point_numbers, cell_numbers = permutation(sequence, len(mesh.values[0])), permutation(sequence, len(cells))
    models, rotations = counts(), [0]
    for _, nodes in cells:
        rotations.append(sequence.count(models[min(rotations[-1], 3)]))
        require(rotations[-1] == 0 or rotations[-1] < len(nodes), "a rotation that is too large")
    sequence.end()
    old_point, old_cell = (np.argsort(numbers).astype(int) for numbers in (point_numbers, cell_numbers))
    corners, made, old_corner = ranges([len(nodes) for _, nodes in cells]), [], []
    for i in old_cell:
        (type_, nodes), r, n = cells[i], rotations[1 + i], len(cells[i][1])
        order = [(j - r) % n for j in range(n)]
        made.append((type_, [point_numbers[nodes[j]] for j in order]))
        old_corner += [corners[i][j] for j in order]
    by_domain = {POINTS: old_point, TWINS: old_point, CELLS: old_cell, CORNERS: np.array(old_corner, int), MESH: slice(None)}
    mesh.values = [values[by_domain[array.domain]] for values, array in zip(mesh.values, mesh.arrays)]
    blocks = ranges(list(map(len, mesh.blocks)))
    require(all(set(old_cell[block]) == set(block) for block in blocks), "a cell leaves its block")
    mesh.blocks = [[made[i] for i in block] for block in blocks]


def border_of(patch):
    """15.1: points at which sides of cells do not come in pairs."""
    neighbours = [0] * patch.points
    for _, nodes in joined(patch.blocks):
        for p, before, behind in zip(nodes, nodes[-1:] + nodes, nodes[1:] + nodes[:1]):
            neighbours[p] ^= before + 1 ^ behind + 1
    return [p for p, x in enumerate(neighbours) if x]


def shared_points(section, border, side=frozenset()):
    """15.1: copies by point, rising; those on a side (16.14) have a context of their own."""
    if not section:
        return dict.fromkeys(border, 0)
    sequence, models, there = CodedSequence(section), counts(), bits()
    shared, next_, before, copies = set(), 0, {False: 1, True: 1}, {}
    for _ in range(sequence.count(models["number"])):
        p = next_ + sequence.count(models["step"])
        shared.add(p)
        next_ = p + 1
    for p in border:
        on = p in side
        before[on] = sequence.bit(there[on, before[on]])
        shared |= {p} if before[on] else set()
    copy = 0
    for p in sorted(shared):
        copies[p] = copy = sequence.count(models[copy > 0])
    sequence.end()
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
    require(count == description.points, "parts give another number of points than announced")
    mesh = Mesh(description, [joined(of_block) for of_block in zip(*cells)], [])
    for i, array in enumerate(mesh.arrays):
        if array.domain == MESH:
            mesh.values.append(mesh_values[i])
        elif array.domain == POINTS:
            mesh.values.append(np.concatenate([patch.values[i][own] for patch, own in zip(patches, taken)]))
        else:
            pieces = []  # by patch and block
            for patch in patches:
                sizes = [len(block) if array.domain == CELLS else sum(len(nodes) for _, nodes in block) for block in patch.blocks]
                pieces.append(np.split(patch.values[i], np.cumsum(sizes).astype(int)))
            mesh.values.append(np.concatenate(joined(list(zip(*pieces))[:-1])))
    return mesh


def decode(container):
    d = Description(container.stream("DESC"))
    by_patch = {}
    for (kind, patch, number), data in container.streams.items():
        by_patch.setdefault(patch, {})[kind, number] = data
    if not d.parts:
        patch = Patch(by_patch[0], d, d.points, d.corners, [b.cells for b in d.blocks])
        mesh = Mesh(d, patch.blocks, patch.values)
        if d.welded:
            split_twins(mesh, patch)
    else:
        patches = [Patch(by_patch[i], d, *part) for i, part in enumerate(d.parts)]
        sections = Fields(container.stream("JOIN"))
        shared = [shared_points(sections.section(), border_of(patch)) for patch in patches]
        sections.end()
        mesh = join(d, patches, shared, patches[0].values)
    if d.form & 1:
        reorder(mesh, container.stream("ORDR"))
    return mesh
