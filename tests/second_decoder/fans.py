"""Sections 12.1 and 12.2 of docs/format.md: connectivity as fans that grow rings of triangles."""

from around import LATE0, LATE2, Element
from container import Fields, require, unzigzag
from description import MIXED, NODES, POLYGON, QUAD, TRIANGLE
from entropy import CodedSequence, Events, bits, counts, tables

CLOSE, POCKET, SWALLOW, BORDER, SPLIT, KNOWN, MERGE, OPEN = "close pocket swallow border split known merge open".split()


def triangle_symbols():
    table = [(CLOSE, i) for i in range(4)] + [(POCKET, i) for i in range(4)] + [(CLOSE, i) for i in range(4, 12)] + [(SWALLOW, 0)]
    table += [(BORDER, i) for i in range(4)] + [(SPLIT, i) for i in range(6)] + [(KNOWN, 0), (MERGE, 0), (OPEN, 1), (OPEN, 4)]
    behind = {POCKET, SWALLOW, SPLIT, KNOWN, MERGE}
    return [(name, i, 1, i * [1], 1 if name in behind else None) for name, i in table]


def polygon_symbols():
    """(name, i, t, spokes of the fan, spoke of the triangle behind it)"""

    def some(name, spokes, t=1):
        return [(name, len(s), t, [int(c) for c in s], None) for s in spokes.split()]

    def zero(spoke):
        return [(name, 0, 1, [], spoke) for name in (POCKET, SWALLOW, SPLIT, MERGE, KNOWN)]

    def behind(name, texts, t=1):
        return [(name, i, t, [int(c) for c in s[:i]], int(s[i])) for i, s in ((int(x[0]), x[2:]) for x in texts.split())]

    table = [(CLOSE, 0, 1, [], None)] + zero(0) + some(OPEN, "0") + zero(1) + some(OPEN, "1")
    table += [(POCKET, 0, t, [], 0) for t in (None, 2, 3)] + [(BORDER, 0, 1, [], None)] + some(OPEN, "0000")
    table += some(CLOSE, "0 1 00 10 01 11 000 010 110 101 011 111 0000 1010 0110 0101 1111 01010 101010 0101010 10101010")
    table += behind(POCKET, "1:00 1:10 1:01 1:11 2:000 2:010 2:110 2:111 3:0000 3:1010 3:0110 3:0101")
    table += behind(POCKET, "1:00 2:000", 2) + behind(POCKET, "1:00", 3)
    table += some(BORDER, "1 01 11 101") + behind(SPLIT, "1:00 1:10 1:01 1:11 2:010")
    return table


SYMBOLS = {1: triangle_symbols(), 2: polygon_symbols()}


