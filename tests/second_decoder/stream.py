"""Section 16 of docs/format.md: mode stream, for cells of kinds 0 to 9, in the order of the input, values not mixed."""

from collections import defaultdict

import numpy as np

import values
from codes import DTYPES
from container import Fields, Unread, require
from description import CELLS, POINTS, Array, Mesh, plain
from entropy import Asker, Difference, MixedSequence, Run, bits, hash32

KIND_TYPES = {0: 12, 1: 10, 2: 13, 3: 14, 4: 9, 5: 5, 6: 3, 7: 1, 8: 11, 9: 8}
FACES = {
    0: ["0473", "1265", "0154", "3762", "0321", "4567"],
    1: ["013", "123", "203", "021"],
    2: ["012", "354", "0341", "1452", "2530"],
    3: ["0321", "014", "124", "234", "304"],
    4: ["01", "12", "23", "30"],
    5: ["01", "12", "20"],
    6: ["0", "1"],
    7: [],
}
FACES[8], FACES[9] = FACES[0], FACES[4]
FACES = {kind: [[int(c) for c in face] for face in faces] for kind, faces in FACES.items()}
CORNERS = {0: 8, 1: 4, 2: 6, 3: 5, 4: 4, 5: 3, 6: 2, 7: 1, 8: 8, 9: 4}
DIMENSION = {0: 3, 1: 3, 2: 3, 3: 3, 4: 2, 5: 2, 6: 1, 7: 0, 8: 3, 9: 2}
PARALLELOGRAMS, NEIGHBOURS = {}, {}
for kind_, faces_ in FACES.items():
    around = [set() for _ in range(CORNERS[kind_])]
    cycles = faces_ if DIMENSION[kind_] == 3 else [list(range(4))] if CORNERS[kind_] == 4 else []
    found = [[] for _ in range(CORNERS[kind_])]
    for face in faces_ if DIMENSION[kind_] > 1 else [[0, 1]] if DIMENSION[kind_] else []:
        for a, b in zip(face, face[1:] + face[:1]):
            around[a].add(b)
            around[b].add(a)
    for face in cycles:
        for k, c in enumerate(face):
            if len(face) == 4:
                found[c].append((face[(k + 1) % 4], face[(k - 1) % 4], face[(k + 2) % 4]))
    NEIGHBOURS[kind_] = [sorted(s) for s in around]
    PARALLELOGRAMS[kind_] = found


class Slots:
    """16.3: slots in groups of 16. In the current group they are taken upwards, which is what a file of quads and hexahedra told."""

    def __init__(self):
        self.taken, self.current, self.freed, self.count = set(), None, [], 0
        self.sweep = self.newest = 0

    def free_in(self, group):
        return [s for s in range(16 * group, 16 * group + 16) if s not in self.taken]

    def take(self):
        free = [s for s in self.free_in(self.current) if s > self.newest] if self.current is not None else []
        if not free:
            self.current = self.next_group()
            free = self.free_in(self.current)
        self.newest = free[0]
        self.taken.add(free[0])
        if self.current in self.freed:
            self.freed.remove(self.current)
        return free[0]

    def next_group(self):
        if self.freed:
            return self.freed.pop()
        if self.count * 16 > 2 * len(self.taken) + 4096:
            while not self.free_in(self.sweep % self.count):
                self.sweep += 1
            return self.sweep % self.count
        self.count += 1
        return self.count - 1

    def free(self, slot):
        self.taken.discard(slot)
        group = slot // 16
        if group != self.current and len(self.free_in(group)) == 16:
            self.freed.append(group)


class Point:
    __slots__ = ("slot", "number", "cells", "open", "alive")

    def __init__(self, slot, number):
        self.slot, self.number, self.cells, self.open, self.alive = slot, number, [], 0, True

    @property
    def valence(self):
        return min(len(self.cells), 255)


class StreamCell:
    __slots__ = ("slot", "ordinal", "kind", "corners", "open", "open_at_first", "glued", "pattern", "signature", "successor", "alive")

    def faces(self):
        return FACES[self.kind]

    def points(self, f):
        return [self.corners[c] for c in FACES[self.kind][f]]

    def open_count(self):
        return bin(self.open).count("1")


def c(x, n):
    return min(x, n)


