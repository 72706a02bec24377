"""Sections 12.1, 12.2 and 12.5 of docs/format.md: connectivity as fans that grow rings of triangles."""
from copy import copy
from around import LATE0, LATE2, Element
from container import Fields, unzigzag
from description import MIXED, NODES
from entropy import CodedSequence, StaticSymbols, tables

NAMES = "close pocket swallow border split known merge open_fan".split()
CLOSE, POCKET, SWALLOW, BORDER, SPLIT, KNOWN, MERGE, OPEN = NAMES

def triangle_symbols():
    table = [(CLOSE, i) for i in range(4)] + [(POCKET, i) for i in range(4)] + [(CLOSE, i) for i in range(4, 12)]
    table += [(SWALLOW, 0)] + [(BORDER, i) for i in range(4)] + [(SPLIT, i) for i in range(6)]
    return [(name, 1, i * [1], 1) for name, i in table + [(KNOWN, 0), (MERGE, 0), (OPEN, 1), (OPEN, 4)]]

def polygon_symbols():
    """(name, t, spokes of the fan, spoke of the triangle behind it)"""
    def some(name, texts, t=1, behind=False):
        spokes = [[int(c) for c in s] for s in texts.split()]
        return [(name, t, s[:-1], s[-1]) if behind else (name, t, s, None) for s in spokes]

    def zero(spoke):
        return [(name, 1, [], spoke) for name in (POCKET, SWALLOW, SPLIT, MERGE, KNOWN)]

    table = [(CLOSE, 1, [], None)] + zero(0) + some(OPEN, "0") + zero(1) + some(OPEN, "1")
    table += [(POCKET, t, [], 0) for t in (None, 2, 3)] + [(BORDER, 1, [], None)] + some(OPEN, "0000")
    table += some(CLOSE, "0 1 00 10 01 11 000 010 110 101 011 111 0000 1010 0110 0101 1111 01010 101010 0101010")
    table += some(CLOSE, "10101010")
    table += some(POCKET, "00 10 01 11 000 010 110 111 0000 1010 0110 0101", behind=True)
    table += some(POCKET, "00 000", 2, True) + some(POCKET, "00", 3, True)
    return table + some(BORDER, "1 01 11 101") + some(SPLIT, "00 10 01 11 010", behind=True)

SYMBOLS = {1: triangle_symbols(), 2: polygon_symbols()}

class Entry:
    """A vertex of a ring, None for markers of borders."""

    def __init__(self, vertex, across, seen):
        self.vertex, self.across, self.seen, self.marker = vertex, across, seen, vertex is None

    def see(self, n):
        self.seen = min(self.seen + n, 15)

