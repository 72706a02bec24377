"""Section 11.1 of docs/format.md: what a mesh consists of."""

from codes import DTYPES
from container import Fields, require
from entropy import CodedSequence, bits

POINTS, CORNERS, CELLS, MESH, TWINS = range(5)
TRIANGLE, POLYGON, QUAD, POLYHEDRON, MIXED = 5, 7, 9, 42, 255
# Nodes of a cell of each type; 0: any number.
NODES = {1: 1, 2: 0, 3: 2, 4: 0, 5: 3, 6: 0, 7: 0, 8: 4, 9: 4, 10: 4, 11: 8, 12: 8, 13: 6, 14: 5, 15: 10, 16: 12, 21: 3, 22: 6, 23: 8}
NODES |= {24: 10, 25: 20, 26: 15, 27: 13, 28: 9, 29: 27, 30: 6, 31: 12, 32: 18, 33: 24, 34: 7, 35: 4, 36: 0, 37: 19, 41: 0, 42: 0}
NODES |= dict.fromkeys(range(68, 75), 0) | {MIXED: 0}

# Name, type, components, role.
USUAL = [("position", 8, 3, 0), ("position", 9, 3, 0), ("normal", 8, 3, 1), ("normal", 9, 3, 1), ("texcoord", 8, 2, 3), ("texcoord", 9, 2, 3)]
USUAL += [("colour", 1, 3, 2), ("colour", 1, 4, 2), ("colour", 8, 3, 2), ("colour", 8, 4, 2), ("tangent", 8, 4, 4)]
USUAL += [("joints", 1, 4, 0), ("joints", 3, 4, 0), ("weights", 8, 4, 0)]


def plain(fields, size=None):
    """`size` bytes as they are, or coded as byte(M)."""
    size = fields.count(1 << 24) if size is None else size
    coded, content = fields.rest(), []
    if len(coded) == size:
        return coded
    sequence, models = CodedSequence(coded), bits()
    for _ in range(size):
        content.append(sequence.tree(models, 8, content[-1] if content else 0))
    sequence.end()
    return bytes(content)


class Array:
    def __init__(self, fields, stream=False):
        name = fields.text() if stream else None
        usual, self.domain = divmod(fields.u8(), TWINS + 1)
        require(usual <= (0 if stream else len(USUAL)), "an array that is not known")
        if usual:
            (self.name, self.type, self.components, self.role), self.labels = USUAL[usual - 1], []
        else:
            self.name, self.type = name if stream else fields.text(), fields.u8()
            self.components, self.role, self.labels = fields.count(65535), fields.u8(), fields.list(fields.text)
        require(self.type <= 9 and self.components and self.role <= 5, "an array that cannot be")
        self.tuples = fields.count(2**32 - 2) if self.domain == MESH else None
        self.asked = fields.u8()
        self.bounds = [fields.f64() for _ in range(1 if stream else 3 if self.asked else 0)]
        self.dtype = DTYPES[self.type]


class Block:
    def __init__(self, name, type_, cells):
        self.name, self.type, self.cells = name, type_, cells
        require(type_ in NODES, "a block of a type that is not known")


class Description:
    def __init__(self, stream):
        fields = Fields(plain(Fields(stream)))
        self.effort, self.form = fields.u8(), fields.u8()
        self.welded = bool(self.form & 2)
        require(self.effort <= 9 and self.form <= 3, "an effort or form that cannot be")
        self.points = fields.count(2**32 - 2)
        self.split_points = fields.count() if self.welded else None
        self.corners = fields.count(2**32 - 2)
        self.blocks = fields.list(lambda: self.block(fields))
        self.parts = fields.list(lambda: (fields.count(), fields.count(), fields.list(fields.count)))
        self.positions = Array(fields)
        self.arrays = fields.list(lambda: Array(fields))
        self.metadata = fields.list(lambda: (fields.text(), fields.text()))
        self.provenance = fields.text()
        fields.end()
        require(self.positions.domain == POINTS and self.positions.components == 3, "positions are not three numbers of each point")
        require(not self.welded or self.points < self.split_points <= self.points + self.corners and not self.parts, "twins that cannot be")

    @staticmethod
    def block(fields):
        block = Block(fields.text(), fields.u8(), fields.count(2**32 - 2))
        types = fields.list(lambda: (fields.u8(), fields.count())) if block.type == MIXED else []
        require(not types or sum(count for _, count in types) == block.cells, "types of cells that do not add up")
        return block


class Mesh:
    """Cells by block as lists of (type, points); values of each array, positions first, in the order of its domain."""

    def __init__(self, description, blocks, values):
        self.description, self.blocks, self.values = description, blocks, values
        self.arrays = [description.positions] + description.arrays

    def cells(self):
        return [cell for block in self.blocks for cell in block]
