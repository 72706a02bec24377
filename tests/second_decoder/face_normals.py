"""Section 13.6 of docs/format.md: normals of faces, computed from corners that may have been rounded."""
import math
from types import SimpleNamespace
import numpy as np
from around import exceptions, put_exceptions
from container import clamp, wrap
from entropy import CodedSequence
from maps import Map, dot, half, real
from normals import ZERO, area, axes, cross, length

CROSS32, LENGTH32, RECIPROCAL, FIRST, SECOND, SWAPPED, NEGATED = (1 << i for i in range(7))
LEARNS, UNIT, SIGNED_ZEROS = 4, 8, 16

def class_(h, first, per, n): return clamp(int((h - first) / per), 0, n - 1)
def is_unit(v): return bool(abs(dot(v, v) - 1) < 0.02)
def combined(ways): return sum(set(ways))

def normal_of(places, P):
    """m, t and cov of the text, if there are such; P by corner and axis, twice."""
    S, n = area(places), range(len(places))
    l = length(S)
    if not 1e-100 < l < 1e100:
        return None
    m = S * (1 / l)
    t = [cross(m, places[(i + 1) % len(n)] - places[i - 1]) * (1 / l) for i in n]
    h = [[sum(m[a] * dot(P[i, a, j], m) for a in range(3)) for j in n] for i in n]
    return m, t, sum((np.outer(t[i] * h[i][j], t[j]) for i in n for j in n), np.zeros((3, 3)))

