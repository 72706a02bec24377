"""Section 16.13 of docs/format.md: cells that come at gates."""

from collections import defaultdict

from cells import SHAPES, Connectivity
from container import require
from entropy import Run, bits, hash32

GATED = [kind for kind, shape in enumerate(SHAPES) if shape.dimension > 1]


def edges_of(cycle):
    return list(zip(cycle, cycle[1:] + cycle[:1]))


def ends_beside(points, a, b):
    """Of a face with an edge: its points next to a (not b) and next to b (not a)."""
    n = len(points)
    i, j = next((i, j) for i in range(n) for j in ((i + 1) % n, i - 1) if points[i] is a and points[j] is b)
    way = 1 if points[(i + 1) % n] is b and j == (i + 1) % n else -1
    return points[(i - way) % n], points[(i + 2 * way) % n]


def beyond(cell, f, a, b, gate_cell):
    """(cell, open face, around): the one beyond the edge of two points, from a face on; or nothing."""
    for around in range(1, 64):
        f = next((g for g, face in enumerate(cell.shape.faces) if g != f and {a, b} <= set(cell.points(g))), None)
        if f is None:
            return None
        if cell.open >> f & 1:
            return None if cell is gate_cell else (cell, f, around)
        if not cell.across[f]:
            return None
        cell, f = cell.across[f]
    return None


