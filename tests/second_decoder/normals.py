"""Sections 13.3 to 13.5 and 13.7 of docs/format.md: normals that positions foretell, and twins."""

import math

import numpy as np

from around import exceptions
from codes import Map, clamp, octahedral, wrap
from container import Fields, require
from description import CELLS, CORNERS, POINTS, TWINS
from entropy import CodedSequence, bits, symbols

UNIT, SUMMED, INWARD, FOLLOWS, REPEATS, WELDED = (1 << i for i in range(6))
ZERO = (0.0, 0.0, 0.0)


# --- vectors: doubles, rounded after every operation


def sub(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def plus(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def times(a, s):
    return a[0] * s, a[1] * s, a[2] * s


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def length(a):
    return math.sqrt(dot(a, a))


def divide(a, b):
    """As IEEE 754 has it."""
    with np.errstate(all="ignore"):
        return float(np.float64(a) / np.float64(b))


def unit(v):
    m = max(abs(x) for x in v)
    if not 1e-300 < m < 1e300:
        return ZERO
    v = tuple(x / m for x in v)
    l = length(v)
    return tuple(x / l for x in v)


def half(x):
    m, e = math.frexp(x)
    return 2 * (e - 1) + (m >= 0.75)


def halves(s):
    n = s.bit_length()
    return s if s < 2 else 2 * n - 2 + (s >> n - 2 & 1)


def angle(a, b):
    s = length(cross(a, b))
    d = math.sqrt(dot(a, a) * dot(b, b)) + dot(a, b)
    if not d > 0:
        return 3.14159265358979312 if s > 0 or dot(a, b) < 0 else 0.0
    x = s / d
    for _ in range(3):
        x = x / (1 + math.sqrt(1 + x * x))
    y = 0.0
    for n in range(23, 0, -2):
        y = 1 / n - (x * x) * y
    return 2 * (8 * x * y)


def largest(v):
    """The component with the largest |v|: 2 before 0 before 1 among equals."""
    return max((2, 0, 1), key=lambda k: abs(v[k]))


# --- 13.4


class Residuals:
    def __init__(self, sequence):
        self.sequence, self.lengths, self.heads = sequence, symbols(), symbols()

    def read(self, m, expected, spread, B):
        o = expected // 2
        s = self.sequence.symbol(self.lengths[m, min(o, 19), spread])
        return self.tail(m, max(o - 7, 0) + s if s < 15 else self.sequence.raw(7), B)

    def tail(self, m, length_, B):
        length_ = min(length_, B)
        if length_ == 0:
            return 0
        n = min(length_ - 1, 3)
        left = length_ - 1 - n
        head = self.sequence.symbol(self.heads[m, length_])
        v = (1 << n) + head % (1 << n)
        if B == 64 and left > 32:
            left -= 32
            v = v << 32 | self.sequence.raw(32)
        v = v << left | self.sequence.raw(left)
        return wrap(-v if head >> n & 1 else v, B)


# --- 13.3: what is around an element


class Stencil:
    def __init__(self):
        self.parallelograms, self.neighbour = [], None

    def add(self, *abx):
        if None not in abx and len(self.parallelograms) < 5:
            self.parallelograms.append(abx)

    def neighbours(self, before):
        found = []
        for a, b, _ in self.parallelograms:
            found += [x for x in (a, b) if x not in found]
        found = list(dict.fromkeys(found))
        last = self.neighbour if self.neighbour is not None else before
        return found or ([] if last is None else [last])


def stencil_of(surface, corners, E, same):
    made, s = Stencil(), surface
    for h in corners:
        i, j = s.next[h], s.previous[h]
        for k in (i, j):
            if E(k) is not None:
                made.neighbour = E(k)
        if s.size(h) == 3:
            o = s.opposite[i]
            if E(i) is not None and E(j) is not None and same(o, j) and same(s.next[o], i):
                made.add(E(i), E(j), E(s.previous[o]))
        elif E(i) is not None and E(j) is not None:
            made.add(E(i), E(j), E(s.next[i]))
        elif E(i) is not None and E(s.next[i]) is not None:
            o = s.opposite[i]
            if same(s.next[o], i):
                made.add(E(i), E(i), E(s.next[s.next[o]]))
        elif E(j) is not None and E(s.previous[j]) is not None:
            o = s.opposite[s.previous[j]]
            if same(o, j):
                made.add(E(j), E(j), E(s.previous[o]))
    return made


def point_stencil(surface, p):
    if not surface.vertices_of[p]:
        return Stencil()
    V = surface.vertices_of[p][0]

    def E(h):
        v = surface.origin[h]
        return surface.point[h] if v is not None and v < V else None

    return stencil_of(surface, surface.around(V), E, lambda a, b: True)


def face_stencil(surface, f):
    made = Stencil()
    for h in surface.corners(f):
        m = surface.face[surface.opposite[h]]
        if m < f:
            made.add(m, m, m)
            made.neighbour = m if made.neighbour is None else max(m, made.neighbour)
    return made


def ring_wedges(surface, ring, joined):
    """Longest runs of joined corners, in the order in which they are coded."""
    n, start = len(ring), 0
    if joined[n - 1]:
        start = max([k + 1 for k in range(n - 1) if not joined[k]], default=0)
    wedges, run = [], []
    for k in range(n):
        at = (start + k) % n
        run.append(ring[at])
        if not joined[at] or k == n - 1:
            wedges.append(run)
            run = []
    return wedges


def cut_ring(surface, ring, decide):
    """Which corners of a ring are joined to the one behind: decide(h, g) where the text asks."""
    joined, cuts = [], 0
    for k, h in enumerate(ring):
        g, last = ring[(k + 1) % len(ring)], k == len(ring) - 1
        adjacent = surface.turn(h) == g
        joined.append(bool(adjacent and (not last or cuts >= 2) and decide(h, g)))
        if not last and not joined[-1]:
            cuts += 1 if adjacent else 2
    return joined


class Expected:
    """13.5: the vectors that positions foretell, and their spreads."""

    def __init__(self, patch, weight, flags):
        self.s, self.at, self.weight, self.flags = patch.surface, [tuple(map(float, p)) for p in patch.numbers], weight, flags
        self.face_normals = [self.face_normal(f) for f in range(len(self.s.faces))]

    def position(self, h):
        return self.at[self.s.point[h]]

    def face_normal(self, f, first=None):
        corners = self.s.corners(f) if first is None else first
        c = self.position(corners[0])
        n = ZERO
        for a, b in zip(corners[1:], corners[2:]):
            n = plus(n, cross(sub(self.position(a), c), sub(self.position(b), c)))
        return times(n, -1.0) if self.s.flipped[f] else n

    def part(self, h):
        """What a corner adds to a sum and to its L."""
        n = self.face_normals[self.s.face[h]]
        l = length(n)
        if not l > 0:
            return ZERO, 0.0
        own = self.position(h)
        a, b = sub(self.position(self.s.next[h]), own), sub(self.position(self.s.previous[h]), own)
        if self.weight == 0:
            g = 1.0
        elif self.weight == 1:
            g = 1 / l
        elif self.weight == 2:
            g = angle(a, b) / l
        else:
            product = dot(a, a) * dot(b, b)
            g = 1 / product if product else 0.0
        return times(n, g), l * g

    def sum_of(self, corners):
        total, L = ZERO, 0.0
        if self.weight == 4:
            return total, L
        for h in corners:
            n, l = self.part(h)
            total, L = plus(total, n), L + l
        return total, L

    def finished(self, total, L):
        spread = math.sqrt(divide(max(L - length(total), 0.0), L)) if L else 0.0
        return self.directed(total), spread

    def directed(self, v):
        if self.flags & INWARD:
            v = times(v, -1.0)
        return v if self.flags & SUMMED else unit(v)

    def of_face(self, f):
        if self.weight == 4:
            return ZERO, 0.0
        n, corners = self.face_normals[f], self.s.corners(f)
        edges = [sub(self.position(self.s.next[h]), self.position(h)) for h in corners]
        l, m = max(dot(e, e) for e in edges), max(dot(self.position(h), self.position(h)) for h in corners)
        size = length(n)
        return self.directed(n), math.sqrt(l) * math.sqrt(m) / size if size else 0.0

    def sharpness(self, h, g):
        if self.weight == 4:
            return 0
        n, m = self.face_normals[self.s.face[h]], self.face_normals[self.s.face[g]]
        product = length(n) * length(m)
        c = dot(n, m) / product if product else 1.0
        return 1 + sum(1 - c > limit for limit in (1e-6, 0.01, 0.1, 0.5))


class Kept:
    __slots__ = ("codes", "E", "vector", "S", "error", "completion", "bits")

    def repeat(self, other):
        self.codes, self.vector, self.bits = other.codes, other.vector, other.bits
        self.error, self.completion = other.error, other.completion


class Normals:
    """An array of coding 8 in a patch. `values` are in coded order: by point, face or half-edge, then the rest."""

    def __init__(self, fields, array, patch):
        self.array, self.patch, self.s = array, patch, patch.surface
        octahedron = fields.u8()
        self.weight, self.flags = fields.u8(), fields.u8()
        require(octahedron in (0, 4) and self.weight <= 4 and self.flags < 64, "flags of normals that cannot be")
        self.steps = None
        if octahedron:
            self.steps = fields.count(67108864)
        else:
            self.maps = [Map(fields, array.type) for _ in range(3)]
        self.exceptions = exceptions(fields.section(), array.dtype)
        self.sequence = CodedSequence(fields.rest())
        self.residuals = Residuals(self.sequence)
        self.models = {name: bits() for name in "Twin Repeat Zero ZeroSign SmallSign Side Joined".split()}
        self.exponents = symbols()
        self.lasts = {"Twin": 0, "Repeat": 0, "Joined": 0}
        self.f64 = array.dtype == "f8"
        self.least = -128 if self.f64 else -68
        self.expected = Expected(patch, self.weight, self.flags)
        self.kept, self.before, self.order = {}, None, []
        {POINTS: self.points, CELLS: self.cells, CORNERS: self.corners, TWINS: self.corners}[array.domain]()
        self.sequence.end()

    def bit_after_last_two(self, name, *context):
        last = self.lasts[name]
        bit = self.sequence.bit(self.models[name][context + (last,)])
        self.lasts[name] = 2 * last % 4 + bit
        return bit

    # --- elements by domain

    def rows(self, keys):
        made = np.zeros((len(keys), 3), self.array.dtype)
        as_bits = made.view("u" + self.array.dtype[1])
        for i, key in enumerate(keys):
            as_bits[i] = self.kept[key].bits
        order = {key: i for i, key in enumerate(self.order)}
        by_order = {order[key]: i for i, key in enumerate(keys)}
        for place, value in self.exceptions.items():
            require(place < made.size, "an exception of no number")
            as_bits[by_order[place // 3], place % 3] = value
        return made

    def points(self):
        s, sums = self.s, []
        own = [[] for _ in range(self.patch.points)]
        for h in range(s.real):
            own[s.point[h]].append(h)
        sums = [self.expected.sum_of(hs) for hs in own]
        twin = [None] * len(sums)
        if self.flags & WELDED:
            places = {}
            for p in range(len(sums)):
                places.setdefault(self.expected.at[p], []).append(p)
            for group in places.values():
                total, L = ZERO, 0.0
                for p in group:
                    total, L = plus(total, sums[p][0]), L + sums[p][1]
                for i, p in enumerate(group):
                    sums[p], twin[p] = (total, L), group[i - 1] if i else None
        inside = [p for p in range(len(sums)) if s.vertices_of[p]]
        for p in inside + [p for p in range(len(sums)) if not s.vertices_of[p]]:
            E, spread = self.expected.finished(*sums[p]) if s.vertices_of[p] or self.flags & WELDED else (ZERO, 0.0)
            self.element(p, point_stencil(s, p), E, spread, twin[p])
        self.values = self.rows(range(len(sums)))

    def cells(self):
        n = len(self.s.faces)
        for f in range(n):
            self.element(f, face_stencil(self.s, f), *self.expected.of_face(f))
        count = n + sum(map(len, self.patch.fans.loose))
        for c in range(n, count):
            self.element(c, Stencil(), ZERO, 0.0)
        self.values = self.rows(range(count))

    def corners(self):
        s, twins = self.s, self.patch.twin_of_half_edge if self.array.domain == TWINS else None
        by_twin, by_point = {}, {}
        sums = {}
        if twins is not None:
            own = [[] for _ in range(self.patch.points)]
            for h in range(s.real):
                own[s.point[h]].append(h)
            sums = [self.expected.sum_of(hs) for hs in own]
        for V in range(len(s.corner)):
            ring = s.ring(V)
            wedges = ring_wedges(s, ring, cut_ring(s, ring, lambda h, g: self.joined(V, h, g, twins, by_twin)))
            before = None
            for wedge in wedges:
                known = [h for h in wedge if twins is not None and twins[h] in by_twin]
                if known:
                    kept = self.kept[by_twin[twins[known[0]]]]
                    for h in wedge:
                        self.kept[h] = kept
                else:
                    self.wedge(V, wedge, before, sums[s.point[wedge[0]]] if twins is not None and self.flags & WELDED else None, by_point)
                for h in wedge:
                    if twins is not None:
                        by_twin.setdefault(twins[h], h)
                before = wedge[0]
            self.order += [h for h in ring]
        self.loose_nodes(twins, by_twin)

    def loose_nodes(self, twins, by_twin):
        at = self.s.real
        self.order_loose = []
        for cells in self.patch.fans.loose:
            for _, nodes in cells:
                for k in range(len(nodes)):
                    twin = self.patch.loose_twins[at - self.s.real] if twins is not None else None
                    if twins is not None and twin in by_twin:
                        self.kept[at] = self.kept[by_twin[twin]]
                    else:
                        self.element(at, Stencil(), ZERO, 0.0, ordered=False)
                        if twins is not None:
                            by_twin[twin] = at
                    self.order.append(at)
                    at += 1
        self.values = self.rows(range(at))

    def joined(self, V, h, g, twins, by_twin):
        s = self.s
        if twins is not None:
            if twins[h] == twins[g]:
                return True
            if twins[h] in by_twin and twins[g] in by_twin:
                return self.kept[by_twin[twins[h]]].codes == self.kept[by_twin[twins[g]]].codes
        a, b = s.previous[h], s.next[g]
        far = 0 if s.origin[a] >= V else 1 if self.kept[a].codes == self.kept[b].codes else 2
        return self.bit_after_last_two("Joined", far, self.expected.sharpness(h, g))

    def wedge(self, V, wedge, before, total, by_point):
        s = self.s

        def E(h):
            return h if h < s.real and s.origin[h] < V else None

        def same(a, b):
            return a in self.kept and b in self.kept and self.kept[a].codes == self.kept[b].codes

        stencil = stencil_of(s, wedge, E, same)
        if stencil.neighbour is None:
            stencil.neighbour = before
        E_, spread = self.expected.finished(*(total if total is not None else self.expected.sum_of(wedge)))
        twin = by_point.get(s.point[wedge[0]]) if total is not None else None
        self.element(wedge[0], stencil, E_, spread, twin, ordered=False)
        by_point[s.point[wedge[0]]] = wedge[0]
        for h in wedge[1:]:
            self.kept[h] = self.kept[wedge[0]]

    # --- one element

    def element(self, key, stencil, E, spread, twin=None, ordered=True):
        e = Kept()
        neighbours = [self.kept[n] for n in stencil.neighbours(self.before)]
        e.E, e.S = E, half(clamp(spread, 1 / 4096, 1e30) if spread == spread else 1 / 4096)
        same = None
        if twin is not None and self.bit_after_last_two("Twin"):
            same = self.kept[twin]
        if same is None and self.flags & REPEATS and neighbours:
            near, r = None, None
            for n in neighbours:
                product = dot(unit(n.E), unit(E))
                if r is None or product > r:
                    near, r = n, product
            r = -2.0 if r != r else r
            if self.bit_after_last_two("Repeat", (2 - half(clamp(1 - r, 1e-16, 2.0))) // 7):
                same = near
        if same is not None:
            e.repeat(same)
        else:
            self.components(e, neighbours, E)
        self.kept[key] = e
        self.before = key
        if ordered:
            self.order.append(key)

    def components(self, e, neighbours, E):
        error, class_, completion = 0, 11, 0
        n = len(neighbours)
        if n:
            error, S, completion = (sum(getattr(x, name) for x in neighbours) // n for name in ("error", "S", "completion"))
            class_ = clamp(e.S - S + 11 >> 1, 0, 10)
        Q = ZERO
        for x in neighbours:
            Q = plus(Q, x.vector if E == ZERO else sub(x.vector, x.E))
        Q = times(Q, 1 / n) if n else Q
        P = Q if E == ZERO else plus(E, Q) if self.flags & FOLLOWS else E
        if self.flags & UNIT:
            P = unit(P)
        P = [x if math.isfinite(x) else 0.0 for x in P]
        if self.flags & UNIT and not any(P):
            P = [0.0, 0.0, 1.0]
        if self.steps:
            self.octahedron(e, P, error, class_)
        else:
            self.three(e, P, error, class_, completion, neighbours)

    def octahedron(self, e, P, error, class_):
        V = unit(P)
        h = abs(V[0]) + abs(V[1]) + abs(V[2])
        steps = self.steps

        def out(c):
            i, j = c
            return [wrap((-1 if i < 0 else 1) * (steps - abs(j)), 32), wrap((-1 if j < 0 else 1) * (steps - abs(i)), 32)]

        expected = [int(math.floor(divide(x, h) * steps + 0.5)) if h else 0 for x in V[:2]]
        residuals = [self.residuals.read(k, max(error, 0), class_, 32) for k in range(2)]
        codes = [wrap(x + r, 32) for x, r in zip(expected, residuals)]
        e.codes = tuple(out(codes) if V[2] < 0 else codes)
        e.error, e.completion = max(halves(abs(r)) for r in residuals), 0
        e.vector = octahedral(*e.codes, steps)
        e.bits = [int(np.array(x, self.array.dtype).view("u" + self.array.dtype[1])) for x in e.vector]

    def three(self, e, P, error, class_, completion, neighbours):
        P0, unit_ = list(P), self.flags & UNIT
        last = largest(P) if unit_ else 2
        first, second = (last + 1) % 3, (last + 2) % 3
        codes = [0, 0, 0]
        codes[first], changes = self.component(0, first, P[first], error, class_, neighbours)
        x = self.maps[first].number(codes[first])
        if unit_:
            rest = P[second] * P[second] + P[last] * P[last]
            if 1 - x * x > 0 and rest > 0:
                scale = math.sqrt((1 - x * x) / rest)
                P[second], P[last] = P[second] * scale, P[last] * scale
        found = max(half(clamp_nan(abs(x - P0[first]), 1e-30, 1e30)), self.least)
        if changes:
            error = error + found + 1 >> 1 if found > error else 3 * error + found + 2 >> 2
        codes[second], _ = self.component(1, second, P[second], error, class_, neighbours)
        y = self.maps[second].number(codes[second])
        e.completion = 0
        if unit_:
            codes[last], residual = self.last_of_unit(last, first, second, P, x, y, error, completion)
            e.completion = halves(abs(residual))
        else:
            codes[last], _ = self.component(2, last, P[last], error, class_, neighbours)
        e.codes = tuple(codes)
        numbers = [m.number(c) for m, c in zip(self.maps, codes)]
        e.vector = tuple(v if math.isfinite(v) else 0.0 for v in numbers)
        e.error = max(half(clamp_nan(max(abs(v - p) for v, p in zip(numbers, P0)), 1e-30, 1e30)), self.least)
        e.bits = [m.stored(c, self.array.dtype) for m, c in zip(self.maps, codes)]

    def step(self, k, p):
        """Twice the logarithm of the map's step at p."""
        m = self.maps[k]
        if m.kind == 1 and not m.has_table:
            return 2 * (half(max(abs(p), 1e-37)) // 2) - 2 * (52 if self.f64 else 23)
        return half(clamp_nan(m.step_at(p), 1e-37, 1e37))

    def component(self, place, k, p, error, class_, neighbours):
        """The code, and whether the error changes by it."""
        m, q = self.maps[k], self.sequence
        if m.kind == 1 and not m.has_table:
            apart = half(clamp(abs(p), 1e-37, 1e37)) - error
            sign = math.copysign(1.0, p) < 0
            if apart < 14:
                z = 0
                for n in neighbours:
                    z |= 2 if n.vector[k] == 0 else 1
                if q.bit(self.models["Zero"][clamp(apart + 17, 0, 31) // 2, z]):
                    code = neighbours[0].codes[k] if neighbours else None
                    c = {0: 1, -1: 2}.get(code, 0) + 3 * sign
                    return (-1 if q.bit(self.models["ZeroSign"][c]) else 0), False
            if apart < 2:
                same = q.bit(self.models["SmallSign"][clamp(apart + 13, 0, 15)])
                base = (error >> 1) + 3 + (1023 if self.f64 else 127)
                d = q.symbol(self.exponents[12 * place + class_])
                exponent = base - d if d < 15 else q.raw(11 if self.f64 else 8)
                if self.f64:
                    mantissa = q.raw(20) << 32
                    number = (int(sign == (not same)) << 63) | (exponent & 2047) << 52 | mantissa | q.raw(32)
                else:
                    number = (int(sign == (not same)) << 31) | (exponent & 255) << 23 | q.raw(23)
                size = 64 if self.f64 else 32
                return wrap(number, size) if number >> size - 1 == 0 else wrap(number ^ (1 << size - 1) - 1, size), True
        residual = self.residuals.read(place, max(error - self.step(k, p) + 2, 0), class_, m.code_size)
        return wrap(m.code(p) + residual, m.code_size), True

    def last_of_unit(self, last, first, second, P, x, y, error, completion):
        apart = half(clamp(abs(P[last]), 1e-37, 1e37)) - error
        same = self.sequence.bit(self.models["Side"][clamp(apart + 2, 0, 15)])
        left = math.sqrt(max(1 - x * x - y * y, 0.0)) if x == x and y == y else 0.0
        prediction = -left if (P[last] < 0) != (not same) else left
        sizes = [half(clamp_nan(abs(v), 1e-30, 2.0)) + self.step(k, v) for k, v in ((first, x), (second, y))]
        t = max(sizes) - half(max(left, 1e-30))
        m = self.maps[last]
        residual = self.residuals.read(2, clamp(t - self.step(last, left) + 2, 0, 60), min(completion, 11), m.code_size)
        return wrap(m.code(prediction) + residual, m.code_size), residual


def clamp_nan(x, low, high):
    return low if x != x else clamp(x, low, high)


# --- 13.7


class Twins:
    """Twins of half-edges and of loose nodes, and the points of the mesh that they become."""

    def __init__(self, stream, patch):
        s = self.s = patch.surface
        self.sequence, self.joined_models, self.last = CodedSequence(stream), bits(), 0
        self.new, self.old = bits(), bits()
        self.count = [0] * patch.points  # twins that came up at each point
        expected = Expected(patch, 0, 0)
        block = patch.fans.block
        self.of = [None] * s.real
        for V in range(len(s.corner)):
            ring = s.ring(V)

            def decide(h, g):
                a, b = s.previous[h], s.next[g]
                far = 0 if s.origin[a] >= V else 1 if self.of[a] == self.of[b] else 2
                context = block[s.face[h]] != block[s.face[g]], far, expected.sharpness(h, g) - 1, self.last
                bit = self.sequence.bit(self.joined_models[context])
                self.last = 2 * self.last % 4 + bit
                return bit

            for wedge in ring_wedges(s, ring, cut_ring(s, ring, decide)):
                twin = self.twin(s.point[wedge[0]])
                for h in wedge:
                    self.of[h] = twin
        self.loose = [self.twin(p) for cells in patch.fans.loose for _, nodes in cells for p in nodes]
        self.sequence.end()
        self.first = [0]
        for n in self.count:
            self.first.append(self.first[-1] + max(n, 1))

    def twin(self, p):
        n = self.count[p]
        if n > 0 and not self.sequence.bit(self.new[min(n, 4) - 1]):
            k = 0
            for i in range((n - 1).bit_length() - 1, -1, -1):
                k += self.sequence.bit(self.old[i]) << i
            return p, min(k, n - 1)
        self.count[p] += 1
        return p, n

    def point(self, twin):
        return self.first[twin[0]] + twin[1]
