"""Sections 15.2 and 16.10 of docs/format.md: the order of the mesh, where that of the file is another."""
from collections import defaultdict
import numpy as np
from container import Fields, unzigzag, wrap
from description import CELLS, CORNERS, MESH, POINTS
from entropy import Asker, CodedSequence, MixedSequence
from more.mixing import MixedAsker
from single import ranges

# --- 15.2: mode single

def permutation(sequence, n):
    """The number of each of n elements."""
    number, c, numbers = -1, 0, []
    sequence.forget()
    for _ in range(n):
        u = sequence.count("number", c)
        number, c = number + 1 + unzigzag(u) & 0xFFFFFFFF, min(u.bit_length(), 15)
        numbers.append(number)
    return numbers

def reorder(mesh, stream):
    sequence, cells = CodedSequence(stream), mesh.cells()
    point_numbers, cell_numbers = permutation(sequence, len(mesh.values[0])), permutation(sequence, len(cells))
    rotations = [0]
    for _ in cells:
        rotations.append(sequence.count("rotation", min(rotations[-1], 3)))
    old_point, old_cell = (np.argsort(numbers).astype(int) for numbers in (point_numbers, cell_numbers))
    corners, made, old_corner = ranges([len(nodes) for _, nodes in cells]), [], []
    for i in old_cell:
        (type_, nodes), r = cells[i], rotations[1 + i]
        order = [(j - r) % len(nodes) for j in range(len(nodes))]
        made.append((type_, [point_numbers[nodes[j]] for j in order]))
        old_corner += [corners[i][j] for j in order]
    places = {CELLS: old_cell, CORNERS: np.array(old_corner, int), MESH: slice(None)}
    mesh.values = [values[places.get(array.domain, old_point)] for values, array in zip(mesh.values, mesh.arrays)]
    mesh.blocks = [[made[i] for i in block] for block in ranges(list(map(len, mesh.blocks)))]

# --- 16.10: mode stream

def k(x): return x if x < 4 else 2 + x.bit_length()

class Coder:
    """A sequence of `ordr` with its questions."""

    def __init__(self, data, mixed, file):
        self.sequence, self.asker, self.file = MixedSequence(data), (MixedAsker if mixed else Asker)(), file
        self.asker.sequence = self.sequence

    def ask(self, Q, local, nearby, valence, before):
        self.asker.signature = before
        return self.asker(Q, local, nearby, valence)

    def uniform(self, n):
        if n == 1:
            return 0
        b = max((n - 1).bit_length() - 12, 0)
        i = self.sequence.part_of((n - 1 >> b) + 1, 16)
        left = n - (i << b)
        if b == 0 or left < 1 << b:
            return i << b | (self.uniform(left) if b else 0)
        upper = self.sequence.raw(max(b - 10, 0))
        return i << b | upper << min(b, 10) | self.sequence.raw(min(b, 10))

    def one_of(self, left): return sorted(left)[self.uniform(len(left))]

class File:
    """Cells as (shape, nodes) in the order of the file; what is around points."""

    def __init__(self, cells, blocks, points):
        self.cells, self.blocks, self.uses = cells, blocks, [[] for _ in range(points)]  # uses: (cell, node)
        for c, (_, nodes) in enumerate(self.cells):
            for i, p in enumerate(nodes):
                self.uses[p].append((c, i))
        self.pairs, self.border = defaultdict(dict), set()  # pairs: neighbour by cell and face
        for block in self.blocks:
            waiting = {}
            for c, (shape, nodes) in ((c, self.cells[c]) for c in block):
                for f, face in enumerate(shape.faces):
                    key = tuple(sorted(nodes[i] for i in face))
                    other, g = waiting.pop(key, (None, None))
                    if other is None:
                        waiting[key] = c, f
                    elif other != c:
                        self.pairs[c][f], self.pairs[other][g] = other, c
            self.border |= {p for key in waiting for p in key}

def points_in_order(coder):
    file, ask = coder.file, coder.ask
    left = {p for p, uses in enumerate(file.uses) if uses}
    unused = [p for p, uses in enumerate(file.uses) if not uses]
    order, last, before, a, y, r, z = [], None, [], 0, 0, 0, 0
    while left or unused:
        if unused:
            bit = ask(2, a % 2, y % 16, a % 16, y % 2) if left else 1
            a = 2 * a + bit
            if bit:
                order.append(unused.pop(0))
                continue
        found, m = candidates(file, last, before, left) if last is not None else ({}, 0)
        bit = ask(0, min(m, 15), y % 4, k(len(left)), r) if last is not None else 0
        y = 2 * y + bit
        if bit:
            for i, (p, (phase, met)) in enumerate(found.items()):
                r = min(i, 31) + 32 * (p > last) + 64 * (p == last + 1) + 128 * (phase > 0) + 512 * (phase > 1)
                r += 256 * ((p in file.border) == (last in file.border))
                if i == len(found) - 1 or ask(1, r, min(met, 15), len(found), y % 16):
                    break
        else:
            on, off = left & file.border, left - file.border
            p = coder.one_of(on if on and (not off or ask(3, z % 4, y % 8, z % 16, 0)) else off)
        z = 2 * z + (p in file.border)
        left.remove(p)
        order.append(p)
        last, before = p, before if last is None else [last] + before[:2]
    return order

def found_once(offered, left, most):
    """Those left among (which, how), with the least way in which they were found, and how often."""
    found = {}
    for q, how in offered:
        if q in found or q in left and len(found) < most:
            found[q] = min(how, found.get(q, (how, 0))[0]), found.get(q, (how, 0))[1] + 1
    return found

