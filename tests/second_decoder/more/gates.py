"""Section 16.13 of docs/format.md: cells that come at gates."""
from collections import defaultdict
from cells import SHAPES, along, edges_of, turned
from entropy import hash32, tree
from more.kinds import AllCells
from more.mixing import MixedAsker

GATED = [kind for kind, shape in SHAPES.items() if shape.dimension > 1]

def ends_beside(points, a, b):
    """Of a face with an edge: its points next to a (not b) and next to b (not a)."""
    found = along(points, a, b)
    return found[-1], found[2]

def beyond(cell, f, a, b, gate_cell):
    """(cell, open face, around): the one beyond the edge of two points, from a face on; or nothing."""
    for around in range(1, 64):
        f = next((g for g in range(len(cell.across)) if g != f and {a, b} <= set(cell.points(g))), None)
        if f in cell.open_faces():
            return None if cell is gate_cell else (cell, f, around)
        if f is None or not cell.across[f]:
            return None
        cell, f = cell.across[f]

class Gates(AllCells):
    def __init__(self, *more):
        super().__init__(*more)
        self.gates, self.outcomes_plain, self.E, self.row_turns = [], 0, 1, defaultdict(int)

    def told(self, Q, local, nearby, valence):
        return self.ask(Q, local, nearby, valence) if isinstance(self.ask, MixedAsker) else self.sequence.bit("Told", Q, local)

    def waiting(self):
        """The first gate."""
        while self.gates and not self.gates[0][0].open >> self.gates[0][1] & 1:
            self.gates.pop(0)
        return self.gates[0] if self.gates else None

    def give_up(self, gate):
        cell, f = gate
        self.gates = [g for g in self.gates if g != gate]
        for p in filter(None, cell.points(f) if f in cell.gates else []):
            p.gates -= 1
        cell.gates.discard(f)

    def record(self):
        if self.last_kind in GATED and self.waiting():
            self.ask.signature = 0
            plain = self.sequence.run("Plain", self.outcomes_plain)
            self.outcomes_plain = (2 * self.outcomes_plain + plain) % 16
            if plain:
                return self.gated_cell(self.last_kind, self.waiting())
        super().record()

    def slow_cell(self, kind):
        if kind not in GATED:
            return super().slow_cell(kind)
        gate = self.waiting() if self.sequence.run("Attached") else None
        while gate and not self.sequence.run("Here"):
            self.give_up(gate)
            gate = self.waiting()
        self.gated_cell(kind, gate)

    def gated_cell(self, kind, gate):
        turn = self.row_turn(64 * kind + 8 * gate[1] + gate[0].entered, gate[0]) if gate else 0
        cell, new, repeats, _, before = self.new_cell(kind, gate, turn, gate and gate[0])
        self.borders(cell, new, gate and gate[0])
        if cell.nodes or repeats is not None:
            ending = self.points_that_end(cell, self.ends_of(cell, new, before), new, before)
        else:
            ending = self.expected_ends(cell)
        cell.signature = self.ask.signature
        self.end_points(ending)

    def make_pattern(self, *_): return None

    def row_turn(self, row, cell):
        if not self.sequence.run("Same", row):
            last = 64 * self.row_turns[row]
            turn_bit = lambda n: self.told(8, 64 * row + n, cell.signature, last + n)
            self.row_turns[row] = tree(6, turn_bit)
        return self.row_turns[row]

    def edges(self, kind, known, glued, own, gate_cell):
        if SHAPES[kind].dimension < 3:
            return super().edges(kind, known, glued, own, gate_cell)
        shape, sides, before, edges = SHAPES[kind], [], 0, edges_of(SHAPES[kind].faces[own])
        for u, v in edges:  # own face, beyond, points u and w there
            h, there, found = shape.other_face(own, u, v), beyond(*glued[own], known[u], known[v], gate_cell), None
            if there and there[1] in there[0].gates and len(there[0].points(there[1])) == len(shape.faces[h]):
                found = ends_beside(there[0].points(there[1]), known[u], known[v])
            sides.append((h, there, found))
        for i, ((u, v), (h, there, found)) in enumerate(zip(edges, sides)):
            pairs = list(zip(ends_beside(shape.faces[h], u, v), found)) if found else []
            if not found or any(known[k] and known[k] is not p for k, p in pairs):
                continue
            some = sum(known[k] is not None for k, _ in pairs)
            if some < 2:
                cell, _, around = there
                earlier, later = sides[i - 1][2], sides[(i + 1) % len(edges)][2]
                meets = ([earlier[1] is found[0]] if earlier else []) + ([later[0] is found[1]] if later else [])
                x = min(around, 7) | (some > 0) << 3 | sum(meets) << 4 | (len(meets) - sum(meets)) << 6
                x |= min(before, 2) << 8 | min(i, 2) << 10 | (len(edges) == 4) << 12 | (len(shape.faces[h]) == 4) << 13
                valence = 16 * (32 * known[u].valence + known[v].valence) + min(around, 15)
                if not self.told(9, x, hash32(gate_cell.signature, cell.signature), valence):
                    continue
            glued[h] = there[:2]
            before += 1
            for k, p in pairs:
                known[k] = p

    def joined_in(self, cell, p, shape):
        if cell.shape.dimension != shape.dimension:
            return super().joined_in(cell, p, shape)
        faces = [cell.points(f) for f in cell.open_faces()]
        return [q for points in faces for i, x in enumerate(points) if x is p for q in turned(points, i - 1, 2)[:2]]

    def rest(self, shape, known, glued):
        beside = shape.dimension == 3 and not self.old_corners
        for f, cycle in enumerate(shape.faces if beside else []):
            for u, v in edges_of(cycle) if not glued[f] and all(known[k] for k in cycle) else []:
                h = shape.other_face(f, u, v)
                there = glued[h] and beyond(*glued[h], known[u], known[v], None)
                if there and set(there[0].points(there[1])) == {known[k] for k in cycle}:
                    glued[f] = there[:2]
                    break
        if not beside:
            super().rest(shape, known, glued)
        for g in filter(None, glued):
            self.give_up(g)

    def borders(self, cell, new, gate_cell):
        signature = gate_cell.signature if gate_cell else 0
        glued = sum(1 << i for i, g in enumerate(cell.glued) if g)
        for f in cell.open_faces():
            cycle, points = cell.shape.faces[f], cell.points(f)
            old, fresh = min(sum(p.border for p in points), 3), min(sum(k in new for k in cycle), 3)
            x = old | fresh << 2 | (len(cycle) == 4) << 4
            border = self.told(16, x | cell.kind << 6, signature, f | glued << 3)
            for p in points:
                p.border, p.gates = p.border or bool(border), p.gates + (not border)
            if not border:
                self.gates.append((cell, f))
                cell.gates.add(f)

    def expected_ends(self, cell):
        if self.sequence.run("AsExpected"):
            return [p for p in cell.corners if p.gates == 0 and (self.E or not p.border)]
        ending = [(p, self.sequence.run("Final", p.gates == 0, p.border)) for p in cell.corners]
        self.E = ([self.E] + [end for p, end in ending if p.gates == 0 and p.border])[-1]
        return [p for p, end in ending if end]