class Connectivity:
    """16.3 to 16.6: what goes on from batch to batch."""

    def __init__(self, mixed):
        self.ask = Asker(mixed)
        self.points, self.cells_made = {}, []  # points in memory by number
        self.point_slots, self.cell_slots, self.ended = Slots(), Slots(), []
        self.last, self.last_kind, self.S = None, 0, {}
        self.G, self.choice, self.last_anchor, self.recent = 0, 0, None, []
        self.turns, self.last_face = defaultdict(int), 0
        self.patterns, self.pattern_ids, self.signatures = [None], {}, {}
        self.outcomes, self.pattern_runs = 0, defaultdict(Run)
        self.old_difference, self.jump = Difference(), Difference()
        self.tracks, self.hits, self.guess_runs, self.which, self.last_hit_e = [2**64 - 1], 0, defaultdict(Run), bits(), False
        self.count_difference, self.last_loose = Difference(), 0

    def batch(self, cells, numbers, records):
        """Gives (kind or type, point numbers) of cells; what 16.7 needs about new points and cells is in `born` and `came`."""
        self.sequence = self.ask.sequence = cells
        self.numbers = numbers
        self.made, self.born, self.came = [], [], []
        for r in range(records):
            self.record()
            if r % 4096 == 4095 or r == records - 1:
                for slot in self.ended:
                    self.point_slots.free(slot)
                self.ended = []
        return self.made

    # --- points

    def new_point(self, number):
        require(number not in self.points, "a point comes twice")
        p = Point(self.point_slots.take(), number)
        self.points[number] = p
        return p

    def end_point(self, p):
        for cell in list(p.cells):
            for f, face in enumerate(cell.faces()):
                if cell.open >> f & 1 and any(cell.corners[k] is p for k in face):
                    cell.open &= ~(1 << f)
                    for k in face:
                        if cell.corners[k] is not None:
                            cell.corners[k].open = cell.corners[k].open - 1 & 0xFFFF
            cell.corners = [None if q is p else q for q in cell.corners]
            if all(q is None for q in cell.corners) and cell.alive:
                cell.alive = False
                self.cell_slots.free(cell.slot)
        p.alive = False
        del self.points[p.number]
        self.ended.append(p.slot)

    def old_point(self, base):
        number = base + self.old_difference.read(self.sequence)
        require(number in self.points, "a point that is not in memory")
        return self.points[number]

    def read_number(self, context, e=None, corner_guess=None):
        """16.4: numbers of new points."""
        first = self.tracks[0] + 1 & 2**64 - 1
        guesses = ([e] if self.last_hit_e and e is not None else []) + [first] + ([e] if e is not None else [])
        guesses += corner_guess or []
        guesses += [t + 1 & 2**64 - 1 for t in self.tracks[1:]] + [self.tracks[0] - 1 & 2**64 - 1]
        guesses += [self.tracks[1] - 1 & 2**64 - 1] if len(self.tracks) > 1 else []
        guesses = list(dict.fromkeys(guesses))
        s = 0 if e is None else 1 if e == first else 2 if e > first else 3
        for i, guess in enumerate(guesses):
            model = self.guess_runs[(((context * 4 + s) * 16 + self.hits) * 2 + (guesses[0] == e and self.last_hit_e)) * 14 + i]
            if model.read(self.numbers):
                self.hits = (4 * self.hits + c(i, 2)) % 16
                self.last_hit_e = guess == e
                self.to_front(guess)
                return guess
        self.hits = (4 * self.hits + 3) % 16
        t = self.numbers.tree(self.which, 3)
        require(t < len(self.tracks), "a track that is not there")
        number = self.tracks[t] + self.jump.read(self.numbers) & 2**64 - 1
        self.tracks = [number] + self.tracks[:7]
        return number

    def to_front(self, number):
        for k, t in enumerate(self.tracks):
            if number in (t + 1 & 2**64 - 1, t - 1 & 2**64 - 1):
                break
        else:
            k = len(self.tracks) if len(self.tracks) < 8 else 7
        self.tracks = [number] + self.tracks[:k] + self.tracks[k + 1 :]

    # --- records

    def record(self):
        pattern = self.pattern_by_flags()
        if pattern is not None:
            self.cell_by_pattern(*pattern)
            return
        ask = self.ask
        ask.signature = 0
        kind = self.last_kind
        if not ask(0, kind, 0, 0):
            node = 1
            for _ in range(5):
                node = 2 * node + ask(1, 32 * self.last_kind + node, 0, 0)
            kind = node - 32
        self.last_kind = kind
        if kind == 18:
            p = self.new_point(self.read_number(32))
            self.born.append((p.number, p.slot, [], [], 31))
            self.end_point(p)
        elif kind == 20:
            p = self.old_point(self.G)
            self.G = p.number
            self.end_point(p)
        elif kind == 19:
            self.loose_cell()
        else:
            if kind not in FACES:
                raise Unread("nodes behind corners, and cells given by faces")
            self.slow_cell(kind)

    def loose_cell(self):
        type_ = self.sequence.raw(8)
        n = self.count_difference.read(self.sequence)
        require(0 <= n <= 1 << 24, "a loose cell of too many points")
        points = []
        for _ in range(n):
            if self.ask(10, 131072, 0, 0):
                p = self.new_point(self.read_number(63))
                self.born.append((p.number, p.slot, [], [], 31))
            else:
                p = self.old_point(self.last_loose)
            self.last_loose = p.number
            points.append(p)
        self.made.append((type_, [p.number for p in points]))
        self.came.append((None, [], [], 31))
        for p in points:
            if self.ask(14, 2097152, 0, 0) and p.alive:
                self.end_point(p)

    # --- patterns (16.5)

    def sources(self):
        return {0: self.last} | {1 + f: s for f, s in self.S.items() if s.alive}

    def apply(self, pattern):
        """Corners (None: new) and what faces are glued to, or nothing."""
        kind, corners, faces, _ = pattern
        sources, known = self.sources(), [None] * len(corners)
        glued = [None] * len(faces)
        for k, what in enumerate(corners):
            if isinstance(what, tuple):
                cell = sources.get(what[0])
                if cell is None or what[1] >= len(cell.corners) or cell.corners[what[1]] is None:
                    return None
                known[k] = cell.corners[what[1]]
        for f, what in enumerate(faces):
            if isinstance(what, tuple):
                cell = sources.get(what[0])
                if cell is None or not cell.open >> what[1] & 1:
                    return None
                glued[f] = cell, what[1]
        for f, what in enumerate(faces):
            if what != "found":
                continue
            cycle = FACES[kind][f]
            there = [known[k] for k in cycle if known[k] is not None]
            if len(there) < len(cycle) - 1:
                return None
            hit = self.open_face_with(there, len(cycle), there[0] if there else None)
            if hit is None:
                return None
            glued[f] = hit
            missing = [k for k in cycle if known[k] is None]
            if missing:
                rest = [p for p in hit[0].points(hit[1]) if all(p is not q for q in there)]
                if not rest:
                    return None
                known[missing[0]] = rest[0]
        if any(p is None and what != "new" for p, what in zip(known, corners)):
            return None
        return known, glued

    def open_face_with(self, there, size, around):
        if around is None:
            return None
        for cell in around.cells[:64]:
            for f, face in enumerate(cell.faces()):
                if cell.open >> f & 1 and len(face) == size:
                    points = cell.points(f)
                    if all(any(q is p for q in points) for p in there):
                        return cell, f
        return None

    def pattern_by_flags(self):
        if self.last is None:
            return None
        S = sorted({id(s): s for s in self.S.values() if s.alive}.values(), key=lambda s: s.ordinal)
        three = [S[-1].pattern if S else 0, S[0].pattern if S else 0, self.last.pattern]
        a = (three[0] == three[1]) + 2 * (three[0] == three[2])
        seen = set()
        for r, id_ in enumerate(three):
            if not id_ or id_ in seen:
                continue
            seen.add(id_)
            applied = self.apply(self.patterns[id_])
            if applied is None:
                continue
            taken = self.pattern_runs[((id_ % 512) * 3 + r) * 16 + 4 * a + self.outcomes].read(self.sequence)
            self.outcomes = (2 * self.outcomes + taken) % 4
            if taken:
                return (id_,) + applied
        return None

    def cell_by_pattern(self, id_, known, glued):
        kind, corners, faces, ends = self.patterns[id_]
        self.last_kind = kind
        own = id_
        sources = self.sources()
        if any(what == "found" and any(glued[f][0] is s for s in sources.values()) for f, what in enumerate(faces)):
            own = self.pattern_id(self.make_pattern(kind, known, glued, ends), self.signatures[id_]) or id_
        signature = self.signatures[id_]
        cell = self.come(kind, known, glued, signature)
        cell.pattern = own
        ending = [cell.corners[k] for k in range(len(corners)) if ends >> k & 1]
        for p in ending:
            if p is not None and p.alive:
                self.end_point(p)

    def make_pattern(self, kind, known, glued, ends):
        """Of corners (None: new) and glued faces, before the cell has come."""
        sources, corners, faces = self.sources(), [], []
        for p in known:
            what = "new" if p is None else "found"
            if p is not None:
                for s in sorted(sources):
                    at = [k for k, q in enumerate(sources[s].corners) if q is p]
                    if at:
                        what = s, at[0]
                        break
            corners.append(what)
        for g in glued:
            what = None
            if g is not None:
                what = next(((s, g[1]) for s in sorted(sources) if sources[s] is g[0]), "found")
            faces.append(what)
        pattern = kind, tuple(corners), tuple(faces), ends
        applied = self.apply(pattern)
        if applied is None or any(a is not b for a, b in zip(applied[0], known)):
            return 0
        return pattern

    def pattern_id(self, pattern, signature):
        if not pattern:
            return 0
        if pattern not in self.pattern_ids:
            if len(self.patterns) > 65535:
                return 0
            self.pattern_ids[pattern] = len(self.patterns)
            self.patterns.append(pattern)
            self.signatures[len(self.patterns) - 1] = signature
        return self.pattern_ids[pattern]

    # --- a cell comes

    def behind(self, k, n, kind, known, glued):
        for f, g in enumerate(glued):
            face = FACES[kind][f]
            if g is None or n not in face or k in face:
                continue
            cell, gf = g
            at = next((i for i, q in enumerate(cell.corners) if q is known[n]), None)
            if at is None:
                return None
            on = FACES[cell.kind][gf]
            return next((cell.corners[i] for i in NEIGHBOURS[cell.kind][at] if i not in on), None)
        return None

    def place_of(self, k, kind, known, glued, several):
        """16.7: sums, near points and situation of a new corner."""
        near = [n for n in NEIGHBOURS[kind][k] if known[n] is not None]
        whole = [abd for abd in PARALLELOGRAMS[kind][k] if all(known[i] is not None for i in abd)]
        if kind in (0, 8) and all(known[i] is not None for i in range(8) if i != k):
            A = NEIGHBOURS[kind][k]
            D = [abd[2] for abd in PARALLELOGRAMS[kind][k]]
            G = next(i for i in range(8) if i != k and i not in A and i not in D)
            return [known[i].slot for i in A + D + [G]], [known[i].slot for i in near], k
        sums = []
        if whole:
            w = 1 / len(whole[:2])
            sums.append([(known[i].slot, s * w) for abd in whole[:2] for i, s in zip(abd, (1, 1, -1))])
        pairs = []
        if several or not PARALLELOGRAMS[kind][k]:
            for n in near:
                b = self.behind(k, n, kind, known, glued)
                if b is not None:
                    pairs.append((known[n].slot, b.slot))
        if pairs:
            w = 1 / len(pairs)
            sums.append([x for n, b in pairs for x in ((n, 2 * w), (b, -w))])
        if near:
            sums.append([(known[n].slot, 1 / len(near)) for n in near])
        return sums, [known[n].slot for n in near[:3]], 8 + 4 * len(whole) + len(near[:3])

    def come(self, kind, known, glued, signature):
        known = list(known)
        new = [k for k, p in enumerate(known) if p is None]
        for k in new:
            e, guesses = None, []
            for abd in PARALLELOGRAMS[kind][k]:
                if all(known[i] is not None for i in abd):
                    a, b, d = (known[i].number for i in abd)
                    e = a + b - d & 2**64 - 1
                    break
            L = self.last
            if L is not None and L.alive and L.kind == kind and L.corners[k] is not None:
                for n in NEIGHBOURS[kind][k]:
                    if known[n] is not None and L.corners[n] is not None and len(guesses) < 3:
                        guesses.append(known[n].number + L.corners[k].number - L.corners[n].number & 2**64 - 1)
            place = self.place_of(k, kind, known, glued, len(new) > 1)
            p = self.new_point(self.read_number(k + 8 * (len(new) > 1), e, guesses))
            known[k] = p
            self.born.append((p.number, p.slot) + place)
        cell = StreamCell()
        cell.kind, cell.corners, cell.signature = kind, known, signature
        cell.slot, cell.alive, cell.successor, cell.pattern = self.cell_slots.take(), True, None, 0
        cell.ordinal = self.last.ordinal + 1 if self.last else 0
        faces = FACES[kind]
        cell.open, cell.glued = (1 << len(faces)) - 1, [None] * len(faces)
        for f, g in enumerate(glued):
            if g is not None:
                cell.open &= ~(1 << f)
                g[0].open &= ~(1 << g[1])
                cell.glued[f] = g[0]
        cell.open_at_first = cell.open
        for k, p in enumerate(known):
            p.cells.insert(0, cell)
            for f, face in enumerate(faces):
                if k in face:
                    p.open = p.open + (1 if glued[f] is None else -1) & 0xFFFF
        if self.last is not None:
            self.last.successor = cell
        self.S = {}
        for f, g in enumerate(cell.glued):
            if g is not None and g.successor is not None and g.successor is not cell:
                self.S[f] = g.successor
        self.came.append((cell.slot,) + self.cell_place(cell))
        self.last = cell
        self.recent = ([cell] + self.recent)[:16]
        self.made.append((KIND_TYPES[kind], [p.number for p in known]))
        return cell

    def cell_place(self, cell):
        """16.7: the neighbours of a cell, where values are."""
        pairs = [next((f for f in (2 * k, 2 * k + 1) if f < len(cell.glued) and cell.glued[f] is not None), None) for k in range(3)]
        fs = [f for f in pairs if f is not None]
        A = [cell.glued[f] for f in fs]

        def across(a, f):
            return a.glued[f] if a is not None and f < len(a.glued) else None

        if len(A) == 3:
            AB, AC, BC = across(A[0], fs[1]), across(A[0], fs[2]), across(A[1], fs[2])
            ABC = across(AB, fs[2])
            if None not in (AB, AC, BC, ABC):
                return [x.slot for x in A + [AB, AC, BC, ABC]], [x.slot for x in A], 0
        sums = []
        if len(A) == 2 and across(A[0], fs[1]) is not None:
            sums.append([(A[0].slot, 1.0), (A[1].slot, 1.0), (across(A[0], fs[1]).slot, -1.0)])
        if A:
            sums.append([(a.slot, 1 / len(A)) for a in A])
            sums.append([(A[0].slot, 1.0)])
        return sums, [a.slot for a in A], 8 + 4 * (len(sums) - 1) + len(A) if A else 31

    # --- 16.6: the slow way

    def candidates(self, kind):
        found, seen, ranks = [], set(), defaultdict(int)

        def offer(origin, cell):
            if cell is None or not cell.alive or id(cell) in seen or not cell.open or DIMENSION[cell.kind] != DIMENSION[kind] or len(found) == 48:
                return
            seen.add(id(cell))
            found.append((origin, ranks[origin], cell))
            ranks[origin] += 1

        offer(0, self.last)
        for s in sorted(self.S.values(), key=lambda s: -s.ordinal):
            offer(1, s)
        cell = self.last_anchor
        for _ in range(12):
            if cell is None or not cell.alive:
                break
            offer(6, cell)
            cell = cell.successor
        for origin, number in ((2, self.G), (3, self.G + 1)):
            if number in self.points:
                for cell in self.points[number].cells[:12]:
                    offer(origin, cell)
        if self.last is not None and self.last.alive:
            beside = []
            for p in self.last.corners:
                if p is not None and p.open:
                    beside += [cell for cell in p.cells[:24] if cell.open]
            beside = sorted({id(x): x for x in beside[:96]}.values(), key=lambda x: -x.ordinal)
            for cell in beside[:24]:
                offer(4, cell)
        for cell in self.recent:
            offer(5, cell)
        return found

    def anchor(self, kind):
        ask, L = self.ask, self.last
        candidates = self.candidates(kind)
        if ask(2, 2 * kind, self.choice, 0 if L is None or not L.alive else L.open + 1):
            for origin, rank, cell in candidates:
                where = 8 * origin + c(rank, 7)
                if ask(3, origin | c(rank, 7) << 3 | cell.open_count() << 6 | kind << 9, cell.signature, (64 * self.choice + where) * 64 + cell.open):
                    self.choice = where
                    return cell
            require(False, "no anchor")
        self.choice = 63
        if not ask(4, kind, 0, 0):
            return None
        i = 0
        for cell in self.old_point(self.G).cells:
            if cell.open and DIMENSION[cell.kind] == DIMENSION[kind]:
                if ask(5, c(i, 15), cell.signature, cell.open):
                    return cell
                i += 1
        require(False, "no anchor")

    def anchor_face(self, cell, kind):
        faces = [f for f in range(len(cell.faces())) if cell.open >> f & 1]
        if self.last_face in faces:
            faces = [self.last_face] + [f for f in faces if f != self.last_face]
        for rank, f in enumerate(faces):
            if rank == len(faces) - 1:
                break
            if self.ask(6, f | rank << 3 | (f == self.last_face) << 6 | cell.kind << 7, cell.signature, cell.open | self.choice << 8):
                break
        self.last_face = f
        return f

    def turn(self, cell, face, kind):
        row = face | kind << 3 | cell.kind << 8
        key = cell.kind, face, kind
        if self.ask(7, row, cell.signature, self.choice):
            return self.turns[key]
        node = 1
        for _ in range(6):
            node = 2 * node + self.ask(8, row << 6 | node, cell.signature, 64 * self.choice + node)
        self.turns[key] = node - 64
        return node - 64

    def slow_cell(self, kind):
        known, new, glued = [None] * CORNERS[kind], [False] * CORNERS[kind], [None] * len(FACES[kind])
        anchor = self.anchor(kind) if DIMENSION[kind] else None
        if anchor is not None:
            face = self.anchor_face(anchor, kind)
            turn = self.turn(anchor, face, kind)
            own, mirrored, rotation = turn >> 3, turn >> 2 & 1, turn & 3
            require(own < len(FACES[kind]), "a turn that does not exist")
            cycle = FACES[kind][own]
            require(len(cycle) == len(anchor.faces()[face]) and rotation < len(cycle), "a turn that does not exist")
            for i, p in enumerate(anchor.points(face)):
                known[cycle[(rotation - i if mirrored else rotation + i) % len(cycle)]] = p
            glued[own] = anchor, face
            if DIMENSION[kind] == 3:
                self.edges(kind, known, glued, own, anchor)
        self.last_anchor = anchor if anchor is not None else self.last_anchor
        if DIMENSION[kind] == 2:
            self.on_solid(kind, known, glued, anchor)
        for k in range(CORNERS[kind]):
            if known[k] is None:
                self.other_corner(k, kind, known, new, glued, anchor)
        for f, cycle in enumerate(FACES[kind]):
            if glued[f] is None and all(known[k] is not None and known[k].open for k in cycle):
                hit = self.open_face_of([known[k] for k in cycle])
                if hit is not None:
                    glued[f] = hit
        pattern = self.make_pattern(kind, known, glued, 0)
        signature, before = self.ask.signature, self.last.signature if self.last else 0
        cell = self.come(kind, known, glued, signature)
        ends, ending = 0, []
        for i, p in enumerate(cell.corners):
            if any(q is p for q in cell.corners[:i]):
                continue
            local = c(p.valence, 63) | c(p.open, 31) << 6 | kind << 11
            if self.ask(14, local, i | new[i] << 5 | (before % 65536) << 6, 32 * local + i):
                ends |= 1 << i
                ending.append(p)
        cell.signature = self.ask.signature
        if pattern:
            cell.pattern = self.pattern_id(pattern[:3] + (ends,), cell.signature)
        numbers = [p.number for p in cell.corners]
        if self.G not in numbers:
            self.G = self.G + 1 if self.G + 1 in numbers else min(numbers)
        for p in ending:
            self.end_point(p)

    def on_solid(self, kind, known, glued, anchor):
        """Polygons on an open face of a solid."""
        if anchor is None:
            return
        own = next(f for f, g in enumerate(glued) if g is not None)
        a, b = (known[k] for k in FACES[kind][own])
        n, i = CORNERS[kind], 0
        for cell in a.cells:
            if DIMENSION[cell.kind] != 3:
                continue
            for f, face in enumerate(cell.faces()):
                points = cell.points(f)
                if not cell.open >> f & 1 or len(points) != n or not any(p is b for p in points) or not any(p is a for p in points):
                    continue
                if all(any(p is q for q in anchor.corners) for p in points) or i == 9:
                    continue
                if self.ask(13, c(i, 3), cell.signature, 0):
                    at = next(k for k, p in enumerate(points) if p is a)
                    step = 1 if points[(at + 1) % n] is b else -1
                    first = FACES[kind][own][0]
                    for k in range(n):
                        known[(first + k) % n] = points[(at + step * k) % n]
                    return
                i += 1

    def open_face_of(self, points):
        for cell in points[0].cells[:64]:
            for f, face in enumerate(cell.faces()):
                if cell.open >> f & 1 and len(face) == len(points) and {id(p) for p in cell.points(f)} == {id(p) for p in points}:
                    return cell, f
        return None

    def edges(self, kind, known, glued, own, anchor):
        cycle, g = FACES[kind][own], 0
        for i in range(len(cycle)):
            u, v = cycle[i], cycle[(i + 1) % len(cycle)]
            h = next(f for f, face in enumerate(FACES[kind]) if f != own and u in face and v in face)
            if glued[h] is not None:
                continue
            ends = known[u], known[v]
            around, other = ends if ends[0].valence <= ends[1].valence else ends[::-1]
            cells = c(sum(any(p is other for p in cell.corners) for cell in around.cells[:64]), 15)
            found = []
            for cell in around.cells[:64]:
                if cell is anchor or DIMENSION[cell.kind] != 3 or not cell.open:
                    continue
                for f, face in enumerate(cell.faces()):
                    if cell.open >> f & 1 and len(face) == len(FACES[kind][h]) and len(found) < 8:
                        laid = self.lay(kind, h, u, v, known, cell.points(f))
                        if laid:
                            found.append((cell, f, laid))
            for k, (cell, f, laid) in enumerate(found):
                there = sum(known[j] is not None for j in FACES[kind][h])
                local = cells | there - 2 << 4 | c(len(found), 3) << 6 | g << 8 | i << 12 | c(k, 3) << 14 | kind << 16
                if self.ask(9, local, hash32(anchor.signature, cell.signature), 16 * (32 * ends[0].valence + ends[1].valence) + cells):
                    glued[h] = cell, f
                    g |= 1 << i
                    for j, p in laid:
                        known[j] = p
                    break

    @staticmethod
    def lay(kind, h, u, v, known, points):
        """Which points the corners of h are, laid on a face at the edge from u to v; nothing if that cannot be."""
        cycle, n = FACES[kind][h], len(points)
        at = next((k for k, p in enumerate(points) if p is known[u]), None)
        if at is None:
            return None
        for step in (1, -1):
            if points[(at + step) % n] is known[v]:
                start = cycle.index(u)
                way = 1 if cycle[(start + 1) % n] == v else -1
                laid = [(cycle[(start + way * k) % n], points[(at + step * k) % n]) for k in range(n)]
                if all(known[j] is None or known[j] is p for j, p in laid):
                    return laid
        return None

    def other_corner(self, k, kind, known, new, glued, anchor):
        ask = self.ask
        if any(p is not None for p in known) or any(new):
            if ask(11, kind, 0, 0):
                raise Unread("cells that have a corner twice")
        near = [n for n in NEIGHBOURS[kind][k] if known[n] is not None]
        v = 0
        for n in near:
            v = v << 4 | c(known[n].valence, 15)
        signature = anchor.signature if anchor is not None else 0
        faces = sum(g is not None for g in glued)
        v &= 0xFFFFFFFF
        if ask(10, k | len(near) << 3 | faces << 5 | any(new) << 8 | kind << 9, signature, 8 * v + k):
            new[k] = True
            return
        times = {}
        for n in near:
            for cell in known[n].cells[:48]:
                for i, p in enumerate(cell.corners):
                    if p is known[n]:
                        for j in NEIGHBOURS[cell.kind][i]:
                            q = cell.corners[j]
                            if q is not None and not any(q is x for x in known) and (id(q) in times or len(times) < 24):
                                times.setdefault(id(q), [q, 0])[1] += 1
        ordered = sorted(times.values(), key=lambda x: -min(x[1], 255))[:12]
        for i, (q, n) in enumerate(ordered):
            if ask(12, i | c(n, 7) << 4 | kind << 7, signature, 16 * c(q.valence, 31) + i):
                known[k] = q
                return
        L = self.last
        same = L is not None and L.alive and k < len(L.corners) and L.corners[k] is not None
        known[k] = self.old_point(L.corners[k].number if same else self.G)