class Walk:
    """12.2. Afterwards `faces` are lists of vertices, `births` the element (12.3) of each vertex."""

    def __init__(self, topo, triangles, events, event_tables, number_tables):
        self.topo, self.events, self.number_tables = topo, events, number_tables
        self.ring, self.waiting, self.faces, self.across_at_begin, self.births = [], [], [], [], []
        self.open = self.last_old = self.done = 0
        while self.done < triangles:
            if self.prepare():
                name, t, spokes, spoke = SYMBOLS[topo][events.symbol(0, event_tables[self.context()])]
                getattr(self, name)(t, spokes, spoke)
            else:
                self.component()

    def number(self, n): return self.events.number(self.number_tables[n])

    # --- the ring, from focus to newest

    def prepare(self):
        """Whether there is a ring, its first and last entry no markers."""
        while not self.open and (self.ring or self.waiting):
            ring = self.ring
            if len(ring) < 2 or len(ring) == 2 and not ring[0].marker and not ring[1].marker:
                self.ring = self.waiting.pop() if self.waiting else []
            elif not ring[0].marker and not ring[-1].marker:
                return True
            else:
                if not ring[-1 if ring[0].marker else 1].marker:
                    ring.append(copy(ring[0]))
                ring.pop(0)
        return self.open > 0

    def context(self):
        def kind(place):
            seen = ring[place].seen
            return max(min(seen, 4) - 1, 0) if self.topo == 1 else min(seen, 3)

        ring, long = self.ring, len(self.ring) >= (4 if self.topo == 1 else 5)
        seen, far = (kind(1), kind(-1)), (kind(2), kind(-2)) if long else (0, 0)
        row = min(ring[0].seen, 10) - 1 if self.topo == 1 else 8 * self.open + min(ring[0].seen, 7)
        if self.topo == 2 and long and seen[0] == 2 and far[0] == 2:
            return 6144 + 64 * row + 16 * seen[1] + 4 * far[1] + kind(3)
        return 256 * row + 64 * seen[0] + 16 * seen[1] + 4 * far[0] + far[1]

    # --- triangles and faces

    def begin_face(self, corners, across):
        self.face = list(corners)
        self.across_at_begin.append(across)

    def end_face(self):
        self.faces.append(self.face)
        self.open = 0

    def triangle(self, w, spoke):
        """(focus, newest, w); gives the vertex that was the newest."""
        f, p = self.ring[0], self.ring[-1]
        if not self.open:
            self.begin_face([f.vertex, p.vertex], p.across)
            p.see(1)
        self.face.append(w)
        self.done += 1
        self.open = min(self.open + 1, 2)
        if spoke:
            self.end_face()
            f.see(1)
        p.across = self.face[0] if len(self.face) == 3 else self.face[-3]  # of the next edge
        return p.vertex

    def new_vertex(self, birth):
        self.births.append(birth)
        return len(self.births) - 1

    def old(self):
        self.last_old = self.last_old + unzigzag(self.number(6)) & 0xFFFFFFFF
        return self.last_old

    def component(self):
        known, corners = self.number(0), []
        for k in range(3):
            alone = Element(corners[-1] if corners else max(len(self.births) - 1, 0))
            corners.append(self.old() if known >> k & 1 else self.new_vertex(alone))
        self.ring = [Entry(v, corners[k - 1], 1) for k, v in enumerate(corners)]
        self.begin_face(corners, corners[2])
        self.done, self.open = self.done + 1, 1
        if not known & 8:
            self.end_face()

    def fan(self, name, spokes, target=None):
        f, n, i = self.ring[0], self.ring[1], len(spokes)
        for j, spoke in enumerate(spokes, 1):
            p, place = self.ring[-1], 9 + min(j, 3)
            if name in (CLOSE, POCKET):
                place = i * (i - 1) // 2 + j - 1 if i < 4 else 9 if j == i else 5 + min(j, 3)
            next_, beyond = {CLOSE: (n.vertex, f.across), POCKET: (target, n.vertex)}.get(name, (None, None))
            v = self.new_vertex(Element(f.vertex, p.vertex, p.across, next_, beyond, place=place))
            self.ring.append(Entry(v, self.triangle(v, spoke), 1))

    def late(self, next_, beyond):
        p = self.ring[-1].vertex
        if p == len(self.births) - 1 and beyond != p:
            self.births[p].refs[LATE0 : LATE2 + 1] = self.ring[0].vertex, next_, beyond
            self.births[p].late = True

    def close(self, t, spokes, _):
        n = self.ring[1]
        if not spokes:
            self.late(n.vertex, self.ring[0].across)
        self.fan(CLOSE, spokes)
        self.triangle(n.vertex, 1)
        self.ring.pop(0)
        n.see(1)

    def pocket(self, t, spokes, spoke):
        t = self.number(7) if t is None else t
        between = [entry.vertex for entry in self.ring[1 : t + 2]]
        m, n = between[-1], between[0]
        if not spokes:
            self.late(m, n)
        self.fan(POCKET, spokes, m)
        f = self.ring[0].vertex
        p = self.triangle(m, spoke)
        if spoke:
            self.begin_face([f, m], p)
        self.face += between[-2::-1]  # with a spoke n alone
        self.done += t
        self.end_face()
        del self.ring[: t + 1]
        self.ring[0].see(2 if spoke else 1)

    def swallow(self, t, spokes, spoke):
        q = self.ring[-2]
        p = self.triangle(q.vertex, spoke)
        self.ring.pop()
        q.across = p
        q.see(1)

    def border(self, t, spokes, _):
        self.fan(BORDER, spokes)
        if not self.ring[1].marker:
            self.ring += [Entry(None, None, 0), copy(self.ring[0])]
        self.ring.pop(0)

    def split(self, t, spokes, spoke):
        self.fan(SPLIT, spokes)
        ahead = self.number(1) == 0
        k = self.number(2 if ahead else 3)
        j = 2 + k if ahead else len(self.ring) - 2 - k
        m = self.ring[j]
        p = self.triangle(m.vertex, spoke)
        m.see(1)
        parts = self.ring[:j] + [Entry(m.vertex, p, m.seen)], self.ring[j:]
        self.ring, waits = parts if ahead or not spoke else parts[::-1]
        self.waiting.append(waits)

    def known(self, t, spokes, spoke):
        v = self.old()
        self.ring.append(Entry(v, self.triangle(v, spoke), 1))

    def merge(self, t, spokes, spoke):
        r, m = self.number(4), self.number(5)
        other = self.waiting.pop(-1 - r)
        entry = other[m]
        p = self.triangle(entry.vertex, spoke)
        entry.see(1)
        self.ring += other[m:] + other[:m] + [Entry(entry.vertex, p, entry.seen)]

    def open_fan(self, t, spokes, _):
        self.fan(OPEN, spokes)

