"""Section 11.1 of docs/format.md: what a mesh consists of."""

import numpy as np

from codes import DTYPES
from container import Fields, require
from entropy import Byte, CodedSequence

POINTS, CORNERS, CELLS, MESH, TWINS = range(5)
TRIANGLE, POLYGON, PIXEL, QUAD, POLYHEDRON, MIXED = 5, 7, 8, 9, 42, 255
# Nodes of a cell of each type; 0: any number.
NODES = {1: 1, 2: 0, 3: 2, 4: 0, 5: 3, 6: 0, 7: 0, 8: 4, 9: 4, 10: 4, 11: 8, 12: 8, 13: 6, 14: 5, 15: 10, 16: 12, 21: 3, 22: 6, 23: 8}
NODES |= {24: 10, 25: 20, 26: 15, 27: 13, 28: 9, 29: 27, 30: 6, 31: 12, 32: 18, 33: 24, 34: 7, 35: 4, 36: 0, 37: 19, 41: 0, 42: 0}
NODES |= {type_: 0 for type_ in range(68, 75)} | {MIXED: 0}


def plain(fields, size=None):
    """`size` bytes as they are, or coded as byte(M)."""
    size = fields.count(1 << 24) if size is None else size
    coded = fields.rest()
    if len(coded) == size:
        return coded
    sequence, model = CodedSequence(coded), Byte()
    content = bytes(sequence.byte(model) for _ in range(size))
    sequence.end()
    return content


class Array:
    def __init__(self, fields):
        self.name, self.domain, self.type = fields.text(), fields.u8(), fields.u8()
        self.components, self.role = fields.count(65535), fields.u8()
        require(self.domain <= TWINS and self.type <= 9 and self.components and self.role <= 5, "an array that cannot be")
        self.labels = fields.list(fields.text)
        self.tuples = fields.count(2**32 - 2) if self.domain == MESH else None
        self.asked = fields.u8()
        self.bounds = [fields.f64() for _ in range(3)] if self.asked else []
        self.dtype = DTYPES[self.type]
        self.values = None  # rows of components, once decoded


class Block:
    def __init__(self, name, type_, cells):
        self.name, self.type, self.cells = name, type_, cells
        require(type_ in NODES, "a block of a type that is not known")


def described_block(fields):
    block = Block(fields.text(), fields.u8(), fields.count(2**32 - 2))
    if block.type == MIXED:
        types = fields.list(lambda: (fields.u8(), fields.count(2**32 - 2)))
        require(not types or sum(count for _, count in types) == block.cells, "types of cells that do not add up")
    return block


class Description:
    def __init__(self, stream):
        fields = Fields(plain(Fields(stream)))
        self.effort, self.form = fields.u8(), fields.u8()
        self.welded = bool(self.form & 2)
        require(self.effort <= 9 and self.form <= 3, "an effort or form that cannot be")
        self.points = fields.count(2**32 - 2)
        self.split_points = fields.count() if self.welded else None
        self.corners = fields.count(2**32 - 2)
        self.blocks = fields.list(lambda: described_block(fields))
        self.parts = fields.list(lambda: (fields.count(), fields.count(), [fields.count() for _ in range(fields.count(len(self.blocks)))]))
        self.positions = Array(fields)
        self.arrays = fields.list(lambda: Array(fields))
        self.metadata = fields.list(lambda: (fields.text(), fields.text()))
        self.provenance = fields.text()
        fields.end()
        require(self.positions.domain == POINTS and self.positions.components == 3, "positions are not three numbers of each point")
        if self.welded:
            require(self.points < self.split_points <= self.points + self.corners and not self.parts, "twins that cannot be")
        require(not any(block.type == POLYHEDRON for block in self.blocks), "polyhedra in a mesh without faces of cells")
        for i, block in enumerate(self.blocks):
            require(not self.parts or sum(part[2][i] for part in self.parts) == block.cells, "parts have other cells than the mesh")


class Mesh:
    """A decoded mesh: cells by block as lists of (type, points), arrays as numpy rows."""

    def __init__(self, positions, blocks, arrays):
        self.positions, self.blocks, self.arrays = positions, blocks, arrays

    def cells(self):
        return [cell for block in self.blocks for cell in block]


def rows(values, dtype, components):
    if dtype[0] == "f":
        return np.array(values, "f8").reshape(-1, components).astype(dtype) if values else np.zeros((0, components), dtype)
    return np.array(values, dtype=dtype).reshape(-1, components) if values else np.zeros((0, components), dtype)