# --- description and tail


class StreamDescription:
    """16.1."""

    def __init__(self, stream):
        fields = Fields(stream)
        size = fields.count()
        self.table_fields = Fields(plain(Fields(fields.section()), size)) if size else Fields(b"")
        fields = Fields(plain(fields))
        self.effort = fields.count(9)
        self.any_order, self.order_apart, self.mixed, self.mixed_values, self.gated = (fields.u8() for _ in range(5))
        self.positions = Array(fields, True)
        self.arrays = fields.list(lambda: Array(fields, True))
        self.mesh_arrays = fields.list(lambda: self.mesh_array(fields))
        self.metadata = fields.list(lambda: (fields.text(), fields.text()))
        self.provenance = fields.text()
        every = [self.positions] + self.arrays
        lists = fields.count()
        require(lists == len(every), "maps of other arrays")
        self.maps = []
        for a in every:
            require(fields.count() == a.components, "maps of other components")
            self.maps.append([values.stream_map(fields, a.type, self.table_fields) for _ in range(a.components)])
        self.allowed = fields.list(fields.f64)
        self.numbered = []
        if self.order_apart & 2:
            self.numbered = fields.list(lambda: (fields.count(), fields.list(lambda: (fields.count(), fields.count()))))
        fields.end()

    @staticmethod
    def mesh_array(fields):
        name, type_, components = fields.text(), fields.u8(), fields.count()
        role, labels, data = fields.u8(), fields.list(fields.text), fields.section()
        return name, type_, components, role, labels, data