class Entry:
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
    """12.2. Afterwards `faces` are lists of vertices, `births` one for each vertex."""

    def __init__(self, topo, n_faces, n_corners, n_vertices, events, event_tables, number_tables):
        self.topo, self.events = topo, events
        self.event_tables, self.number_tables = event_tables, number_tables
        self.triangles, self.n_vertices, self.n_faces = n_corners - 2 * n_faces, n_vertices, n_faces
        self.ring, self.head, self.tail, self.waiting = [], 0, 0, []
        self.faces, self.face, self.across_at_begin = [], None, []
        self.births, self.open, self.last_old, self.done = [], 0, 0, 0
        self.moves = 8 * self.triangles + 4096
        while self.done < self.triangles:
            self.step()
        require(self.done == self.triangles and len(self.faces) == n_faces and not self.open, "other faces than announced")
        require(len(self.births) == n_vertices, "other vertices than announced")
        events.end()

    def number(self, n):
        return self.events.number(self.number_tables[n])

    # --- the ring

    def at(self, place):
        return self.ring[place]

    def push(self, entry):
        self.ring[self.tail :] = [entry]
        self.tail += 1

    def marker(self, place):
        return self.ring[place].vertex is None

    def prepare(self):
        """Whether there is a ring, its head and last entry no markers."""
        while not self.open:
            size = self.tail - self.head
            if size < 2 or size == 2 and not self.marker(self.head) and not self.marker(self.head + 1):
                if not self.waiting:
                    self.head = self.tail = 0
                    return False
                self.head, self.tail = self.waiting.pop()
            elif self.marker(self.head):
                if not self.marker(self.tail - 1):
                    self.push(self.at(self.head).copy())
                self.head += 1
            elif self.marker(self.tail - 1):
                if not self.marker(self.head + 1):
                    self.push(self.at(self.head).copy())
                self.head += 1
            else:
                return True
        return True

    def context(self):
        def kind(place, most):
            seen = self.at(place).seen
            return min(seen, 3) if most == 3 else max(min(seen, 4) - 1, 0)

        h, t, size = self.head, self.tail, self.tail - self.head
        if self.topo == 1:
            far = (kind(h + 2, 4), kind(t - 2, 4)) if size >= 4 else (0, 0)
            row = min(self.at(h).seen, 10) - 1
            return 256 * row + 64 * kind(h + 1, 4) + 16 * kind(t - 1, 4) + 4 * far[0] + far[1]
        far = (kind(h + 2, 3), kind(t - 2, 3)) if size >= 5 else (0, 0)
        row = 8 * self.open + min(self.at(h).seen, 7)
        if size >= 5 and kind(h + 1, 3) == 2 and far[0] == 2:
            return 6144 + 64 * row + 16 * kind(t - 1, 3) + 4 * far[1] + kind(h + 3, 3)
        return 256 * row + 64 * kind(h + 1, 3) + 16 * kind(t - 1, 3) + 4 * far[0] + far[1]

    # --- triangles and faces

    def begin_face(self, corners, across):
        self.face = list(corners)
        self.face_across = across

    def end_face(self):
        self.faces.append(self.face)
        self.across_at_begin.append(self.face_across)
        self.face = None

    def triangle(self, w, spoke):
        """(f, p, w): gives g."""
        f, p = self.at(self.head), self.at(self.tail - 1)
        if not self.open:
            self.begin_face([f.vertex, p.vertex], p.across)
            p.see(1)
            g = f.vertex
        else:
            g = self.before_p
        self.before_p = p.vertex
        self.face.append(w)
        self.done += 1
        if spoke:
            self.end_face()
            self.open = 0
            f.see(1)
        else:
            self.open = min(self.open + 1, 2)
        return g

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
            if known >> k & 1:
                corners.append(self.old())
            else:
                newest = max(len(self.births) - 1, 0)
                corners.append(self.new_vertex(Element(corners[-1] if corners else newest)))
        v0, v1, v2 = corners
        self.ring = [Entry(v0, v2, 1), Entry(v1, v0, 1), Entry(v2, v1, 1)]
        self.head, self.tail = 0, 3
        self.begin_face(corners, v2)
        self.before_p = v1
        self.done += 1
        if known & 8:
            self.open = 1
        else:
            self.end_face()

    def fan(self, name, i, spokes, target):
        f, n = self.at(self.head), self.at(self.head + 1)
        for j in range(1, i + 1):
            p = self.at(self.tail - 1)
            next_, beyond = {CLOSE: (n.vertex, f.across), POCKET: (target, n.vertex)}.get(name, (None, None))
            v = self.new_vertex(Element(f.vertex, p.vertex, p.across, next_, beyond, place=place_of(name, i, j)))
            before = p.vertex
            p.across = self.triangle(v, spokes[j - 1])
            self.push(Entry(v, before, 1))

    def close_on(self, m, spoke):
        p = self.at(self.tail - 1)
        before = p.vertex
        p.across = self.triangle(m, spoke)
        return before

    def late(self, next_, beyond):
        p, f = self.at(self.tail - 1).vertex, self.at(self.head).vertex
        if p == len(self.births) - 1 and beyond != p:
            self.births[p].refs[LATE0 : LATE2 + 1] = f, next_, beyond
            self.births[p].late = True

    def step(self):
        if not self.prepare():
            self.component()
            return
        s = self.events.symbol(0, self.event_tables[self.context()])
        require(s < len(SYMBOLS[self.topo]), "a symbol that does not exist")
        name, i, t, spokes, spoke = SYMBOLS[self.topo][s]
        if name == POCKET and t is None:
            t = self.number(7)
        (self.open_fan if name == OPEN else getattr(self, name))(i, t, spokes, spoke)

    def close(self, i, t, spokes, _):
        n = self.at(self.head + 1)
        require(n.vertex is not None, "a fan closes on a border")
        if i == 0:
            self.late(n.vertex, self.at(self.head).across)
        self.fan(CLOSE, i, spokes, None)
        self.close_on(n.vertex, 1)
        self.head += 1
        self.at(self.head).see(1)

    def pocket(self, i, t, spokes, spoke):
        size = self.tail - self.head
        require(t > 0 and t + 1 < size and t + 3 <= size + i and not (spoke and t > 1), "a pocket that cannot be")
        between = [self.at(self.head + k).vertex for k in range(1, t + 2)]
        require(None not in between, "a pocket over a border")
        m, n = between[-1], between[0]
        if i == 0:
            self.late(m, n)
        p = self.at(self.tail - 1).vertex
        self.fan(POCKET, i, spokes, m)
        f, p = self.at(self.head).vertex, self.at(self.tail - 1).vertex
        self.close_on(m, spoke)
        if spoke:
            self.begin_face([f, m, n], p)
        else:
            self.face += between[-2::-1]
        self.done += t
        self.end_face()
        self.open = 0
        self.head += t + 1
        self.at(self.head).see(2 if spoke else 1)

    def swallow(self, i, t, spokes, spoke):
        require(self.tail - self.head >= 3, "a ring too small to swallow")
        q, p = self.at(self.tail - 2), self.at(self.tail - 1).vertex
        require(q.vertex is not None, "a border is swallowed")
        self.triangle(q.vertex, spoke)
        self.tail -= 1
        q.across = p
        q.see(1)

    def border(self, i, t, spokes, _):
        self.fan(BORDER, i, spokes, None)
        require(not self.open, "a border amid a face")
        if not self.marker(self.head + 1):
            self.push(Entry(None, None, 0))
            self.push(self.at(self.head).copy())
        self.head += 1

    def split(self, i, t, spokes, spoke):
        self.fan(SPLIT, i, spokes, None)
        ahead = self.number(1) == 0
        k = self.number(2 if ahead else 3)
        j = self.head + 2 + k if ahead else self.tail - 2 - k
        require(self.tail - self.head >= 4 and self.head + 2 <= j <= self.tail - 2 and not self.marker(j), "a split that cannot be")
        m = self.at(j)
        p = self.close_on(m.vertex, spoke)
        m.see(1)
        copied = ahead or not spoke
        self.moves -= j - self.head + 1 if copied else k + 3
        require(self.moves >= 0, "too many moves")
        own = m.copy()
        own.across = p
        if copied:
            copies = [self.at(e).copy() for e in range(self.head, j)] + [own]
            self.waiting.append((j, self.tail))
            self.ring[self.tail :] = copies
            self.head, self.tail = self.tail, self.tail + len(copies)
        else:
            # the entries from j on move up; what stays at j is the copy
            self.ring[j:] = [own] + self.ring[j : self.tail]
            self.waiting.append((self.head, j + 1))
            self.head, self.tail = j + 1, self.tail + 1

    def known(self, i, t, spokes, spoke):
        v = self.old()
        p = self.close_on(v, spoke)
        self.push(Entry(v, p, 1))

    def merge(self, i, t, spokes, spoke):
        r, m = self.number(4), self.number(5)
        require(r < len(self.waiting), "a ring that does not wait")
        begin, end = self.waiting.pop(len(self.waiting) - 1 - r)
        self.moves -= end - begin + r + 1
        require(begin + m < end and not self.marker(begin + m) and self.moves >= 0, "a merge that cannot be")
        entry = self.at(begin + m)
        p = self.close_on(entry.vertex, spoke)
        entry.see(1)
        for e in list(range(begin + m, end)) + list(range(begin, begin + m)):
            self.push(self.at(e))
        own = entry.copy()
        own.across = p
        self.push(own)

    def open_fan(self, i, t, spokes, _):
        self.fan(OPEN, i, spokes, None)