def runs(section, n):
    """12.1: n numbers."""
    if not section:
        return [0] * n
    sequence, numbers, value = CodedSequence(section), [], 0
    while len(numbers) < n:
        value = sequence.count("value", min(value, 3))
        numbers += [value] * (sequence.count("length", min(value, 3)) + 1)
    return numbers

def loose_cells(section, blocks, left):
    """12.5: the cells that faces leave over, by block, as (type, points)."""
    sequence, type_, last, cells = CodedSequence(section), 1, 0, []
    for block, n in zip(blocks, left):
        cells.append([])
        for _ in range(n):
            own, nodes = block.type, []
            if own == MIXED:
                type_ = own = type_ if sequence.bit("same type") else sequence.count("type") % 256
            for k in range(NODES[own] or sequence.count("size")):
                j = min(k, 7)
                if k and sequence.bit("repeat", j):
                    nodes.append(nodes[-1 - sequence.count("which")])
                else:
                    last = last + unzigzag(sequence.count("step", j)) & 0xFFFFFFFF
                    nodes.append(last)
            cells[-1].append((own, nodes))
    return cells

def fan_tables(sequence, topo):
    return tables(sequence, *((2560, 32, 32, 9) if topo == 1 else (7680, 64, 32, 9))), tables(sequence, 8, 41, 8, 9)

class Fans:
    """TOPO 1, 2 and (with the tables of a set) 3: faces, blocks and loose cells."""

    def __init__(self, topo, data, points, corners, blocks, shared=None):
        fields = Fields(data)
        if shared:
            topo, made = shared.topo, shared.fan_tables
            fields, events = Fields(fields.section()), fields.rest()
        if shared and not fields.data:
            n_faces, n_corners, fields = corners // 3, corners // 3 * 3, Fields(bytes(4))
        else:
            n_faces = fields.count()
            n_corners = fields.count() if topo == 2 else 3 * n_faces
            fans = fields if shared else Fields(fields.section())
            fans.count()  # vertices
        if not shared:
            side, events = CodedSequence(fans.section()), fans.rest()
            made = fan_tables(side, topo)
        self.walk = Walk(topo, n_corners - 2 * n_faces, StaticSymbols(events, 1, 8, 4, 2**31), *made)
        self.fan_faces = self.walk.faces
        assert len(self.fan_faces) == n_faces, "other faces than announced"
        duplicates = runs(fields.section(), n_faces)
        faces = self.fan_faces + [f for f, n in zip(self.fan_faces, duplicates) for _ in range(n)]
        turned = runs(fields.section(), len(faces))
        self.faces = [[f[0]] + f[:0:-1] if t else list(f) for f, t in zip(faces, turned)]
        self.block = runs(fields.section(), len(faces))
        left = [block.cells - self.block.count(b) for b, block in enumerate(blocks)]
        self.loose = loose_cells(fields.section(), blocks, left)
        fields.end()
