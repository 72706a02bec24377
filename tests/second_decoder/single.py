"""Sections 11, 12.5 and 15 of docs/format.md: mode single."""

import numpy as np

import around
import arrays
import normals
from container import Fields, Unread, require, unzigzag
from description import CELLS, CORNERS, MESH, POINTS, TWINS, Block, Description, Mesh
from entropy import CodedSequence, bits, counts
from fans import Fans
from surface import Surface


class Patch:
    """A mesh or a part of it: its streams by name and number, and the counts of 11.1."""

    def __init__(self, streams, description, points, corners, cells, shared=None):
        self.shared = shared  # tables of charts (17.7)
        self.d, self.streams, self.points = description, streams, points
        self.described = [Block(b.name, b.type, n) for b, n in zip(description.blocks, cells)]
        self.twins, self._point_references, self._corners, self._surface = None, None, None, None
        self.connectivity(corners)
        self.blocks = self.in_blocks(self.face_cells(), self.fans.loose)
        require(sum(len(nodes) for block in self.blocks for _, nodes in block) == corners, "other corners than announced")
        positions = self.read_positions()
        finite = positions.astype("f8")
        self.numbers = np.where(np.isfinite(finite), finite, 0.0)
        if description.welded:
            self.read_twins()
        self.values = [positions]
        for i, array in enumerate(description.arrays):
            self.values.append(self.in_mesh_order(array, arrays.decode(streams["ARRY", i], array, self)) if ("ARRY", i) in streams else None)

    def connectivity(self, corners):
        topo = [n for name, n in self.streams if name == "TOPO"]
        require(len(topo) == 1 and topo[0] <= 3, "connectivity of another kind")
        if topo[0] == 0:
            raise Unread("connectivity over a front: efforts 7 to 9")
        require(topo[0] < 3 or self.shared, "tables of charts are missing")
        self.fans = Fans(topo[0], self.streams["TOPO", topo[0]], self.points, corners, self.described, self.shared if topo[0] == 3 else None)

    @property
    def surface(self):
        if self._surface is None:
            self._surface = Surface(self.fans.faces, self.points)
        return self._surface

    def read_twins(self):
        """13.7: twins by corner of the mesh's faces, by half-edge, and of loose nodes."""
        made = self.made_twins = normals.Twins(self.streams["TWIN", 0], self)
        self.twins = [None] * len(made.of)
        for h, twin in enumerate(made.of):
            self.twins[self.surface.corner_of[h]] = twin

    @property
    def corners(self):
        if self._corners is None:
            self._corners = arrays.Corners(self.fans.faces)
        return self._corners

    def point_references(self):
        """13.2, for points: elements by number, and valences."""
        if self._point_references is None:
            self._point_references = arrays.element_references(self.corners, self.corners.point, self.points)
        return self._point_references

    def read_positions(self):
        if ("POSI", 1) in self.streams:
            return around.positions(Fields(self.streams["POSI", 1]), self.fans, self.points, self.d.positions)
        if ("POSI", 3) in self.streams:
            fields = Fields(self.streams["POSI", 3])
            return around.positions(fields, self.fans, self.points, self.d.positions, self.shared.header)
        require(("POSI", 0) in self.streams, "positions are missing")
        return arrays.decode(self.streams["POSI", 0], self.d.positions, self)

    def face_cells(self):
        return [(self.described[b].type, face) for face, b in zip(self.fans.faces, self.fans.block)]

    def in_blocks(self, of_faces, of_loose):
        """12.5: items of faces and of loose cells (by block) in the order of the mesh's cells, by block."""
        blocks = [[] for _ in self.described]
        for item, b in zip(of_faces, self.fans.block):
            blocks[b].append(item)
        return [block + loose for block, loose in zip(blocks, of_loose)]

    def in_mesh_order(self, array, values):
        """13.1: tuples of cells and corners follow these."""
        if array.domain not in (CELLS, CORNERS, TWINS):
            return values
        if array.domain == TWINS:
            return values
        sizes = [len(face) if array.domain == CORNERS else 1 for face in self.fans.faces]
        loose_sizes = [[len(nodes) if array.domain == CORNERS else 1 for _, nodes in cells] for cells in self.fans.loose]
        begin = np.concatenate([[0], np.cumsum(sizes + [n for block in loose_sizes for n in block])]).astype(int)
        places, k = [], len(sizes)
        for block in loose_sizes:
            places.append([range(begin[k + i], begin[k + i + 1]) for i in range(len(block))])
            k += len(block)
        ordered = self.in_blocks([range(begin[i], begin[i + 1]) for i in range(len(sizes))], places)
        return values[[i for block in ordered for places in block for i in places]]