class FaceNormals:
    """An array of coding 9 in a patch. `values` are by face, then of loose cells."""

    def __init__(self, fields, array, patch):
        _, self.formula, self.how, scale = fields.numbers("BBBh")
        self.maps, self.s, self.at = [Map(fields, array.type) for _ in range(3)], patch.surface, patch.numbers
        replaced, self.q = exceptions(fields.section(), array.dtype), CodedSequence(fields.rest())
        self.h, self.kept, self.places, self.count = 0, [], {}, len(self.s.faces) + len(patch.loose)
        odd = sum(bool(self.formula & flag) for flag in (FIRST, SECOND, SWAPPED, NEGATED)) % 2
        self.side, self.U = -1.0 if odd else 1.0, self.unit(0, 0.6)
        self.round_corners(2.0 ** (scale >> 1) * (1.5 if scale % 2 else 1), (1, 2, 10)[self.how & 3])
        cells = [[m.stored(c, array.dtype) for m, c in zip(self.maps, self.cell(f))] for f in range(self.count)]
        self.values = np.array(cells, array.of_bits).reshape(-1, 3).view(array.dtype)
        put_exceptions(self.values, replaced)

    def round_corners(self, H, base):
        L = max(np.minimum(np.abs(self.at), 1e30).max(initial=0), 1e-30)

        def s(x):
            power = 1.0
            while base > 1 and power * base <= x:
                power *= base
            while base > 1 and power > x:
                power /= base
            return H * power

        steps = ([s(clamp(abs(x), L / 65536, L)) for x in p] for p in self.at)
        self.moved, self.covariance = np.zeros_like(self.at), [np.diag([x * x / 12 for x in p]) for p in steps]

    # --- numbers and codes

    def unit(self, k, x):
        c = self.maps[k].code(x)
        u = abs(float(self.maps[k].number(c + 1)) - float(self.maps[k].number(c)))
        return u if 1e-60 < u < 1e60 else 1e-60

    def without_signs(self, codes):
        """With +0 in place of -0."""
        return tuple(m.code(0.0) if m.number(c) == 0 else c for m, c in zip(self.maps, codes))

    def near(self, v): return self.without_signs(m.code(float(x)) for m, x in zip(self.maps, v))
    def numbers(self, codes): return np.array([m.number(c) for m, c in zip(self.maps, codes)], "f8")

    def turned(self, codes, signs):
        """With the numbers of some components negated."""
        def negated(m, c): return -1 - c if m.kind in (1, 5, 6) and not m.has_table else m.code(-float(m.number(c)))
        triples = zip(self.maps, codes, (1, 2, 4))
        return self.without_signs(negated(m, c) if signs & bit else c for m, c, bit in triples)

    # --- one cell

    def cell(self, f):
        """Its codes."""
        s, own, self.corners, halves = self.s, SimpleNamespace(number=f, base=None, way=2), [], []
        if f < len(s.faces):
            self.corners = halves = s.corners(f)
            if s.flipped[f]:
                self.corners, halves = [self.corners[0]] + self.corners[:0:-1], self.corners[::-1]
        self.points, self.own = [s.point[h] for h in self.corners], own
        self.corner_places = [self.at[p] for p in self.points]
        beside = [(i, s.opposite[h]) for i, h in enumerate(halves) if s.face[s.opposite[h]] < f]
        beside = [(i, self.kept[s.face[o]], o) for i, o in beside]
        self.near_edges, self.beside = [(i, x) for i, x, _ in beside], [x for _, x, _ in beside]
        based = [edge for edge in beside if edge[1].base is not None]
        self.entry, x, o = max(based or beside, key=lambda edge: edge[1].number, default=(0, None, None))
        self.state = 0 if not based else 1 if x.base == o else 2 if x.base == s.next[o] else 3
        self.C = self.computed(self.corner_places)
        self.C0 = self.C[0] if self.C else ZERO  # which is no unit vector
        own.signs = sum(1 << k for k in range(3) if self.C0[k] < 0)
        self.estimate()
        own.codes = codes = self.by_others() or self.components()
        numbers = self.numbers(codes)
        own.vector = np.where(np.isfinite(numbers), numbers, 0.0)
        own.error = half(self.dist(own.vector) + 0.001)
        signed = self.signs_of_zeros(codes) if self.how & SIGNED_ZEROS and (numbers == 0).any() else codes
        if is_unit(self.C0):
            place = self.place()
            place[1:] = [own] + [x for x in place[1:] if self.turned(x.codes, x.signs ^ own.signs) != codes][:2]
        self.kept.append(own)
        if self.how & LEARNS and is_unit(own.vector) and len(self.points) in (3, 4):
            self.learn(own.vector)
        return signed

    def computed(self, at):
        """C, for each corner of a triangle, or one."""
        if len(at) != 3:
            S = area(at) if at else ZERO
            return [S * (self.side / length(S))] if 0 < length(S) < math.inf else []
        made, has = [], lambda flag: self.formula & flag
        for i in range(3):
            a, b, c = (at[(i + j) % 3].astype("f4" if has(CROSS32) else "f8") for j in range(3))
            u, v = a - b if has(FIRST) else b - a, a - c if has(SECOND) else c - a
            n = (cross(v, u) if has(SWAPPED) else cross(u, v)).astype("f4" if has(LENGTH32) else "f8")
            l = length(n)
            n = np.zeros(3) if not 0 < l < math.inf else n * (1 / l) if has(RECIPROCAL) else n / l
            made.append((-n if has(NEGATED) and 0 < l < math.inf else n).astype("f8"))
        return made

    # --- estimates

    def rounded(self):
        """Places, and their covariances by corner and axis, twice."""
        P = np.zeros((len(self.points), 3) * 2)
        for i, p in enumerate(self.points):
            P[i, :, i] = self.covariance[p]
        return np.array([self.at[p] + self.moved[p] for p in self.points]), P

    def estimate(self):
        """M and cov."""
        found = None
        if len(self.points) in (3, 4):
            places, P = self.rounded()
            for i, near in self.near_edges if self.how & LEARNS else []:
                if is_unit(near.vector):
                    self.lean(places, P, i, near.vector * self.side)
            found = normal_of(places, P)
        if found:
            self.M, self.cov = found[0] * self.side, found[2]
        else:
            vectors = self.C[:1] + [x.vector for x in self.kept[-1:]] + [np.array([0.0, 0.0, 1.0])]
            self.M, self.cov = next(v for v in vectors if is_unit(v)), 1e-4 * np.eye(3)

    def lean(self, places, P, i, n):
        """Moves places so that the edge from corner i is at a right angle to a normal."""
        j = (i + 1) % len(places)
        d, e = P[:, :, j] - P[:, :, i], places[j] - places[i]
        r, w = n[0] * d[..., 0] + n[1] * d[..., 1] + n[2] * d[..., 2], dot(e, e) * (self.U * self.U / 12)
        for a in range(3):
            w += n[a] * (r[j, a] - r[i, a])
        if 1e-280 < w < 1e280:
            places += r * (-dot(n, e) / w)
            P -= np.multiply.outer(r / w, r)

    def learn(self, V):
        """Moves the points of a face by the normal that it has."""
        places, P = self.rounded()
        m, t, cov = normal_of(places, P) or (ZERO, [], np.zeros((3, 3)))
        a, b, _ = axes(m)
        u, v = (max(self.unit(k, V[k]), 0.1 * self.U) for k in (a, b))
        aa, bb, ab = cov[a][a] + u * u / 12, cov[b][b] + v * v / 12, cov[a][b]
        d, (x, y) = aa * bb - ab * ab, (V * self.side - m)[[a, b]]
        if not 1e-280 < d < 1e280:
            return
        f, g = (bb * x - ab * y) / d, (aa * y - ab * x) / d
        for i, (p, (ta, tb)) in enumerate(zip(self.points, (own[[a, b]] for own in t))):
            q = np.array([dot(row, m) for row in P[i, :, i]])
            self.moved[p] += q * (ta * f + tb * g)
            k = (bb * ta * ta - 2 * ab * ta * tb + aa * tb * tb) / d
            self.covariance[p] = P[i, :, i] - np.outer(q, q) * k

    def dist(self, v):
        (a, b, _), cov, uu = axes(self.M), self.cov, self.U * self.U
        x, y, aa, bb, ab = v[a] - self.M[a], v[b] - self.M[b], cov[a][a] + uu, cov[b][b] + uu, cov[a][b]
        least = 0.01 * self.U * self.U * (aa + bb)
        d = (x * x * bb - 2 * x * y * ab + y * y * aa) / max(aa * bb - ab * ab, least)
        return clamp(real(float(d)), 0.0, 1e30)

    # --- what its tuple is

    def by_others(self):
        """The codes, if they are those computed, or of a neighbour or of a cell of this direction."""
        q, near = self.q, self.beside
        trace = clamp(real(self.cov[0][0] + self.cov[1][1] + self.cov[2][2]), 0.0, 1e60)
        G = class_(half(math.sqrt(trace) / self.U, 1e-9, 1e30), -20, 4, 16)
        computed = [(i, self.near(self.C[i])) for i in self.from_entry()]
        refused = {codes for _, codes in computed}
        if computed and q.bit("Computed", G, combined(x.way for x in near or self.kept[-1:])):
            self.own.way = 1
            return self.choose(computed)
        others = {}
        for x in near:
            others.setdefault(x.codes, x)
        others = [(self.dist(x.vector), codes) for codes, x in others.items() if codes not in refused][:4]
        for i, (d, codes) in enumerate(sorted(others, key=lambda pair: pair[0])):
            if q.bit("Neighbour", class_(half(d + 0.001), -20, 4, 16), i):
                return codes
        return self.recalled(refused | {codes for _, codes in others}) if is_unit(self.C0) else None

    def recalled(self, refused):
        """Codes of a cell of this direction, if they are taken."""
        asked, found = 0, None
        for codes in (self.turned(x.codes, x.signs ^ self.own.signs) for x in self.place()[1:]):
            if found is None and codes not in refused:
                refused.add(codes)
                d = self.dist(self.numbers(codes))
                found = codes if self.q.bit("Recall", asked, class_(half(d + 0.001), -20, 8, 8), self.h) else None
                asked += 1
        self.h = (2 * self.h + (found is not None)) % 4 if asked else self.h
        return found

    def place(self):
        """The key of a direction, and its cells."""
        key = 2**60 + sum(math.floor(abs(x) * 16384 + 0.5) << 20 * (2 - k) for k, x in enumerate(self.C0))
        at = (key * 0x9E3779B97F4A7C15 % 2**64 >> 40) % 2 ** clamp(self.count.bit_length(), 4, 18)
        if self.places.get(at, [None])[0] != key:
            self.places[at] = [key]
        return self.places[at]

    def from_entry(self): return [(self.entry + i) % len(self.C) for i in range(min(3, len(self.C)))]

    def choose(self, by_corner):
        """One of what corners give; may set the base."""
        giving = {}
        for i, what in by_corner:
            giving.setdefault(what, []).append(i)
        n, at = len(giving), self.corner_places
        for i, (what, corners) in enumerate(giving.items()):
            sides = [dot(d, d) for d in (at[k - 2] - at[k - 1] for k in range(3))] if n > 1 else [0] * len(at)
            g = sum(side > sides[corners[0]] for side in sides)
            if i == n - 1 or self.q.bit("Base", self.state, g, i, len(corners) > 1, n - 2):
                self.own.base = self.corners[corners[0]] if n > 1 and len(corners) == 1 else self.own.base
                return what

    def signs_of_zeros(self, codes):
        zeros, of_computed = np.flatnonzero(self.numbers(codes) == 0).tolist(), self.own.way == 1
        corners = [i for i in self.from_entry() if not of_computed or self.near(self.C[i]) == codes]
        given = [(i, tuple(np.signbit(self.C[i][zeros]).tolist())) for i in corners]
        by_corners = given and self.q.bit("Signs", of_computed)
        minus = dict(zip(zeros, self.choose(given) if by_corners else [self.q.bit("Sign") for _ in zeros]))
        return [-1 - c if minus.get(k) else c for k, c in enumerate(codes)]

    # --- components

    def components(self):
        M, cov, near, codes, q = self.M, self.cov, self.beside, [0, 0, 0], self.q
        E = class_(int(sum(x.error for x in near) / len(near)), -9, 2, 9) if near else 9
        a, b, last = axes(M) if self.how & UNIT else (0, 1, 2)

        def number(k, mean, variance, *models):
            codes[k], variance = self.component(k, mean, variance, *models)
            return float(self.maps[k].number(codes[k])), variance

        x, va = number(a, M[a], cov[a][a], "First", E)
        r, w = cov[a][b] / va, 0 if E < 3 else 1 if E < 6 or E == 9 else 2
        z = class_(half(abs(x - M[a]) / math.sqrt(va), 0.05, 100.0), -9, 3, 7)
        y, _ = number(b, M[b] + r * (x - M[a]), cov[b][b] - r * cov[a][b], "Second", z, w)
        mean, variance = M[last], cov[last][last]
        if self.how & UNIT:
            left = math.sqrt(max(1 - x * x - y * y, 0.0))
            l, (s, t) = clamp(left, 1e-6, 1.0), (self.unit(k, v) * self.unit(k, v) / 12 for k, v in ((a, x), (b, y)))
            mean, variance = -left if (mean < 0) != q.bit("Side") else left, (x * x * s + y * y * t) / (l * l)
        number(last, mean, variance, "Third")
        return self.without_signs(codes)

    def component(self, k, mean, variance, *models):
        """Its code, and the variance."""
        q, m, zero = self.q, self.maps[k], bool(self.C and self.C0[k] == 0)
        mean = clamp(mean, -1e30, 1e30) if mean == mean else -1e30
        u = self.unit(k, mean)
        variance = (clamp(variance, 0.0, 1e60) if variance == variance else 0.0) + u * u / 12
        spread = math.sqrt(variance)
        A, o = clamp(abs(mean) / spread, 0.001, 1000.0), combined(2 if x.vector[k] == 0 else 1 for x in self.beside)
        if (zero or not A > 8) and q.bit("Zero", zero, class_(half(A), -8, 2, 8), o):
            return m.code(0.0), variance
        size = half(spread / u, 1e-9, 1e30)
        n = q.offset(*models, class_(size, -4, 1, 8))
        low, high = (m.code(mean + (n + off) * (spread / 2)) for off in (-0.5, 0.5))
        if abs(n) > 4096:
            code = q.raw(32) if m.code_size == 32 else q.raw(32) << 32 | q.raw(32)
        else:
            code = m.code(mean) + n if size <= 2 else low + self.one_of(high - low)
        return wrap(code, m.code_size), variance

    def one_of(self, size):
        if size < 2:
            return 0
        q, r = self.q, max((size - 1).bit_length() - 10, 0)
        v = q.part_of((size - 1 >> r) + 1, 15) << r
        return min(v | (q.raw(32) << r - 32 | q.raw(r - 32) if r > 32 else q.raw(r)), size - 1)
