"""Sections 13.3 to 13.5 and 13.7 of docs/format.md: normals that positions foretell, and twins."""
import math
from collections import defaultdict
from types import SimpleNamespace
import numpy as np
from around import exceptions, put_exceptions
from container import clamp, wrap
from description import CELLS, CORNERS, POINTS, TWINS
from entropy import CodedSequence
from maps import Map, dot, half, octahedral

UNIT, SUMMED, INWARD, FOLLOWS, REPEATS, WELDED = (1 << i for i in range(6))
ZERO = np.zeros(3)
NOTHING = ZERO, 0.0  # a sum and its L, or an expected vector and its spread

def cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])

def length(a): return np.sqrt(dot(a, a))

def unit(v):
    m = np.abs(v).max()
    return v / m / length(v / m) if 1e-300 < m < 1e300 else ZERO

def axes(v):
    """The other two axes, and that of the largest component."""
    last = max((2, 0, 1), key=lambda k: abs(v[k]))
    return (last + 1) % 3, (last + 2) % 3, last

def area(places):
    """The sum of cross products of a face."""
    c, *others = places
    return sum((cross(a - c, b - c) for a, b in zip(others, others[1:])), ZERO)

def halves(s):
    n = s.bit_length()
    return s if s < 2 else 2 * n - 2 + (s >> n - 2 & 1)

def angle(a, b):
    s, d = length(cross(a, b)), np.sqrt(dot(a, a) * dot(b, b)) + dot(a, b)
    if not d > 0:
        return 3.14159265358979312 if s > 0 or dot(a, b) < 0 else 0.0
    x, y = s / d, 0.0
    for _ in range(3):
        x = x / (1 + np.sqrt(1 + x * x))
    for n in range(23, 0, -2):
        y = 1 / n - (x * x) * y
    return 2 * (8 * x * y)

# --- 13.3: what is around an element

def neighbours(s, corners, E, same, neighbour=None):
    """Elements of the stencil's parallelograms, or its neighbour."""
    pairs = []
    for h in corners:
        i, j = s.next[h], s.previous[h]
        a, b, across = E(i), E(j), None
        neighbour = b if b is not None else a if a is not None else neighbour
        if a is not None and b is not None:
            if s.size(h) > 3:
                across = E(s.next[i])
            elif same(s.opposite[i], j) and same(s.next[s.opposite[i]], i):
                across = E(s.previous[s.opposite[i]])
        elif s.size(h) > 3 and a is not None and E(s.next[i]) is not None:
            o, b = s.opposite[i], a
            across = E(s.next[s.next[o]]) if same(s.next[o], i) else None
        elif s.size(h) > 3 and b is not None and E(s.previous[j]) is not None:
            o, a = s.opposite[s.previous[j]], b
            across = E(s.previous[o]) if same(o, j) else None
        if across is not None:
            pairs.append((a, b))
    return list(dict.fromkeys(x for pair in pairs[:5] for x in pair)) or ([] if neighbour is None else [neighbour])

def wedges(s, ring, decide):
    """The ring of a vertex cut into wedges: decide(h, g) tells where the text asks whether two corners are joined."""
    joined, cuts, n = [], 0, len(ring)
    for k, h in enumerate(ring):
        g, last = ring[(k + 1) % n], k == n - 1
        adjacent = s.turn(h) == g
        joined.append(bool(adjacent and (not last or cuts >= 2) and decide(h, g)))
        if not last and not joined[-1]:
            cuts += 1 if adjacent else 2
    start = max([k + 1 for k in range(n - 1) if not joined[k]], default=0) if joined[-1] else 0
    made = [[]]
    for k in (*range(start, n), *range(start)):
        made[-1].append(ring[k])
        if not joined[k]:
            made.append([])
    return [wedge for wedge in made if wedge]