def split_twins(mesh, patch):
    """13.7: each twin becomes a point."""
    twins, total = patch.made_twins, patch.made_twins.first[-1]
    require(total == mesh.description.split_points, "other points than announced")
    own = np.repeat(np.arange(patch.points), np.diff(twins.first))
    by_twin = np.zeros(total, int)  # a corner of each
    corners = list(enumerate(patch.twins)) + list(enumerate(twins.loose, len(patch.twins)))
    for c, twin in corners:
        by_twin[twins.point(twin)] = c
    mesh.values = [v[by_twin] if a.domain == TWINS else v[own] if a.domain == POINTS else v for a, v in zip(mesh.arrays, mesh.values)]
    points = [twins.point(twin) for twin in patch.twins]
    faces, at = [], 0
    for face in patch.fans.faces:
        faces.append(points[at : at + len(face)])
        at += len(face)
    loose, nodes_twins = [], iter(twins.loose)
    for cells in patch.fans.loose:
        loose.append([(type_, [twins.point(next(nodes_twins)) for _ in nodes]) for type_, nodes in cells])
    types = [patch.described[b].type for b in patch.fans.block]
    mesh.blocks = patch.in_blocks(list(zip(types, faces)), loose)


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
    sequence = CodedSequence(stream)
    cells, points = mesh.cells(), len(mesh.values[0])
    point_numbers, cell_numbers = permutation(sequence, points), permutation(sequence, len(cells))
    models, r, rotations = counts(), 0, []
    for _, nodes in cells:
        r = sequence.count(models[min(r, 3)])
        require(r == 0 or r < len(nodes), "a rotation that is too large")
        rotations.append(r)
    sequence.end()
    old_point = np.argsort(point_numbers).astype(int)
    old_cell = np.argsort(cell_numbers).astype(int)
    begin = np.concatenate([[0], np.cumsum([len(nodes) for _, nodes in cells])]).astype(int)
    made, old_corner = [], []
    for i in old_cell:
        type_, nodes = cells[i]
        n, r = len(nodes), rotations[i]
        made.append((type_, [point_numbers[nodes[(j - r) % n]] for j in range(n)]))
        old_corner += [begin[i] + (j - r) % n for j in range(n)]
    by_domain = {POINTS: old_point, TWINS: old_point, CELLS: old_cell, CORNERS: np.array(old_corner, int), MESH: slice(None)}
    mesh.values = [values[by_domain[array.domain]] for values, array in zip(mesh.values, mesh.arrays)]
    blocks, at = [], 0
    for block in mesh.blocks:
        require(all(at <= i < at + len(block) for i in old_cell[at : at + len(block)]), "a cell leaves its block")
        blocks.append(made[at : at + len(block)])
        at += len(block)
    mesh.blocks = blocks


def border_points(cells, points):
    """15.1: points at which sides of cells do not come in pairs."""
    neighbours = [0] * points
    for nodes in cells:
        n = len(nodes)
        for k in range(n):
            neighbours[nodes[k]] ^= (nodes[k - 1] + 1) ^ (nodes[(k + 1) % n] + 1)
    return [p for p in range(points) if neighbours[p]]


def shared_points(section, border):
    """15.1: (point, copy), rising."""
    if not section:
        return [(p, 0) for p in border]
    sequence, number, step, copy_models, there = CodedSequence(section), counts(), counts(), counts(), bits()
    shared, next_ = set(), 0
    for _ in range(sequence.count(number[0])):
        p = next_ + sequence.count(step[0])
        shared.add(p)
        next_ = p + 1
    before = 1
    for p in border:
        before = sequence.bit(there[before])
        if before:
            shared.add(p)
    found, copied = [], 0
    for p in sorted(shared):
        copy = sequence.count(copy_models[copied])
        copied = int(copy > 0)
        found.append((p, copy))
    sequence.end()
    return found


def join(description, patches, shared, mesh_values):
    """15.1: the mesh of parts. `shared` by patch; `mesh_values` of arrays of the mesh as a whole."""
    known, taken, count = {}, [[] for _ in patches], 0
    numbers = []
    for patch, points, own in zip(patches, shared, taken):
        copies, number = dict(points), []
        for p in range(patch.points):
            key = (patch.values[0][p].tobytes(), copies[p]) if p in copies else None
            if key in known and key is not None:
                number.append(known[key])
                continue
            if key is not None:
                known[key] = count
            number.append(count)
            own.append(p)
            count += 1
        numbers.append(number)
    require(count == description.points, "parts give another number of points than announced")
    blocks = [[] for _ in description.blocks]
    for patch, number in zip(patches, numbers):
        for block, part in zip(blocks, patch.blocks):
            block += [(type_, [number[p] for p in nodes]) for type_, nodes in part]
    values = []
    for i, array in enumerate(Mesh(description, None, None).arrays):
        if array.domain == MESH:
            values.append(mesh_values[i])
        elif array.domain == POINTS:
            values.append(np.concatenate([patch.values[i][own] for patch, own in zip(patches, taken)]))
        else:
            pieces = [[] for _ in blocks]
            for patch in patches:
                at = 0
                for b, part in enumerate(patch.blocks):
                    n = len(part) if array.domain == CELLS else sum(len(nodes) for _, nodes in part)
                    pieces[b].append(patch.values[i][at : at + n])
                    at += n
            values.append(np.concatenate([piece for block in pieces for piece in block]))
    return Mesh(description, blocks, values)


def mesh_array(stream, array):
    return arrays.decode(stream, array, None)


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
        shared = [shared_points(sections.section(), border_points([nodes for block in p.blocks for _, nodes in block], p.points)) for p in patches]
        sections.end()
        mesh = join(d, patches, shared, patches[0].values)
    if d.form & 1:
        reorder(mesh, container.stream("ORDR"))
    return mesh