def runs(section, n):
    """12.1: n numbers."""
    if not section:
        return [0] * n
    sequence, value_models, length_models = CodedSequence(section), counts(), counts()
    numbers, before = [], 0
    while len(numbers) < n:
        value = sequence.count(value_models[min(before, 3)])
        length = sequence.count(length_models[min(value, 3)]) + 1
        require(len(numbers) + length <= n, "a run that is too long")
        numbers += [value] * length
        before = value
    sequence.end()
    return numbers


def loose_cells(section, blocks, left):
    """12.5: the cells that faces leave over, by block, as (type, points)."""
    sequence = CodedSequence(section)
    same_type, type_model, size_model, which = bits(), counts(), counts(), counts()
    repeat, step = bits(), counts()
    type_, last, cells = 1, 0, []
    for block, n in zip(blocks, left):
        cells.append([])
        for _ in range(n):
            own = block.type
            if own == MIXED:
                if not sequence.bit(same_type[0]):
                    type_ = sequence.count(type_model[0]) % 256
                own = type_
                require(own in NODES and own != MIXED, "a cell of a type that is not known")
            nodes = []
            for k in range(NODES[own] or sequence.count(size_model[0])):
                j = min(k, 7)
                if k and sequence.bit(repeat[j]):
                    b = sequence.count(which[0])
                    require(b < min(k, 256), "a node is repeated that is not there")
                    nodes.append(nodes[k - b - 1])
                else:
                    last = last + unzigzag(sequence.count(step[j])) & 0xFFFFFFFF
                    nodes.append(last)
            cells[-1].append((own, nodes))
    sequence.end()
    return cells


