"""Section 11.1 of docs/format.md: what a mesh consists of."""
from types import SimpleNamespace
from container import Fields
from entropy import CodedSequence

DTYPES = ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"]
POINTS, CORNERS, CELLS, MESH, TWINS = range(5)
TRIANGLE, POLYGON, QUAD, POLYHEDRON, MIXED = 5, 7, 9, 42, 255
# Nodes of a cell of each type; 0: any number.
NODES = {1: 1, 3: 2, 5: 3, 8: 4, 9: 4, 10: 4, 11: 8, 12: 8, 13: 6, 14: 5, 15: 10, 16: 12, 21: 3, 22: 6, 23: 8, 24: 10}
NODES |= {25: 20, 26: 15, 27: 13, 28: 9, 29: 27, 30: 6, 31: 12, 32: 18, 33: 24, 34: 7, 35: 4, 37: 19}
NODES |= dict.fromkeys((2, 4, 6, 7, 36, 41, 42, *range(68, 75), MIXED), 0)

# Name, type, components, role.
USUAL = [("position", 8, 3, 0), ("position", 9, 3, 0), ("normal", 8, 3, 1), ("normal", 9, 3, 1), ("texcoord", 8, 2, 3)]
USUAL += [("texcoord", 9, 2, 3), ("colour", 1, 3, 2), ("colour", 1, 4, 2), ("colour", 8, 3, 2), ("colour", 8, 4, 2)]
USUAL += [("tangent", 8, 4, 4), ("joints", 1, 4, 0), ("joints", 3, 4, 0), ("weights", 8, 4, 0)]

def plain(fields, size=None):
    """11.1: `size` bytes as they are, or coded as byte(M)."""
    size = fields.count() if size is None else size
    coded = fields.rest()
    return coded if len(coded) == size else unpacked(coded, size)

def unpacked(coded, size):
    assert len(coded) >= size // 64, "bytes that are packed too far"
    sequence, content = CodedSequence(coded), []
    for _ in range(size):
        content.append(sequence.tree(8, "byte", content[-1] if content else 0))
    return bytes(content)

class Array:
    def __init__(self, fields, stream=False):
        name = fields.text() if stream else None
        usual, self.domain = divmod(fields.u8(), TWINS + 1)
        if usual:
            self.name, self.type, self.components, self.role = USUAL[usual - 1]
        else:
            self.name, self.type = name if stream else fields.text(), fields.u8()
            self.components, self.role, _ = fields.count(), fields.u8(), fields.list(fields.text)
        self.tuples = fields.count() if self.domain == MESH else None
        asked = fields.u8()
        fields.take(8 * (1 if stream else 3 if asked else 0))  # bounds
        self.dtype = DTYPES[self.type]
        self.of_bits = "u" + self.dtype[1]

def cells_by_block(fields, blocks):
    """Of a part; behind a 0 the number of blocks more that have none."""
    cells = []
    while len(cells) < blocks:
        cells.append(fields.count())
        cells += [] if cells[-1] else [0] * fields.count()
    assert len(cells) == blocks, "blocks that there are not"
    return cells

class Description:
    def __init__(self, stream):
        fields = Fields(plain(Fields(stream)))
        _, form, self.points = fields.u8(), fields.u8(), fields.count()
        self.ordered, self.welded = form & 1, form & 2
        self.split_points = fields.count() if self.welded else None
        self.corners = fields.count()
        self.blocks = fields.list(lambda: self.block(fields))
        self.parts = fields.list(lambda: (fields.count(), fields.count(), cells_by_block(fields, len(self.blocks))))
        self.positions = Array(fields)
        self.arrays = fields.list(lambda: Array(fields))
        fields.list(lambda: (fields.text(), fields.text())), fields.text()  # metadata, provenance
        fields.end()

    @staticmethod
    def block(fields):
        block = SimpleNamespace(name=fields.text(), type=fields.u8(), cells=fields.count())
        if block.type == MIXED:
            fields.list(lambda: (fields.u8(), fields.count()))
        return block

class Mesh:
    """Cells by block as lists of (type, points); values of each array, positions first, in the order of its domain."""

    def __init__(self, description, blocks, values):
        self.description, self.blocks, self.values = description, blocks, values
        self.arrays = [description.positions] + description.arrays

    def cells(self): return [cell for block in self.blocks for cell in block]