class Expected:
    """13.5: the vectors that positions foretell, and their spreads."""

    def __init__(self, patch, weight, flags):
        self.s, self.weight, self.flags = patch.surface, weight, flags
        self.at = [patch.numbers[p] if p is not None else None for p in self.s.point]  # by half-edge
        self.face_normals = [self.face_normal(f) for f in range(len(self.s.faces))]

    def face_normal(self, f):
        n = area([self.at[h] for h in self.s.corners(f)])
        return n * -1.0 if self.s.flipped[f] else n

    def sum_of(self, corners):
        total, L = NOTHING
        for h in corners if self.weight < 4 else []:
            n, own = self.face_normals[self.s.face[h]], self.at[h]
            l, a, b = length(n), self.at[self.s.next[h]] - own, self.at[self.s.previous[h]] - own
            product = dot(a, a) * dot(b, b)
            g = (1.0, 1 / l, angle(a, b) / l, 1 / product if product else 0.0)[self.weight] if l > 0 else 0.0
            total, L = (total + n * g, L + l * g) if l > 0 else (total, L)
        return total, L

    def finished(self, total, L):
        return self.directed(total), np.sqrt(max(L - length(total), 0.0) / L) if L else 0.0

    def directed(self, v):
        v = v * -1.0 if self.flags & INWARD else v
        return v if self.flags & SUMMED else unit(v)

    def of_face(self, f):
        if self.weight == 4:
            return NOTHING
        n, corners = self.face_normals[f], self.s.corners(f)
        edges = [self.at[self.s.next[h]] - self.at[h] for h in corners]
        l, m, size = max(dot(e, e) for e in edges), max(dot(self.at[h], self.at[h]) for h in corners), length(n)
        return self.directed(n), np.sqrt(l) * np.sqrt(m) / size if size else 0.0

    def sharpness(self, h, g):
        n, m = self.face_normals[self.s.face[h]], self.face_normals[self.s.face[g]]
        product = length(n) * length(m)
        c = dot(n, m) / product if product else 1.0
        return 1 + sum(1 - c > limit for limit in (1e-6, 0.01, 0.1, 0.5)) if self.weight < 4 else 0