class Gates(Connectivity):
    def __init__(self, *more):
        super().__init__(*more)
        self.gates, self.plain, self.outcomes_plain = [], defaultdict(Run), 0
        self.as_expected, self.final, self.E = Run(), defaultdict(Run), 1
        self.attached, self.here, self.same = Run(), Run(), defaultdict(Run)
        self.turn_bits, self.joined_bits, self.border_bits, self.row_turns = bits(), bits(), bits(), defaultdict(int)

    def told(self, model, Q, local, nearby, valence):
        return self.ask(Q, local, nearby, valence) if self.ask.mixed else self.sequence.bit(model)

    def waiting(self):
        """The first gate."""
        while self.gates and not self.gates[0][0].open >> self.gates[0][1] & 1:
            self.gates.pop(0)
        return self.gates[0] if self.gates else None

    def give_up(self, gate):
        cell, f = gate
        self.gates = [g for g in self.gates if g != gate]
        if f in cell.gates:
            cell.gates.remove(f)
            for p in cell.points(f):
                if p:
                    p.gates -= 1

    def pattern_by_flags(self):
        return None

    def record(self):
        if self.last_kind in GATED and self.waiting():
            self.ask.signature = 0
            plain = self.plain[self.outcomes_plain].read(self.sequence)
            self.outcomes_plain = (2 * self.outcomes_plain + plain) % 16
            if plain:
                return self.gated_cell(self.last_kind, self.waiting())
        super().record()

    def slow_cell(self, kind):
        if kind not in GATED:
            return super().slow_cell(kind)
        gate = None
        if self.attached.read(self.sequence):
            for _ in range(64):
                gate = self.waiting()
                require(gate, "no gate")
                if self.here.read(self.sequence):
                    break
                self.give_up(gate)
            require(gate and gate[1] in gate[0].gates, "no gate was taken")
        self.gated_cell(kind, gate)

    def gated_cell(self, kind, gate):
        shape, cell = SHAPES[kind], gate and gate[0]
        known, new, glued, own = [None] * shape.corners, [False] * shape.corners, [None] * len(shape.faces), 7
        if gate:
            own = self.lay_on(shape, known, glued, gate, self.row_turn(64 * kind + 8 * gate[1] + cell.entered, cell.signature))
            if shape.dimension == 3:
                self.beside(shape, known, glued, own, cell)
            else:
                self.on_solid(shape, known, own, cell)
        repeats = self.other_corners(kind, known, new, glued, cell, cell)
        if shape.dimension == 3 and not self.old_corners:
            self.rest_beside(shape, known, glued, cell)
        else:
            self.rest(shape, known, glued)
        for g in glued:
            if g:
                self.give_up(g)
        before = self.last.signature if self.last else 0
        come = self.come(kind, known, glued, 0, repeats or {})
        come.entered = own
        self.borders(come, new, cell)
        new = [k for k in range(shape.corners) if new[k]]
        ending = self.ends_of(come, new, before)[1] if come.nodes or repeats is not None else self.expected_ends(come)
        come.signature = self.ask.signature
        for p in ending:
            self.end_point(p)

    def row_turn(self, row, signature):
        if not self.same[row].read(self.sequence):
            last = self.row_turns[row]
            turn_bit = lambda n: self.told(self.turn_bits[64 * row + n], 8, 64 * row + n, signature, 64 * last + n)
            self.row_turns[row] = self.ask_tree(6, turn_bit)
        return self.row_turns[row]

    def beside(self, shape, known, glued, own, gate_cell):
        sides, before = [], 0  # of each edge: own face, beyond, points u and w there
        cycle = shape.faces[own]
        for u, v in edges_of(cycle):
            a, b, h, found = known[u], known[v], shape.other_face(own, u, v), None
            there = beyond(*glued[own], a, b, gate_cell)
            if there and there[1] in there[0].gates and len(there[0].points(there[1])) == len(shape.faces[h]):
                found = ends_beside(there[0].points(there[1]), a, b)
            sides.append((h, there, found))
        for i, (u, v) in enumerate(edges_of(cycle)):
            h, there, found = sides[i]
            if not found:
                continue
            U, W = ends_beside(shape.faces[h], u, v)
            pairs = list(zip((U, W), found))
            if any(known[k] and known[k] is not p for k, p in pairs):
                continue
            some = sum(known[k] is not None for k, _ in pairs)
            if some < 2:
                cell, _, around = there
                earlier, later = sides[i - 1][2], sides[(i + 1) % len(cycle)][2]
                meets = ([earlier[1] is found[0]] if earlier else []) + ([later[0] is found[1]] if later else [])
                x = min(around, 7) | (some > 0) << 3 | sum(meets) << 4 | (len(meets) - sum(meets)) << 6 | min(before, 2) << 8
                x |= min(i, 2) << 10 | (len(cycle) == 4) << 12 | (len(shape.faces[h]) == 4) << 13
                valence = 16 * (32 * known[u].valence + known[v].valence) + min(around, 15)
                if not self.told(self.joined_bits[x], 9, x, hash32(gate_cell.signature, cell.signature), valence):
                    continue
            glued[h] = there[:2]
            before += 1
            for k, p in pairs:
                known[k] = p

    def joined_in(self, cell, p, shape):
        if cell.shape.dimension != shape.dimension:
            return super().joined_in(cell, p, shape)
        faces = [cell.points(f) for f in cell.open_faces()]
        return [q for points in faces for i, x in enumerate(points) if x is p for q in (points[i - 1], points[(i + 1) % len(points)])]

    def rest_beside(self, shape, known, glued, gate_cell):
        for f, cycle in enumerate(shape.faces):
            if glued[f] or not all(known[k] for k in cycle):
                continue
            for u, v in edges_of(cycle):
                h = shape.other_face(f, u, v)
                there = glued[h] and beyond(*glued[h], known[u], known[v], None)
                if there and set(there[0].points(there[1])) == {known[k] for k in cycle}:
                    glued[f] = there[:2]
                    break

    def borders(self, cell, new, gate_cell):
        signature = gate_cell.signature if gate_cell else 0
        for f in cell.open_faces():
            cycle, points = cell.shape.faces[f], cell.points(f)
            x = min(sum(p.border for p in points), 3) | min(sum(new[k] for k in cycle), 3) << 2 | (len(cycle) == 4) << 4
            glued = sum(1 << i for i, g in enumerate(cell.glued) if g)
            if self.told(self.border_bits[64 * cell.kind + x], 16, x | cell.kind << 6, signature, f | glued << 3):
                for p in points:
                    p.border = True
            else:
                self.gates.append((cell, f))
                cell.gates.add(f)
                for p in points:
                    p.gates += 1

    def expected_ends(self, cell):
        ending = [p for p in cell.corners if p.gates == 0 and (self.E or not p.border)]
        if not self.as_expected.read(self.sequence):
            ending = []
            for p in cell.corners:
                end = self.final[(p.gates == 0) + 2 * p.border].read(self.sequence)
                ending += [p] if end else []
                if p.gates == 0 and p.border:
                    self.E = end
        return ending