def candidates(file, last, before, left):
    """By point: how (0 joined, 1 not joined, 2 earlier) and how often it was found; and how many are joined."""
    def around(p, phase, joined):
        for c, i in file.uses[p][:48]:
            shape, nodes = file.cells[c]
            corners = range(shape.corners if i < shape.corners else 0)
            offered.extend((nodes[j], phase) for j in corners if (j in shape.near[i]) == joined)

    offered = [(last + 1, 0)]
    for p, phase, joined in [(last, 0, True), (last, 1, False)] + [(p, 2, True) for p in before]:
        around(p, phase, joined)
    found = found_once(offered, left, 48)
    return found, sum(phase == 0 for phase, _ in found.values())

class CellOrder:
    """Places of cells, block by block."""

    def __init__(self, coder, number):
        """`number`: of a point of the file in the mesh."""
        self.coder, self.file = coder, coder.file
        self.nodes = [[number[p] for p in nodes] for _, nodes in self.file.cells]
        self.uses = {number[p]: uses for p, uses in enumerate(self.file.uses)}
        self.y, self.r, self.h = 0, 0, 0
        self.order = [c for block in self.file.blocks for c in self.of_block(block)]

    def of_block(self, block):
        self.left, self.G, self.w, order = set(block), 0, defaultdict(int), []
        for c in block:
            for p in self.nodes[c]:
                self.w[p] += len(self.uses[p]) <= 64
        while self.left:
            c = self.next(order)
            self.left.remove(c)
            for p in self.nodes[c]:
                self.w[p] -= len(self.uses[p]) <= 64
            order.append(c)
        return order

    def next(self, order):
        ask, y = self.coder.ask, self.y
        beside = self.near(order[-1])[1] if order else 0
        state = beside, y % 16, min(self.w[self.G], 15), self.r
        if ask(2, *state):
            return self.led()
        for j, cell in enumerate(order[:-9:-1]):
            if any(self.w[p] for p in self.nodes[cell]) or j == 0 and beside:
                if ask(5, j, self.h % 16, self.h % 256, 16 * j + y % 16) if j else ask(0, *state):
                    return self.from_cell(cell, j)
        self.y, self.h = 4 * y, 16 * self.h + 15
        return self.coder.one_of(self.left)

    def led(self):
        ask = self.coder.ask
        self.y = y = 4 * self.y + 1
        if ask(3, 0, 0, 0, 0):
            self.G += self.coder.sequence.difference("Leap")
        for g in range(128):
            p, w, rank = self.G + g, min(self.w[self.G + g], 15), 0
            for c in (c for c, _ in self.uses.get(p, []) if w and c in self.left):
                below = sum(q < p for q in self.nodes[c])
                if ask(4, (g == 0) | w << 1 | below << 5, rank << 4 | w, k(g), y % 256):
                    self.G = p
                    return c
                rank += 1
        raise ValueError("no cell was taken")

    def near(self, cell):
        """By cell, the last face, negated (7: none), and how often it was found; and how many are beside."""
        beside = [(cell + 1, 7)] + [(c, -f) for f, c in sorted(self.file.pairs[cell].items())]
        around = (self.uses[p] for p in self.nodes[cell] if len(self.uses[p]) <= 64)
        offered = beside + [(c, 7) for uses in around for c, _ in uses if c != cell]
        return found_once(offered, self.left, 64), len({c for c, _ in beside} & self.left)

    def from_cell(self, cell, j):
        self.y, self.h = 4 * self.y + 2, 16 * self.h + j
        found, _ = self.near(cell)
        for i, (c, (face, met)) in enumerate(found.items()):
            self.r = abs(face) | min(i, 7) << 3 | (c == cell + 1) << 6 | min(met, 7) << 7
            far = min((p - self.G for p in self.nodes[c] if p >= self.G), default=2**64 - 1)
            if i == len(found) - 1 or self.coder.ask(1, self.r, k(far), len(found), self.y % 256):
                return c

def plain(data, counts):
    """Lists of numbers below each count."""
    sequence, lists = CodedSequence(data), []
    for n in counts:
        e, length, numbers = 0, 0, []
        for _ in range(n):
            residual = sequence.residual(0, 2 * length, 0, 64)
            length = abs(residual).bit_length()
            numbers.append(wrap(e + residual, 64))
            e = numbers[-1] + 1
        lists.append(numbers)
    return lists

def reorder_stream(mesh, walk, blocks, stream):
    """Puts points, and cells block by block, in the order of the mesh."""
    fields, n, cells = Fields(stream), len(mesh.values[0]), mesh.cells()
    flags, of_points, of_cells = fields.u8(), fields.section(), fields.rest()
    file = File(walk.kept, blocks, n)
    points = plain(of_points, [n])[0] if flags & 2 else points_in_order(Coder(of_points, flags & 1, file))
    number, order = {p: i for i, p in enumerate(points)}, range(len(cells))
    if flags & 6 == 2:
        places = plain(of_cells, [len(block) for block in blocks])
        order = [block[i] for block, own in zip(blocks, places) for i in own]
    elif not flags & 4:
        order = CellOrder(Coder(of_cells, flags & 1, file), number).order
    cells = [(cells[c][0], [number[p] for p in cells[c][1]]) for c in order]
    mesh.values = [v[points if a.domain == POINTS else order] for a, v in zip(mesh.arrays, mesh.values)]
    mesh.blocks = [cells[block.start : block.stop] for block in blocks]
