"""Sections 16.2 to 16.7 of docs/format.md: hexahedra and tetrahedra of mode stream, and what is around new elements.
more/kinds.py adds the other kinds of cells."""
from bisect import insort
from collections import defaultdict
from container import M64, Unread
from entropy import MixedSequence, Models, hash32, tree

class Shape:
    """16.2: what all cells of a kind have in common."""

    def __init__(self, type_, dimension, faces, nodes="", order=None):
        """`nodes`: the corners that nodes behind the corners lie on; `order`: of VTK, where it is another."""
        self.type, self.dimension = type_, dimension
        self.faces = [[int(k) for k in face] for face in faces.split()]
        self.nodes = [sorted(int(k) for k in corners) for corners in nodes.split()]
        self.corners = n = 1 + max((k for face in self.faces for k in face), default=0)
        self.order = order or list(range(n + len(self.nodes)))
        pairs = [pair for face in (self.faces if dimension > 1 else [[0, 1]] * dimension) for pair in edges_of(face)]
        self.near = [sorted({j for pair in pairs if k in pair for j in pair} - {k}) for k in range(n)]
        cycles = [cycle for cycle in (self.faces if dimension == 3 else [list(range(n))]) if len(cycle) == 4]
        at = [[(cycle, cycle.index(k)) for cycle in cycles if k in cycle] for k in range(n)]
        self.parallelograms = [[(c[i - 3], c[i - 1], c[i - 2]) for c, i in own] for own in at]  # (a, b, d) of each corner

    def other_face(self, f, u, v):
        """That across the edge of two corners of a face."""
        return next(g for g, face in enumerate(self.faces) if g != f and u in face and v in face)

def edges_of(cycle): return list(zip(cycle, cycle[1:] + cycle[:1]))

def turned(cycle, at, way):
    """The cycle from a place on, forwards (1) or backwards (-1)."""
    return [cycle[(at + way * k) % len(cycle)] for k in range(len(cycle))]

def along(cycle, a, b):
    """The cycle from a on, in the direction of b beside it."""
    ways = (turned(cycle, i, way) for i, x in enumerate(cycle) if x == a for way in (1, -1))
    return next(found for found in ways if found[1] == b)

HEXAHEDRON, TETRAHEDRON = "0473 1265 0154 3762 0321 4567", "013 123 203 021"
SHAPES = {0: Shape(12, 3, HEXAHEDRON), 1: Shape(10, 3, TETRAHEDRON)}  # by kind
UNUSED_POINT, END_OF_POINT = 18, 20

class Slots:
    """16.3: slots in groups of 16."""

    def __init__(self):
        self.free_in, self.current, self.freed, self.taken, self.sweep = [[]], 0, [], 0, 0  # the first group is full

    def take(self):
        if not self.free_in[self.current]:
            self.current = self.next_group()
        self.taken += 1
        return 16 * self.current + self.free_in[self.current].pop(0)

    def next_group(self):
        if self.freed:
            return self.freed.pop()
        if 16 * (len(self.free_in) - 1) <= 2 * self.taken + 4096:
            self.free_in.append(list(range(16)))
            return len(self.free_in) - 1
        while not self.free_in[self.sweep]:
            self.sweep = (self.sweep + 1) % len(self.free_in)
        return self.sweep

    def free(self, slot):
        group, i = divmod(slot, 16)
        insort(self.free_in[group], i)
        self.taken -= 1
        if group != self.current and len(self.free_in[group]) == 16:
            self.freed.append(group)

class Point:
    """16.3: a point in memory."""

    def __init__(self, slot, number):
        self.slot, self.number, self.cells, self.open, self.alive = slot, number, [], 0, True
        self.gates, self.border = 0, False  # 16.13

    @property
    def valence(self): return min(len(self.cells), 255)