def decode(container):
    d = StreamDescription(container.stream("DESC"))
    if container.required or d.any_order or d.gated or d.mixed_values:
        raise Unread("volumes in pieces, in another order, at gates, or with mixed values")
    walk = Connectivity(d.mixed)
    arrays = [d.positions] + d.arrays
    coders = [values.Values(a, m) for a, m in zip(arrays, d.maps)]
    cells, batch = [], 0
    point_rows = [{} for _ in arrays]
    while container.has("CELL", batch):
        fields = Fields(container.stream("CELL", batch))
        head = Fields(fields.section())
        records, n_cells, n_points, size = (head.count() for _ in range(4))
        head.list(lambda: (head.count(), head.text(), head.u8()))
        head.end()
        sequence, numbers = MixedSequence(fields.take(size)), MixedSequence(fields.rest())
        made = walk.batch(sequence, numbers, records)
        sequence.end()
        numbers.end()
        require(len(made) == n_cells and len(walk.born) == n_points, "other cells or points than announced")
        cells += made
        for i, (array, coder) in enumerate(zip(arrays, coders)):
            of_points = array.domain == 0
            key = ("POSI", batch) if i == 0 else ("ARRY", batch, i - 1)
            elements = [(slot, sums, near, situation) for _, slot, sums, near, situation in walk.born] if of_points else walk.came
            if not elements:
                continue
            tuples = coder.batch(container.stream(*key), elements)
            if of_points:
                for (number, *_), row in zip(walk.born, tuples):
                    point_rows[i][number] = row
            else:
                point_rows[i].update({len(point_rows[i]) + k: row for k, row in enumerate(tuples)})
        batch += 1
    made_values = []
    for array, by_number in zip(arrays, point_rows):
        made_values.append(values.as_rows([by_number[k] for k in range(len(by_number))], array.dtype, array.components))
    for place, runs in d.numbered:
        numbers = [first + k for n, first in runs for k in range(n)]
        require(len(numbers) == len(made_values[place + 1]), "numbers of other elements")
        made_values[place + 1] = np.array(numbers).astype(arrays[place + 1].dtype).reshape(-1, 1)
    mesh = Mesh(d, [cells], made_values)
    for a in mesh.arrays[1:]:
        a.domain = POINTS if a.domain == 0 else CELLS
    return mesh
