"""Section 16.10 of docs/format.md: the order of the mesh, where that of the file is another."""

from collections import defaultdict

from codes import wrap
from container import Fields, require
from entropy import Asker, CodedSequence, Difference, MixedSequence
from normals import Residuals


def k(x):
    return x if x < 4 else 2 + x.bit_length()


class Coder:
    """A sequence of `ordr` with its questions."""

    def __init__(self, data, mixed, file):
        self.sequence, self.asker, self.file = MixedSequence(data), Asker(mixed), file
        self.asker.sequence = self.sequence

    def ask(self, Q, local, nearby, valence, before):
        self.asker.signature = before
        return self.asker(Q, local, nearby, valence)

    def uniform(self, n):
        if n == 1:
            return 0
        b = max((n - 1).bit_length() - 12, 0)
        d = ((n - 1) >> b) + 1
        slot = self.sequence.slot(16, 0)
        i = next(i for i in range(slot * d >> 16, d) if slot < 65536 * (i + 1) // d)
        begin = 65536 * i // d
        self.sequence.take(16, 0, begin, 65536 * (i + 1) // d - begin, slot)
        if b == 0:
            return i
        left = n - (i << b)
        if left < 1 << b:
            return i << b | self.uniform(left)
        upper = self.sequence.raw(max(b - 10, 0))
        return i << b | upper << min(b, 10) | self.sequence.raw(min(b, 10))

    def one_of(self, left):
        left = sorted(left)
        return left[self.uniform(len(left))]


class File:
    """Cells as (shape, nodes) in the order of the file, block by block; what is around points."""

    def __init__(self, blocks, points):
        self.cells = [cell for block in blocks for cell in block]
        self.blocks, begin = [], 0
        for block in blocks:
            self.blocks.append(range(begin, begin + len(block)))
            begin += len(block)
        self.uses = [[] for _ in range(points)]  # (cell, node)
        for c, (_, nodes) in enumerate(self.cells):
            for i, p in enumerate(nodes):
                self.uses[p].append((c, i))
        self.pairs, self.border = defaultdict(dict), set()  # pairs: neighbour by cell and face
        for block in self.blocks:
            waiting = {}
            for c in block:
                shape, nodes = self.cells[c]
                for f, face in enumerate(shape.faces):
                    key = tuple(sorted(nodes[i] for i in face))
                    if key in waiting:
                        other, g = waiting.pop(key)
                        if other != c:
                            self.pairs[c][f], self.pairs[other][g] = other, c
                    else:
                        waiting[key] = c, f
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
        bit, p = 0, None
        if last is not None:
            found, m = candidates(file, last, before, left)
            bit = ask(0, min(m, 15), y % 4, k(len(left)), r)
        y = 2 * y + bit
        if bit:
            require(found, "no candidate")
            for i, (q, (phase, met)) in enumerate(found.items()):
                same = (q in file.border) == (last in file.border)
                r = min(i, 31) + 32 * (q > last) + 64 * (q == last + 1) + 128 * (phase > 0) + 256 * same + 512 * (phase > 1)
                if i == len(found) - 1 or ask(1, r, min(met, 15), len(found), y % 16):
                    p = q
                    break
        else:
            on, off = left & file.border, left - file.border
            p = coder.one_of(on if on and (not off or ask(3, z % 4, y % 8, z % 16, 0)) else off)
        z = 2 * z + (p in file.border)
        left.remove(p)
        order.append(p)
        if last is not None:
            before = [last] + before[:2]
        last = p
    return order


def candidates(file, last, before, left):
    """By point: how (0 joined, 1 not joined, 2 earlier) and how often it was found; and how many are joined."""
    found = {}

    def offer(q, phase):
        if q in found:
            found[q][1] += 1
        elif q in left and len(found) < 48:
            found[q] = [phase, 1]

    def offer_around(p, phase, joined):
        for c, i in file.uses[p][:48]:
            shape, nodes = file.cells[c]
            for j in range(shape.corners) if i < shape.corners else []:
                if (j in shape.near[i]) == joined:
                    offer(nodes[j], phase)

    offer(last + 1, 0)
    offer_around(last, 0, True)
    m = len(found)
    offer_around(last, 1, False)
    for p in before:
        offer_around(p, 2, True)
    return found, m


class CellOrder:
    """Places of cells, block by block."""

    def __init__(self, coder, number):
        """`number`: of a point of the file in the mesh."""
        self.coder, self.file, self.leap = coder, coder.file, Difference()
        self.nodes = [[number[p] for p in nodes] for _, nodes in self.file.cells]
        self.uses = {number[p]: uses for p, uses in enumerate(self.file.uses)}
        self.y, self.r, self.h = 0, 0, 0
        self.order = [c for block in self.file.blocks for c in self.of_block(block)]

    def of_block(self, block):
        self.block, self.left, self.G, self.w = block, set(block), 0, defaultdict(int)
        for c in block:
            for p in self.nodes[c]:
                self.w[p] += len(self.uses[p]) <= 64
        order = []
        while self.left:
            c = self.next(order)
            self.left.remove(c)
            for p in self.nodes[c]:
                self.w[p] -= len(self.uses[p]) <= 64
            order.append(c)
        return order

    def next(self, order):
        ask, y, r = self.coder.ask, self.y, self.r
        beside = self.near(order[-1])[1] if order else 0
        state = beside, y % 16, min(self.w[self.G], 15), r
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
            leap = self.leap.read(self.coder.sequence)
            require(leap >= 0, "a leap backwards")
            self.G += leap
        for g in range(128):
            p, rank = self.G + g, 0
            w = min(self.w[p], 15)
            for c, _ in self.uses.get(p, []) if w else []:
                if c in self.left:
                    below = sum(q < p for q in self.nodes[c])
                    if ask(4, (g == 0) | w << 1 | below << 5, rank << 4 | w, k(g), y % 256):
                        self.G = p
                        return c
                    rank += 1
        require(False, "no cell was taken")

    def near(self, cell):
        """By cell, the face (7: none) and how often it was found; and how many are beside."""
        found = {}

        def offer(c, face):
            if c in found:
                found[c] = face if face < 7 else found[c][0], found[c][1] + 1
            elif c in self.left and len(found) < 64:
                found[c] = face, 1

        offer(cell + 1, 7)
        for f, c in sorted(self.file.pairs[cell].items()):
            offer(c, f)
        beside = len(found)
        for p in self.nodes[cell]:
            for c, _ in self.uses[p] if len(self.uses[p]) <= 64 else []:
                if c != cell:
                    offer(c, 7)
        return found, beside

    def from_cell(self, cell, j):
        self.y, self.h = 4 * self.y + 2, 16 * self.h + j
        found, _ = self.near(cell)
        require(found, "no cell is near")
        for i, (c, (face, met)) in enumerate(found.items()):
            self.r = face | min(i, 7) << 3 | (c == cell + 1) << 6 | min(met, 7) << 7
            least = min((p for p in self.nodes[c] if p >= self.G), default=None)
            far = 2**64 - 1 if least is None else least - self.G
            if i == len(found) - 1 or self.coder.ask(1, self.r, k(far), len(found), self.y % 256):
                return c


def plain(data, counts):
    """Lists of numbers below each count."""
    sequence = CodedSequence(data)
    residuals, lists = Residuals(sequence), []
    for n in counts:
        e = length = 0
        lists.append([])
        for _ in range(n):
            residual = residuals.read(0, 2 * length, 0, 64)
            length = abs(residual).bit_length()
            lists[-1].append(wrap(e + residual, 64))
            e = lists[-1][-1] + 1
        require(sorted(lists[-1]) == list(range(n)), "an order that is no permutation")
    sequence.end()
    return lists


def mesh_order(stream, blocks, points):
    """Points, and cells by number over all blocks, in the order of the mesh."""
    fields = Fields(stream)
    flags = fields.u8()
    of_points, of_cells = fields.section(), fields.rest()
    file = File(blocks, points)
    if flags & 2:
        order = plain(of_points, [points])[0]
        lists = plain(of_cells, [len(block) for block in blocks]) if not flags & 4 else [range(len(b)) for b in blocks]
        return order, [own[i] for own, places in zip(file.blocks, lists) for i in places]
    coder = Coder(of_points, flags & 1, file)
    order = points_in_order(coder)
    coder.sequence.end()
    if flags & 4:
        return order, list(range(len(file.cells)))
    number = {p: i for i, p in enumerate(order)}
    coder = Coder(of_cells, flags & 1, file)
    cells = CellOrder(coder, number).order
    coder.sequence.end()
    return order, cells