class StreamCell:
    """16.3: a cell in memory. Corners are None once their points have ended; `open` has a bit for each face, `glued`
    the cells across when it came, `across` (cell, face) as it is; `nodes` stand behind the corners."""

    def __init__(self, kind, corners, slot, ordinal):
        self.kind, self.shape, self.corners, self.slot, self.ordinal = kind, SHAPES[kind], corners, slot, ordinal
        n, self.signature, self.nodes = len(self.shape.faces), 0, []
        self.open, self.glued, self.across, self.gates = (1 << n) - 1, [None] * n, [None] * n, set()
        self.alive, self.successor, self.pattern, self.entered = True, None, 0, 7

    def points(self, f): return [self.corners[k] for k in self.shape.faces[f]]
    def open_faces(self): return [f for f in range(len(self.shape.faces)) if self.open >> f & 1]

def open_face(points, size):
    """The first open face of so many corners that has these points."""
    faces = ((cell, f) for cell in points[0].cells[:64] for f in cell.open_faces()) if points else ()
    fitting = (g for g in faces if len(g[0].shape.faces[g[1]]) == size and set(points) <= set(g[0].points(g[1])))
    return next(fitting, None)

class Cells:
    """16.3 to 16.6: what goes on from batch to batch."""

    def __init__(self, ask, numbered):
        self.ask, self.numbered, self.points_made, self.blocks, self.kept = ask, numbered, 0, [], []
        self.points = {}  # in memory, by number
        self.point_slots, self.cell_slots, self.ended = Slots(), Slots(), []
        self.last, self.last_kind, self.S, self.last_anchor, self.recent = None, 0, {}, None, []
        self.G = self.choice = self.last_face = self.outcomes = self.hits = 0
        self.turns, self.patterns, self.pattern_ids, self.signatures = defaultdict(int), [None], {None: 0}, [0]
        self.tracks, self.last_hit_e, self.models = [M64], False, Models()

    def batch(self, cells, numbers, records, begins):
        """`begins`: types of blocks by record. Gives (type, point numbers) of cells; what 16.7 needs about new points
        and cells is in `born` and `came`."""
        self.sequence = self.ask.sequence = MixedSequence(cells, self.models)
        self.numbers, self.made, self.born, self.came = MixedSequence(numbers, self.models), [], [], []
        for r in range(records):
            self.blocks += [[begins[r], 0]] if r in begins else []
            before = len(self.made)
            self.record()
            if self.blocks:
                self.blocks[-1][1] += len(self.made) - before
            if r % 4096 == 4095 or r == records - 1:
                for slot in self.ended:
                    self.point_slots.free(slot)
                self.ended = []
        return self.made

    # --- points

    def new_point(self, context, place=([], [], 31, None), e=None, more=()):
        """`place`: what 16.7 needs; `e` and `more`: guesses of its number."""
        number = self.read_number(context, e, more) if self.numbered else self.points_made
        self.points_made += 1
        p = self.points[number] = Point(self.point_slots.take(), number)
        self.born.append((number, p.slot, *place))
        return p

    def end_point(self, p):
        for cell in p.cells:
            for f in (f for f in cell.open_faces() if p in cell.points(f)):
                cell.open &= ~(1 << f)
                for q in filter(None, cell.points(f)):
                    q.open = q.open - 1 & 0xFFFF
            cell.corners = [None if q is p else q for q in cell.corners]
            if not any(cell.corners) and cell.alive:
                cell.alive = False
                self.cell_slots.free(cell.slot)
        p.alive = False
        del self.points[p.number]
        self.ended.append(p.slot)

    def end_points(self, points):
        for p in points:
            if p is not None and p.alive:
                self.end_point(p)

    def old_point(self, base): return self.points[base + self.sequence.difference("Old")]

    def read_number(self, context, e, more):
        """16.4: numbers of new points."""
        first, expected = self.tracks[0] + 1 & M64, [] if e is None else [e]
        guesses = (expected if self.last_hit_e else []) + [first] + expected + list(more)
        guesses += [t + 1 for t in self.tracks[1:]] + [t - 1 for t in self.tracks[:2]]
        guesses = list(dict.fromkeys(guess & M64 for guess in guesses))
        s = 0 if e is None else 1 if e == first else 2 if e > first else 3
        for i, guess in enumerate(guesses):
            if self.numbers.run("Guess", context, s, self.hits, guesses[0] == e and self.last_hit_e, i):
                self.hits, self.last_hit_e = (4 * self.hits + min(i, 2)) % 16, guess == e
                near = (k for k, t in enumerate(self.tracks) if guess in (t + 1 & M64, t - 1 & M64))
                k = next(near, min(len(self.tracks), 7))
                self.tracks = [guess] + self.tracks[:k] + self.tracks[k + 1 :]
                return guess
        self.hits = (4 * self.hits + 3) % 16
        number = self.tracks[self.numbers.tree(3, "Which")] + self.numbers.difference("Jump") & M64
        self.tracks = [number] + self.tracks[:7]
        return number

    # --- records

    def record(self):
        applied = self.pattern_by_flags()
        if applied:
            return self.cell_by_pattern(*applied)
        ask, last = self.ask, self.last_kind
        ask.signature = 0
        if not ask(0, last, 0, 0):
            self.last_kind = tree(5, lambda node: ask(1, 32 * last + node, 0, 0))
        self.of_kind(self.last_kind)

    def of_kind(self, kind):
        if kind in (UNUSED_POINT, END_OF_POINT):
            p = self.new_point(32) if kind == UNUSED_POINT else self.old_point(self.G)
            self.G = p.number if kind == END_OF_POINT else self.G
            self.end_point(p)
        elif kind in SHAPES:
            self.slow_cell(kind)
        else:
            raise Unread("cells given by faces" if kind == 21 else f"cells of kind {kind}")

    # --- patterns (16.5): kind, what corners are, what faces are glued to (a source and its place or a word), ends

    def sources(self):
        return ({0: self.last} if self.last else {}) | {1 + f: s for f, s in self.S.items() if s.alive}

    def apply(self, pattern):
        """Corners (None: new) and what faces are glued to, or nothing."""
        kind, corners, faces, _ = pattern
        sources = self.sources().items()
        places = {(i, k): p for i, s in sources for k, p in enumerate(s.corners)}
        opened = {(i, f): (s, f) for i, s in sources for f in s.open_faces()}
        known, glued = [places.get(what) for what in corners], [opened.get(what) for what in faces]
        if any(isinstance(what, tuple) and part is None for what, part in zip(corners + faces, known + glued)):
            return None
        for f, cycle in ((f, SHAPES[kind].faces[f]) for f, what in enumerate(faces) if what == "found"):
            there = [known[k] for k in cycle if known[k]]
            glued[f] = open_face(there, len(cycle)) if len(there) >= len(cycle) - 1 else None
            rest = [p for p in glued[f][0].points(glued[f][1]) if p not in there] if glued[f] else []
            for k in cycle:
                known[k] = known[k] or next(iter(rest), None)
            if not glued[f] or None in [known[k] for k in cycle]:
                return None
        return None if any(p is None and what != "new" for p, what in zip(known, corners)) else (known, glued)

    def pattern_by_flags(self):
        """Its number, corners and what faces are glued to, if a pattern is taken."""
        if self.last is None:
            return None
        S = sorted((s for s in self.S.values() if s.alive), key=lambda s: s.ordinal)
        three = [s.pattern for s in S[-1:] + S[:1]] or [0, 0]
        three.append(self.last.pattern if self.last.alive else 0)
        a = (three[0] == three[1]) + 2 * (three[0] == three[2])
        for id_ in dict.fromkeys(three):
            applied = self.apply(self.patterns[id_]) if id_ else None
            if applied:
                taken = self.sequence.run("Pattern", id_ % 512, three.index(id_), a, self.outcomes)
                self.outcomes = (2 * self.outcomes + taken) % 4
                if taken:
                    return id_, *applied
        return None

    def cell_by_pattern(self, id_, known, glued):
        kind, _, faces, ends = self.patterns[id_]
        nearer, sources = None, self.sources().values()
        self.last_kind = kind
        if any(what == "found" and glued[f][0] in sources for f, what in enumerate(faces)):
            nearer = self.make_pattern(kind, known, glued, ends)
        before = self.last.signature if self.last else 0
        cell = self.come(kind, known, glued)
        self.ask.signature = self.signatures[id_]
        ending = self.points_that_end(cell, ends, [], before)
        cell.signature = self.ask.signature
        cell.pattern = self.pattern_id(nearer, cell.signature) or id_
        self.end_points(ending)

    def make_pattern(self, kind, known, glued, ends=0):
        """Of corners (None: new) and glued faces, before the cell has come."""
        sources = sorted(self.sources().items())
        places = [next(((i, s.corners.index(p)) for i, s in sources if p in s.corners), "found") for p in known]
        corners = (place if p else "new" for p, place in zip(known, places))
        faces = (next(((i, g[1]) for i, s in sources if s is g[0]), "found") if g else None for g in glued)
        pattern = kind, tuple(corners), tuple(faces), ends
        applied = self.apply(pattern)
        return pattern if applied and applied[0] == known else None

    def pattern_id(self, pattern, signature):
        if pattern not in self.pattern_ids and len(self.patterns) < 65536:
            self.pattern_ids[pattern] = len(self.patterns)
            self.patterns.append(pattern)
            self.signatures.append(signature)
        return self.pattern_ids.get(pattern, 0)

    # --- a cell comes

    def behind(self, k, n, shape, known, glued):
        """16.7: the point behind corner n, seen from corner k."""
        across = (g for face, g in zip(shape.faces, glued) if g and n in face and k not in face)
        cell, f = next(across, (None, None))
        near = cell.shape.near[cell.corners.index(known[n])] if cell and known[n] in cell.corners else []
        return next((cell.corners[i] for i in near if i not in cell.shape.faces[f]), None)

    def place_of(self, k, shape, known, glued, several):
        """16.7: sums, near points and situation of a new corner, and the points around."""
        around, near = list(dict.fromkeys(p.number for p in known if p)), [n for n in shape.near[k] if known[n]]
        slots, all_ = [p and p.slot for p in known], shape.parallelograms[k]
        whole = [abd for abd in all_ if all(known[i] for i in abd)]
        if shape.corners == 8 and all(known[i] for i in range(8) if i != k):
            seven = near + [d for _, _, d in all_]
            seven += [i for i in range(8) if i not in [k, *seven]]
            return [slots[i] for i in seven], [slots[i] for i in near], k, around
        sums = [[(slots[i], s / len(whole[:2])) for abd in whole[:2] for i, s in zip(abd, (1, 1, -1))]]
        straight = near[:3] if several or not all_ else []
        pairs = [(slots[n], b.slot) for n, b in ((n, self.behind(k, n, shape, known, glued)) for n in straight) if b]
        sums.append([x for n, b in pairs for x in ((n, 2 * (1 / len(pairs))), (b, -(1 / len(pairs))))])
        sums.append([(slots[n], 1 / len(near)) for n in near])
        return list(filter(None, sums)), [slots[n] for n in near[:3]], 8 + 4 * len(whole) + len(near[:3]), around

    def come(self, kind, known, glued, repeats={}):
        """`repeats`: corners that are others."""
        known, shape, L = list(known), SHAPES[kind], self.last
        new = [k for k, p in enumerate(known) if p is None and k not in repeats]
        for k in new:
            whole, more = [abd for abd in shape.parallelograms[k] if all(known[i] for i in abd)], []
            a, b, d = (known[i].number for i in whole[0]) if whole else (0, 0, 0)
            if L and L.alive and L.kind == kind and L.corners[k]:
                ends = [(known[n].number, L.corners[n].number) for n in shape.near[k] if known[n] and L.corners[n]]
                more = [own + L.corners[k].number - before for own, before in ends[:3]]
            place, context = self.place_of(k, shape, known, glued, len(new) > 1), k + 8 * (len(new) > 1)
            p = self.new_point(context, place, a + b - d & M64 if whole else None, more)
            for r in [k] + [r for r, of in repeats.items() if of == k]:
                known[r] = p
        cell = StreamCell(kind, known, self.cell_slots.take(), L.ordinal + 1 if L else 0)
        self.nodes_behind(cell, new)
        for f, (other, g) in ((f, there) for f, there in enumerate(glued) if there):
            cell.open, other.open = cell.open & ~(1 << f), other.open & ~(1 << g)
            cell.glued[f], cell.across[f], other.across[g] = other, (other, g), (cell, f)
        for k, p in enumerate(known):
            p.cells.insert(0, cell)
            p.open = p.open + sum(-1 if glued[f] else 1 for f, face in enumerate(shape.faces) if k in face) & 0xFFFF
        if L:
            L.successor = cell
        self.S = {f: g.successor for f, g in enumerate(cell.glued) if g and g.successor not in (None, cell)}
        self.came.append((cell.slot, *self.cell_place(cell), list(dict.fromkeys(p.number for p in known))))
        self.last, self.recent = cell, [cell] + self.recent[:15]
        self.kept.append((shape, [p.number for p in known + cell.nodes]))
        self.made.append((self.type_of(kind), [self.kept[-1][1][k] for k in shape.order]))
        return cell

    def type_of(self, kind): return SHAPES[kind].type
    def nodes_behind(self, cell, new): pass

    def ends_of(self, cell, new, before):
        """16.6: bits of the corners that end, of a cell that has come."""
        once = [(i, p) for i, p in enumerate(cell.corners) if p not in cell.corners[:i]]
        locals_ = ((i, min(p.valence, 63) | min(p.open, 31) << 6 | cell.kind << 11) for i, p in once)
        return sum(self.ask_end(i, local, new, before) << i for i, local in locals_)

    def ask_end(self, i, local, new, before):
        return self.ask(14, local, i | (i in new) << 5 | (before % 65536) << 6, 32 * local + i)

    def points_that_end(self, cell, ends, new, before):
        return [p for k, p in enumerate(cell.corners) if ends >> k & 1]

    def cell_place(self, cell):
        """16.7: the neighbours of a cell, where values are."""
        def across(a, f): return a.glued[f] if a and f < len(a.glued) else None

        fs = [f for f in range(6) if across(cell, f) and not (f % 2 and across(cell, f - 1))]
        A = [cell.glued[f] for f in fs]
        near, AB = [a.slot for a in A], across(A[0], fs[1]) if len(A) > 1 else None
        more = [AB, across(A[0], fs[2]), across(A[1], fs[2]), across(AB, fs[2])] if len(A) == 3 else []
        if len(A) == 3 and all(more):
            return near + [x.slot for x in more], near, 0
        sums = [[(near[0], 1.0), (near[1], 1.0), (AB.slot, -1.0)]] if len(A) == 2 and AB else []
        if A:
            sums += [[(slot, 1 / len(A)) for slot in near], [(near[0], 1.0)]]
        return sums, near, 8 + 4 * (len(sums) - 1) + len(A) if A else 31

    # --- 16.6: the slow way

    def candidates(self, kind):
        """(origin, rank, cell)"""
        offered = [(0, self.last)] + [(1, s) for s in sorted(self.S.values(), key=lambda s: -s.ordinal)]
        cell, L = self.last_anchor, self.last
        while cell and cell.alive and sum(origin == 6 for origin, _ in offered) < 12:
            offered.append((6, cell))
            cell = cell.successor
        for origin, number in ((2, self.G), (3, self.G + 1)):
            offered += [(origin, cell) for cell in self.points[number].cells[:12]] if number in self.points else []
        if L and L.alive:
            beside = [cell for p in L.corners if p and p.open for cell in p.cells[:24] if cell.open]
            offered += [(4, cell) for cell in sorted(set(beside[:96]), key=lambda x: -x.ordinal)[:24]]
        found, ranks = {}, defaultdict(int)
        for origin, cell in offered + [(5, cell) for cell in self.recent]:
            if cell and cell.alive and cell not in found and self.can_take(cell, kind) and len(found) < 48:
                found[cell] = origin, ranks[origin], cell
                ranks[origin] += 1
        return found.values()

    @staticmethod
    def can_take(cell, kind): return cell.open and cell.shape.dimension == SHAPES[kind].dimension

    def anchor(self, kind):
        ask, L = self.ask, self.last
        if ask(2, 2 * kind, self.choice, L.open + 1 if L and L.alive else 0):
            for origin, rank, cell in self.candidates(kind):
                where, opened = 8 * origin + min(rank, 7), len(cell.open_faces())
                local = origin | min(rank, 7) << 3 | opened << 6 | kind << 9
                if ask(3, local, cell.signature, (64 * self.choice + where) * 64 + cell.open):
                    self.choice = where
                    return cell
        self.choice = 63
        if ask(4, kind, 0, 0):
            around = (cell for cell in self.old_point(self.G).cells if self.can_take(cell, kind))
            return next(cell for i, cell in enumerate(around) if ask(5, min(i, 15), cell.signature, cell.open))
        return None

    def anchor_face(self, cell):
        faces = sorted(cell.open_faces(), key=lambda f: f != self.last_face)
        locals_ = ((f, f | rank << 3 | (f == self.last_face) << 6 | cell.kind << 7) for rank, f in enumerate(faces))
        ask = lambda local: self.ask(6, local, cell.signature, cell.open | self.choice << 8)
        self.last_face = next(f for f, local in locals_ if f == faces[-1] or ask(local))
        return self.last_face

    def turn(self, cell, face, kind):
        row = face | kind << 3 | cell.kind << 8
        if not self.ask(7, row, cell.signature, self.choice):
            bit = lambda node: self.ask(8, row << 6 | node, cell.signature, 64 * self.choice + node)
            self.turns[row] = tree(6, bit)
        return self.turns[row]

    def slow_cell(self, kind):
        anchor, there, turn = self.anchor(kind), None, 0
        if anchor:
            there = anchor, self.anchor_face(anchor)
            turn, self.last_anchor = self.turn(*there, kind), anchor
        cell, new, repeats, pattern, before = self.new_cell(kind, there, turn, self.last)
        ends = self.ends_of(cell, new, before)
        ending, numbers = self.points_that_end(cell, ends, new, before), [p.number for p in cell.corners]
        cell.signature = self.ask.signature
        pattern = (*pattern[:3], ends) if pattern and repeats is None else None
        cell.pattern = self.pattern_id(pattern, cell.signature)
        if self.G not in numbers:
            self.G = self.G + 1 if self.G + 1 in numbers else min(numbers)
        self.end_points(ending)

    def new_cell(self, kind, there, turn, L):
        """A cell at a face of another one: itself, its new corners, those that repeat others, its pattern, and the
        signature before it. `L`: whose corners are expected."""
        shape, anchor, own = SHAPES[kind], there and there[0], 7
        known, new, glued = [None] * shape.corners, [False] * shape.corners, [None] * len(shape.faces)
        if anchor:
            own = self.lay_on(shape, known, glued, there, turn)
            self.edges(kind, known, glued, own, anchor)
        near = anchor if shape.dimension else self.last_anchor
        repeats = self.other_corners(kind, known, new, glued, near.signature if near else 0, L)
        self.rest(shape, known, glued)
        pattern, before = self.make_pattern(kind, known, glued), self.last.signature if self.last else 0
        cell = self.come(kind, known, glued, repeats or {})
        cell.entered = own
        return cell, [k for k in range(shape.corners) if new[k]], repeats, pattern, before

    def rest(self, shape, known, glued):
        for f, cycle in enumerate(shape.faces):
            if glued[f] is None and all(known[k] and known[k].open for k in cycle):
                glued[f] = open_face([known[k] for k in cycle], len(cycle))

    @staticmethod
    def lay_on(shape, known, glued, there, turn):
        """Lays an own face, which it gives, on a face of another cell."""
        own, rotation, way = turn >> 3, turn & 3, -1 if turn >> 2 & 1 else 1
        for k, p in zip(turned(shape.faces[own], rotation, way), there[0].points(there[1])):
            known[k] = p
        glued[own] = there
        return own

    def edges(self, kind, known, glued, own, anchor):
        """Glues faces across the edges of the own one."""
        faces, g = SHAPES[kind].faces, 0
        for i, (u, v) in enumerate(edges_of(faces[own])):
            h, ends = SHAPES[kind].other_face(own, u, v), (known[u], known[v])
            if glued[h]:
                continue
            around, other = ends if ends[0].valence <= ends[1].valence else ends[::-1]
            solids = [x for x in around.cells[:64] if x.shape.dimension == 3]
            cells, found = min(sum(other in x.corners for x in solids), 15), []
            for cell, f in ((cell, f) for cell in solids if cell is not anchor for f in cell.open_faces()):
                laid = self.lay(faces[h], u, v, known, cell.points(f))
                found += [(cell, f, laid)] if laid else []
            for k, (cell, f, laid) in enumerate(found[:8]):
                local = cells | sum(known[j] is not None for j in faces[h]) - 2 << 4 | min(len(found), 3) << 6
                local |= g << 8 | i << 12 | min(k, 3) << 14 | kind << 16
                valence = 16 * (32 * ends[0].valence + ends[1].valence) + cells
                if self.ask(9, local, hash32(anchor.signature, cell.signature), valence):
                    glued[h] = cell, f
                    g |= 1 << i
                    for j, p in laid:
                        known[j] = p
                    break

    @staticmethod
    def lay(cycle, u, v, known, points):
        """Which points the corners of a face are, laid on another at the edge from u to v, if that can be."""
        for way in (1, -1) if len(cycle) == len(points) and known[u] in points else ():
            laid = list(zip(along(cycle, u, v), turned(points, points.index(known[u]), way)))
            if laid[1][1] is known[v] and all(known[j] in (None, p) for j, p in laid):
                return laid
        return None

    def other_corners(self, kind, known, new, glued, signature, L):
        """Sets known and new, and gives which corners repeat new ones, None if none repeats another."""
        ask, shape, repeats, repeated, self.old_corners = self.ask, SHAPES[kind], {}, False, 0
        faces = sum(g is not None for g in glued)
        for k in (k for k in range(shape.corners) if known[k] is None):
            if (any(known) or any(new)) and ask(11, kind, 0, 0):
                of, repeated = self.sequence.raw(3), True
                of = repeats.get(of, of)
                known[k] = known[of]
                if new[of]:
                    repeats[k] = of
                continue
            near = [known[n] for n in shape.near[k] if known[n]]
            v = sum(min(p.valence, 15) << 4 * i for i, p in enumerate(reversed(near))) % 2**32
            new[k] = bool(ask(10, k | len(near) << 3 | faces << 5 | any(new) << 8 | kind << 9, signature, 8 * v + k))
            if not new[k]:
                self.old_corners += 1
                same = L and L.alive and k < len(L.corners) and L.corners[k]
                known[k] = self.near_point(kind, known, near, signature) or self.old_point(same.number if same else self.G)
        return repeats if repeated else None

    def near_point(self, kind, known, near, signature):
        """A point that an edge joins to known neighbours, if one is taken."""
        times = {}
        for q in (q for p in near for cell in p.cells[:48] for q in self.joined_in(cell, p, SHAPES[kind])):
            if q and q not in known and (q in times or len(times) < 24):
                times[q] = times.get(q, 0) + 1
        often = enumerate(sorted(times, key=lambda q: -min(times[q], 255))[:12])
        locals_ = ((i | min(times[q], 7) << 4 | kind << 7, 16 * min(q.valence, 31) + i, q) for i, q in often)
        return next((q for local, valence, q in locals_ if self.ask(12, local, signature, valence)), None)

    def joined_in(self, cell, p, shape):
        """Points that an edge of a cell joins to a point."""
        return [cell.corners[j] for i, q in enumerate(cell.corners) if q is p for j in cell.shape.near[i]]