class Fans:
    """TOPO 1, 2 and (with the tables of a set) 3: faces, blocks and loose cells."""

    def __init__(self, topo, data, points, corners, blocks, shared=None):
        fields = Fields(data)
        if shared:
            topo, event, number = shared.topo, shared.event, shared.number
            beside, events = fields.section(), fields.rest()
            fields = Fields(beside)
            if beside:
                n_faces = fields.count()
                n_corners = fields.count() if topo == 2 else 3 * n_faces
                vertices = fields.count(points)
            else:
                n_faces, n_corners, vertices = corners // 3, corners // 3 * 3, points
                fields = Fields(bytes(4))
        else:
            n_faces = fields.count()
            n_corners = fields.count() if topo == 2 else 3 * n_faces
            fans = Fields(fields.section())
            vertices, side, events = fans.count(2**28), CodedSequence(fans.section()), fans.rest()
            event = tables(side, *((2560, 32, 32, 9) if topo == 1 else (7680, 64, 32, 9)))
            number = tables(side, 8, 41, 8, 9)
            side.end()
        require(3 * n_faces <= n_corners <= corners and vertices <= points, "more faces or vertices than the mesh has")
        self.topo = topo
        self.walk = Walk(topo, n_faces, n_corners, vertices, Events(events), event, number)
        self.fan_faces = self.walk.faces
        duplicates = runs(fields.section(), n_faces)
        faces = self.fan_faces + [f for f, n in zip(self.fan_faces, duplicates) for _ in range(n)]
        turned = runs(fields.section(), len(faces))
        self.faces = [[f[0]] + f[:0:-1] if t else list(f) for f, t in zip(faces, turned)]
        self.block = runs(fields.section(), len(faces))
        taken = [0] * len(blocks)
        for face, b in zip(self.faces, self.block):
            require(b < len(blocks) and blocks[b].type in (POLYGON, {3: TRIANGLE, 4: QUAD}.get(len(face))), "a block that does not take such a face")
            taken[b] += 1
        self.loose = loose_cells(fields.section(), blocks, [block.cells - n for block, n in zip(blocks, taken)])
        fields.end()
