"""Sections 12.1 and 12.2 of docs/format.md: connectivity as fans that grow rings of triangles."""

from around import LATE0, LATE2, Element
from container import Fields, require, unzigzag
from description import MIXED, NODES, POLYGON, QUAD, TRIANGLE
from entropy import CodedSequence, Events, bits, counts, tables

CLOSE, POCKET, SWALLOW, BORDER, SPLIT, KNOWN, MERGE, OPEN = "close pocket swallow border split known merge open_fan".split()


def triangle_symbols():
    table = [(CLOSE, i) for i in range(4)] + [(POCKET, i) for i in range(4)] + [(CLOSE, i) for i in range(4, 12)] + [(SWALLOW, 0)]
    table += [(BORDER, i) for i in range(4)] + [(SPLIT, i) for i in range(6)] + [(KNOWN, 0), (MERGE, 0), (OPEN, 1), (OPEN, 4)]
    return [(name, 1, i * [1], 1) for name, i in table]


def polygon_symbols():
    """(name, t, spokes of the fan, spoke of the triangle behind it)"""

    def some(name, texts, t=1, behind=False):
        return [(name, t, [int(c) for c in (s[:-1] if behind else s)], int(s[-1]) if behind else None) for s in texts.split()]

    def zero(spoke):
        return [(name, 1, [], spoke) for name in (POCKET, SWALLOW, SPLIT, MERGE, KNOWN)]

    table = [(CLOSE, 1, [], None)] + zero(0) + some(OPEN, "0") + zero(1) + some(OPEN, "1")
    table += [(POCKET, t, [], 0) for t in (None, 2, 3)] + [(BORDER, 1, [], None)] + some(OPEN, "0000")
    table += some(CLOSE, "0 1 00 10 01 11 000 010 110 101 011 111 0000 1010 0110 0101 1111 01010 101010 0101010 10101010")
    table += some(POCKET, "00 10 01 11 000 010 110 111 0000 1010 0110 0101", behind=True)
    table += some(POCKET, "00 000", 2, True) + some(POCKET, "00", 3, True)
    return table + some(BORDER, "1 01 11 101") + some(SPLIT, "00 10 01 11 010", behind=True)


SYMBOLS = {1: triangle_symbols(), 2: polygon_symbols()}


class Entry:
    """A vertex of a ring, None for markers of borders."""

    __slots__ = ("vertex", "across", "seen")

    def __init__(self, vertex, across, seen):
        self.vertex, self.across, self.seen = vertex, across, seen

    def copy(self):
        return Entry(self.vertex, self.across, self.seen)

    def see(self, n):
        self.seen = min(self.seen + n, 15)


def place_of(name, i, j):
    if name in (CLOSE, POCKET):
        return i * (i - 1) // 2 + j - 1 if i < 4 else 9 if j == i else 5 + min(j, 3)
    return 9 + min(j, 3)