class Normals:
    """An array of coding 8 in a patch. `values` are by point, face or half-edge, then the rest."""

    def __init__(self, fields, array, patch):
        self.array, self.patch, self.s = array, patch, patch.surface
        octahedron, weight, self.flags = fields.u8(), fields.u8(), fields.u8()
        self.steps = fields.count() if octahedron else None
        self.maps = [] if octahedron else [Map(fields, array.type) for _ in range(3)]
        found = exceptions(fields.section(), array.dtype)
        self.q, self.f64 = CodedSequence(fields.rest()), array.dtype == "f8"
        self.kept, self.before, self.expected = {}, None, Expected(patch, weight, self.flags)
        order = {POINTS: self.points, CELLS: self.cells, CORNERS: self.corners, TWINS: self.corners}[array.domain]()
        made = np.array([self.kept[i].bits for i in order], array.of_bits).reshape(-1, 3).view(array.dtype)
        put_exceptions(made, found)
        self.values = made[np.argsort(order)]

    # --- elements by domain, each giving the order for exceptions

    def point_sums(self):
        own = defaultdict(list)
        for h in range(self.s.real):
            own[self.s.point[h]].append(h)
        return [self.expected.sum_of(own[p]) for p in range(self.patch.points)]

    def points(self):
        s, sums, welded, places = self.s, self.point_sums(), self.flags & WELDED, defaultdict(list)
        twin = [None] * len(sums)
        for p in range(len(sums)) if welded else []:
            places[tuple(self.patch.numbers[p])].append(p)
        for group in places.values():
            whole = sum((sums[p][0] for p in group), ZERO), sum(sums[p][1] for p in group)
            for p, before in zip(group, [None] + group):
                sums[p], twin[p] = whole, before
        order = sorted(range(len(sums)), key=lambda p: not s.vertices_of[p])
        for p in order:
            V = s.vertices_of[p][0] if s.vertices_of[p] else None

            def E(h): return s.point[h] if s.origin[h] is not None and s.origin[h] < V else None

            around = [] if V is None else neighbours(s, s.around[V], E, lambda a, b: True)
            self.element(p, around, self.expected.finished(*sums[p]) if V is not None or welded else NOTHING, twin[p])
        return order

    def cells(self):
        s, n = self.s, len(self.s.faces)
        order = range(n + len(self.patch.loose))
        for f in order:
            lower = [m for m in (s.face[s.opposite[h]] for h in s.corners(f)) if m < f] if f < n else []
            self.element(f, list(dict.fromkeys(lower[:5])), self.expected.of_face(f) if f < n else NOTHING)
        return order

    def corners(self):
        s, twins, order, kept = self.s, None, [], self.kept
        if self.array.domain == TWINS:
            twins = self.patch.made_twins.of + self.patch.made_twins.loose
        sums = self.point_sums() if twins and self.flags & WELDED else None
        first, by_point = {}, {}  # corners with which twins came up, and the last of each point

        def come_up(corners):
            for h in corners if twins else []:
                first.setdefault(twins[h], h)
            order.extend(corners)

        def same(a, b): return a in kept and b in kept and kept[a].codes == kept[b].codes

        for V in range(len(s.around)):

            def E(h): return h if h < s.real and s.origin[h] < V else None

            def joined(h, g):
                if twins and (twins[h] == twins[g] or twins[h] in first and twins[g] in first):
                    return twins[h] == twins[g] or same(first[twins[h]], first[twins[g]])
                a, b = s.previous[h], s.next[g]
                far = 0 if s.origin[a] >= V else 1 if same(a, b) else 2
                return self.q.bit_by_last_two("Joined", far, self.expected.sharpness(h, g))

            ring, before = s.ring(V), None
            for wedge in wedges(s, ring, joined):
                head, p = wedge[0], s.point[wedge[0]]
                known = next((first[twins[h]] for h in wedge if twins[h] in first), None) if twins else None
                if known is None:
                    sum_ = sums[p] if sums else self.expected.sum_of(wedge)
                    around = neighbours(s, wedge, E, same, before)
                    self.element(head, around, self.expected.finished(*sum_), by_point.get(p) if sums else None)
                    by_point[p] = known = head
                kept.update((h, kept[known]) for h in wedge)
                come_up(wedge)
                before = head
            order[len(order) - len(ring) :] = ring
        for h in range(s.real, s.real + sum(len(nodes) for _, nodes in self.patch.loose)):
            if twins and twins[h] in first:
                kept[h] = kept[first[twins[h]]]
            else:
                self.element(h, [], NOTHING)
            come_up([h])
        return order

    # --- one element

    def element(self, key, around, expected, twin=None):
        E, S = expected[0], half(expected[1], 1 / 4096, 1e30)
        around = around or ([] if self.before is None else [self.before])
        around = [self.kept[n] for n in around]
        same = self.kept[twin] if twin is not None and self.q.bit_by_last_two("Twin") else None
        if not same and self.flags & REPEATS and around:
            near = around[0]
            for n in around[1:]:
                near = n if dot(unit(n.E), unit(E)) > dot(unit(near.E), unit(E)) else near
            r = 1 - dot(unit(near.E), unit(E))
            apart = half(2.0 if r != r else r, 1e-16, 2.0)
            same = near if self.q.bit_by_last_two("Repeat", (2 - apart) // 7) else None
        e = SimpleNamespace(**{**(vars(same) if same else {}), "E": E, "S": S})
        if not same:
            self.components(e, around, E)
        self.kept[key], self.before = e, key

    def components(self, e, around, E):
        error, class_, completion, n = 0, 11, 0, len(around)
        if n:
            error, S, completion = (sum(vars(x)[name] for x in around) // n for name in ("error", "S", "completion"))
            class_ = clamp(e.S - S + 11 >> 1, 0, 10)
        Q = sum((term for x in around for term in ((x.vector, -x.E) if E.any() else (x.vector,))), ZERO)
        Q = Q * (1 / max(n, 1))
        P = Q if not E.any() else E + Q if self.flags & FOLLOWS else E
        P = unit(P) if self.flags & UNIT else P
        P = np.where(np.isfinite(P), P, 0.0)
        if self.flags & UNIT and not P.any():
            P = np.array([0.0, 0.0, 1.0])
        if self.steps:
            self.octahedron(e, P, error, class_)
        else:
            self.three(e, P, error, class_, completion, around)

    def octahedron(self, e, P, error, class_):
        V, steps = unit(P), self.steps
        h = abs(V[0]) + abs(V[1]) + abs(V[2])
        expected = (math.floor(x / h * steps + 0.5) if h else 0 for x in V[:2])
        residuals = [self.q.residual(k, max(error, 0), class_, 32) for k in range(2)]
        i, j = codes = tuple(wrap(x + r, 32) for x, r in zip(expected, residuals))
        if V[2] < 0:  # turned out
            codes = tuple(wrap((-1 if a < 0 else 1) * (steps - abs(b)), 32) for a, b in ((i, j), (j, i)))
        e.codes, e.error, e.completion = codes, max(halves(abs(r)) for r in residuals), 0
        e.vector = np.array(octahedral(*e.codes, steps))
        e.bits = e.vector.astype(self.array.dtype).view(self.array.of_bits)

    def three(self, e, P, error, class_, completion, around):
        P0, codes, unit_, least = P.copy(), [0, 0, 0], self.flags & UNIT, -128 if self.f64 else -68
        (first, second, last), e.completion = axes(P) if unit_ else (0, 1, 2), 0
        codes[first], changes = self.component(0, first, P[first], error, class_, around)
        x = self.number(first, codes[first])
        rest = P[second] * P[second] + P[last] * P[last]
        if unit_ and 1 - x * x > 0 and rest > 0:
            P[[second, last]] *= np.sqrt((1 - x * x) / rest)
        found = max(half(abs(x - P0[first]), 1e-30, 1e30), least)
        if changes:
            error = error + found + 1 >> 1 if found > error else 3 * error + found + 2 >> 2
        codes[second], _ = self.component(1, second, P[second], error, class_, around)
        if unit_:
            y = self.number(second, codes[second])
            codes[last], residual = self.last_of_unit((first, second, last), P, x, y, error, completion)
            e.completion = halves(abs(residual))
        else:
            codes[last], _ = self.component(2, last, P[last], error, class_, around)
        numbers = [self.number(k, c) for k, c in enumerate(codes)]
        e.codes, e.vector = tuple(codes), np.where(np.isfinite(numbers), numbers, 0.0)
        e.error = max(half(max(abs(v - p) for v, p in zip(numbers, P0)), 1e-30, 1e30), least)
        e.bits = [m.stored(c, self.array.dtype) for m, c in zip(self.maps, e.codes)]

    def number(self, k, c): return self.maps[k].value(c) if self.maps[k].kind in (5, 6) else self.maps[k].number(c)

    def step(self, k, p):
        """Twice the logarithm of the map's step at p."""
        m = self.maps[k]
        if m.kind == 1 and not m.has_table:
            return 2 * (half(max(abs(p), 1e-37)) // 2) - 2 * (52 if self.f64 else 23)
        return half(m.step_at(p), 1e-37, 1e37)

    def component(self, place, k, p, error, class_, around):
        """The code, and whether the error changes by it."""
        m, q, apart = self.maps[k], self.q, half(abs(p), 1e-37, 1e37) - error
        if m.kind == 1 and not m.has_table:
            sign = math.copysign(1.0, p) < 0
            z = any(n.vector[k] != 0 for n in around) + 2 * any(n.vector[k] == 0 for n in around)
            if apart < 14 and q.bit("Zero", clamp(apart + 17, 0, 31) // 2, z):
                code = around[0].codes[k] if around else None
                return -q.bit("ZeroSign", {0: 1, -1: 2}.get(code, 0) + 3 * sign), False
            if apart < 2:
                negative = sign == (not q.bit("SmallSign", clamp(apart + 13, 0, 15)))
                width, mantissa = (11, 52) if self.f64 else (8, 23)
                d = q.symbol("Exponent", place, class_)
                exponent = ((error >> 1) + 3 + 2 ** (width - 1) - 1 - d if d < 15 else q.raw(width)) % 2**width
                bits_ = exponent << mantissa | (q.raw(20) << 32 | q.raw(32) if self.f64 else q.raw(23))
                return bits_ ^ -1 if negative else bits_, True
        residual = q.residual(place, max(error - self.step(k, p) + 2, 0), class_, m.code_size)
        return wrap(m.code(p) + residual, m.code_size), True

    def last_of_unit(self, places, P, x, y, error, completion):
        first, second, last = places
        m, apart = self.maps[last], half(abs(P[last]), 1e-37, 1e37) - error
        same = self.q.bit("Side", clamp(apart + 2, 0, 15))
        left = math.sqrt(max(1 - x * x - y * y, 0.0)) if x == x and y == y else 0.0
        prediction = -left if (P[last] < 0) != (not same) else left
        t = max(half(abs(v), 1e-30, 2.0) + self.step(k, v) for k, v in ((first, x), (second, y)))
        expected = clamp(t - half(max(left, 1e-30)) - self.step(last, left) + 2, 0, 60)
        residual = self.q.residual(2, expected, min(completion, 11), m.code_size)
        return wrap(m.code(prediction) + residual, m.code_size), residual

class Twins:
    """13.7: twins, as (point, which), of half-edges and of loose nodes, and the points that they become."""

    def __init__(self, stream, patch):
        s, q, block = patch.surface, CodedSequence(stream), patch.fans.block
        self.q, self.count = q, [0] * patch.points  # twins that came up at each point
        self.of, expected = [None] * s.real, Expected(patch, 0, 0)
        for V in range(len(s.around)):

            def joined(h, g):
                a, b, apart = s.previous[h], s.next[g], block[s.face[h]] != block[s.face[g]]
                far = 0 if s.origin[a] >= V else 1 if self.of[a] == self.of[b] else 2
                return q.bit_by_last_two("Joined", apart, far, expected.sharpness(h, g))

            for wedge in wedges(s, s.ring(V), joined):
                twin = self.twin(s.point[wedge[0]])
                for h in wedge:
                    self.of[h] = twin
        self.loose = [self.twin(p) for _, nodes in patch.loose for p in nodes]
        self.first = np.cumsum([0] + [max(n, 1) for n in self.count]).tolist()

    def twin(self, p):
        n = self.count[p]
        if n > 0 and not self.q.bit("New", min(n, 4)):
            k = sum(self.q.bit("Old", i) << i for i in reversed(range((n - 1).bit_length())))
            return p, min(k, n - 1)
        self.count[p] += 1
        return p, n

    def point(self, twin): return self.first[twin[0]] + twin[1]