class Walk:
    """12.2. Afterwards `faces` are lists of vertices, `births` the element (12.3) of each vertex."""

    def __init__(self, topo, n_faces, n_corners, n_vertices, events, event_tables, number_tables):
        self.topo, self.events = topo, events
        self.event_tables, self.number_tables = event_tables, number_tables
        triangles, self.n_vertices = n_corners - 2 * n_faces, n_vertices
        self.ring, self.head, self.tail, self.waiting = [], 0, 0, []
        self.faces, self.across_at_begin = [], []
        self.births, self.open, self.last_old, self.done = [], 0, 0, 0
        self.moves = 8 * triangles + 4096
        while self.done < triangles:
            if self.prepare():
                name, t, spokes, spoke = SYMBOLS[topo][events.symbol(0, event_tables[self.context()])]
                getattr(self, name)(t, spokes, spoke)
            else:
                self.component()
        require(self.done == triangles and len(self.faces) == n_faces and not self.open, "other faces than announced")
        require(len(self.births) == n_vertices, "other vertices than announced")
        events.end()

    def number(self, n):
        return self.events.number(self.number_tables[n])

    # --- the ring, from head to tail

    def push(self, entry):
        self.ring[self.tail :] = [entry]
        self.tail += 1

    def marker(self, place):
        return self.ring[place].vertex is None

    @property
    def focus(self):
        return self.ring[self.head]

    @property
    def newest(self):
        return self.ring[self.tail - 1]

    def prepare(self):
        """Whether there is a ring, its head and last entry no markers."""
        while not self.open:
            size = self.tail - self.head
            if size < 2 or size == 2 and not self.marker(self.head) and not self.marker(self.head + 1):
                if not self.waiting:
                    self.head = self.tail = 0
                    return False
                self.head, self.tail = self.waiting.pop()
            elif not self.marker(self.head) and not self.marker(self.tail - 1):
                return True
            else:
                if not self.marker(self.tail - 1 if self.marker(self.head) else self.head + 1):
                    self.push(self.focus.copy())
                self.head += 1
        return True

    def context(self):
        def kind(place):
            seen = self.ring[place].seen
            return max(min(seen, 4) - 1, 0) if self.topo == 1 else min(seen, 3)

        h, t, size = self.head, self.tail, self.tail - self.head
        far, row, seen = (0, 0), self.focus.seen, (kind(h + 1), kind(t - 1))
        if size >= (4 if self.topo == 1 else 5):
            far = kind(h + 2), kind(t - 2)
        row = min(row, 10) - 1 if self.topo == 1 else 8 * self.open + min(row, 7)
        if self.topo == 2 and size >= 5 and seen[0] == 2 and far[0] == 2:
            return 6144 + 64 * row + 16 * seen[1] + 4 * far[1] + kind(h + 3)
        return 256 * row + 64 * seen[0] + 16 * seen[1] + 4 * far[0] + far[1]

    # --- triangles and faces

    def begin_face(self, corners, across):
        self.face, self.face_across = list(corners), across

    def end_face(self):
        self.faces.append(self.face)
        self.across_at_begin.append(self.face_across)
        self.open = 0

    def triangle(self, w, spoke):
        """(focus, newest, w)"""
        f, p = self.focus, self.newest
        if not self.open:
            self.begin_face([f.vertex, p.vertex], p.across)
            p.see(1)
        self.face.append(w)
        self.done += 1
        if spoke:
            self.end_face()
            f.see(1)
        else:
            self.open = min(self.open + 1, 2)

    def new_vertex(self, birth):
        require(len(self.births) < self.n_vertices, "more vertices than announced")
        self.births.append(birth)
        return len(self.births) - 1

    def old(self):
        self.last_old = self.last_old + unzigzag(self.number(6)) & 0xFFFFFFFF
        require(self.last_old < len(self.births), "a vertex that has not come up")
        return self.last_old

    def component(self):
        known, corners = self.number(0), []
        require(known < (16 if self.topo == 2 else 8), "a component of another kind")
        for k in range(3):
            newest = max(len(self.births) - 1, 0)
            corners.append(self.old() if known >> k & 1 else self.new_vertex(Element(corners[-1] if corners else newest)))
        self.ring = [Entry(v, corners[k - 1], 1) for k, v in enumerate(corners)]
        self.head, self.tail = 0, 3
        self.begin_face(corners, corners[2])
        self.done += 1
        if known & 8:
            self.open = 1
        else:
            self.end_face()

    def fan(self, name, spokes, target=None):
        f, n = self.focus, self.ring[self.head + 1]
        for j, spoke in enumerate(spokes, 1):
            p = self.newest
            next_, beyond = {CLOSE: (n.vertex, f.across), POCKET: (target, n.vertex)}.get(name, (None, None))
            v = self.new_vertex(Element(f.vertex, p.vertex, p.across, next_, beyond, place=place_of(name, len(spokes), j)))
            self.push(Entry(v, self.close_on(v, spoke), 1))

    def close_on(self, m, spoke):
        """The triangle on the newest edge, to m; gives what lies across the next one."""
        p = self.newest
        before = p.vertex
        self.triangle(m, spoke)
        p.across = self.face[0] if len(self.face) == 3 else self.face[-3]
        return before

    def late(self, next_, beyond):
        p = self.newest.vertex
        if p == len(self.births) - 1 and beyond != p:
            self.births[p].refs[LATE0 : LATE2 + 1] = self.focus.vertex, next_, beyond
            self.births[p].late = True

    def close(self, t, spokes, _):
        n = self.ring[self.head + 1]
        require(n.vertex is not None, "a fan closes on a border")
        if not spokes:
            self.late(n.vertex, self.focus.across)
        self.fan(CLOSE, spokes)
        self.close_on(n.vertex, 1)
        self.head += 1
        self.focus.see(1)

    def pocket(self, t, spokes, spoke):
        t = self.number(7) if t is None else t
        size = self.tail - self.head
        require(t > 0 and t + 1 < size and t + 3 <= size + len(spokes) and not (spoke and t > 1), "a pocket that cannot be")
        between = [self.ring[self.head + k].vertex for k in range(1, t + 2)]
        require(None not in between, "a pocket over a border")
        m, n = between[-1], between[0]
        if not spokes:
            self.late(m, n)
        self.fan(POCKET, spokes, m)
        f, p = self.focus.vertex, self.newest.vertex
        self.close_on(m, spoke)
        if spoke:
            self.begin_face([f, m, n], p)
        else:
            self.face += between[-2::-1]
        self.done += t
        self.end_face()
        self.head += t + 1
        self.focus.see(2 if spoke else 1)

    def swallow(self, t, spokes, spoke):
        require(self.tail - self.head >= 3, "a ring too small to swallow")
        q, p = self.ring[self.tail - 2], self.newest.vertex
        require(q.vertex is not None, "a border is swallowed")
        self.triangle(q.vertex, spoke)
        self.tail -= 1
        q.across = p
        q.see(1)

    def border(self, t, spokes, _):
        self.fan(BORDER, spokes)
        require(not self.open, "a border amid a face")
        if not self.marker(self.head + 1):
            self.push(Entry(None, None, 0))
            self.push(self.focus.copy())
        self.head += 1

    def move(self, entries):
        self.moves -= entries
        require(self.moves >= 0, "too many moves")

    def split(self, t, spokes, spoke):
        self.fan(SPLIT, spokes)
        ahead = self.number(1) == 0
        k = self.number(2 if ahead else 3)
        j = self.head + 2 + k if ahead else self.tail - 2 - k
        require(self.head + 2 <= j <= self.tail - 2 and not self.marker(j), "a split that cannot be")
        m, copied = self.ring[j], ahead or not spoke
        p = self.close_on(m.vertex, spoke)
        m.see(1)
        own = Entry(m.vertex, p, m.seen)
        self.move(j - self.head + 1 if copied else k + 3)
        if copied:
            copies = [entry.copy() for entry in self.ring[self.head : j]] + [own]
            self.waiting.append((j, self.tail))
            self.ring[self.tail :] = copies
            self.head, self.tail = self.tail, self.tail + len(copies)
        else:
            # the entries from j on move up; what stays at j is the copy
            self.ring[j:] = [own] + self.ring[j : self.tail]
            self.waiting.append((self.head, j + 1))
            self.head, self.tail = j + 1, self.tail + 1

    def known(self, t, spokes, spoke):
        v = self.old()
        self.push(Entry(v, self.close_on(v, spoke), 1))

    def merge(self, t, spokes, spoke):
        r, m = self.number(4), self.number(5)
        require(r < len(self.waiting), "a ring that does not wait")
        begin, end = self.waiting.pop(len(self.waiting) - 1 - r)
        self.move(end - begin + r + 1)
        require(begin + m < end and not self.marker(begin + m), "a merge that cannot be")
        entry = self.ring[begin + m]
        p = self.close_on(entry.vertex, spoke)
        entry.see(1)
        for moved in self.ring[begin + m : end] + self.ring[begin : begin + m] + [Entry(entry.vertex, p, entry.seen)]:
            self.push(moved)

    def open_fan(self, t, spokes, _):
        self.fan(OPEN, spokes)


def runs(section, n):
    """12.1: n numbers."""
    if not section:
        return [0] * n
    sequence, value_models, length_models = CodedSequence(section), counts(), counts()
    numbers, value = [], 0
    while len(numbers) < n:
        value = sequence.count(value_models[min(value, 3)])
        length = sequence.count(length_models[min(value, 3)]) + 1
        require(len(numbers) + length <= n, "a run that is too long")
        numbers += [value] * length
    sequence.end()
    return numbers


def loose_cells(section, blocks, left):
    """12.5: the cells that faces leave over, by block, as (type, points)."""
    sequence, same_type, repeat = CodedSequence(section), bits(), bits()
    models, step = counts(), counts()
    type_, last, cells = 1, 0, []
    for block, n in zip(blocks, left):
        cells.append([])
        for _ in range(n):
            own, nodes = block.type, []
            if own == MIXED:
                if not sequence.bit(same_type[0]):
                    type_ = sequence.count(models["type"]) % 256
                own = type_
            for k in range(NODES[own] or sequence.count(models["size"])):
                j = min(k, 7)
                if k and sequence.bit(repeat[j]):
                    nodes.append(nodes[-1 - sequence.count(models["which"])])
                else:
                    last = last + unzigzag(sequence.count(step[j])) & 0xFFFFFFFF
                    nodes.append(last)
            cells[-1].append((own, nodes))
    sequence.end()
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
            n_faces, n_corners, vertices = corners // 3, corners // 3 * 3, points
            fields = Fields(bytes(4))
        else:
            n_faces = fields.count()
            n_corners = fields.count() if topo == 2 else 3 * n_faces
            fans = fields if shared else Fields(fields.section())
            vertices = fans.count(points)
        if not shared:
            side, events = CodedSequence(fans.section()), fans.rest()
            made = fan_tables(side, topo)
            side.end()
        require(3 * n_faces <= n_corners <= corners and vertices <= points, "more faces or vertices than the mesh has")
        self.walk = Walk(topo, n_faces, n_corners, vertices, Events(events), *made)
        self.fan_faces = self.walk.faces
        duplicates = runs(fields.section(), n_faces)
        faces = self.fan_faces + [f for f, n in zip(self.fan_faces, duplicates) for _ in range(n)]
        turned = runs(fields.section(), len(faces))
        self.faces = [[f[0]] + f[:0:-1] if t else list(f) for f, t in zip(faces, turned)]
        self.block = runs(fields.section(), len(faces))
        left = [block.cells for block in blocks]
        for face, b in zip(self.faces, self.block):
            require(blocks[b].type in (POLYGON, {3: TRIANGLE, 4: QUAD}.get(len(face))), "a block that does not take such a face")
            left[b] -= 1
        self.loose = loose_cells(fields.section(), blocks, left)
        fields.end()
