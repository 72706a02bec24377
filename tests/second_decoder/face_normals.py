"""Section 13.6 of docs/format.md: normals of faces, computed from corners that may have been rounded."""
import math
from types import SimpleNamespace
import numpy as np
from around import exceptions
from container import clamp, wrap
from entropy import CodedSequence
from maps import Map, dot, half, real
from normals import ZERO, area, axes, cross, length

CROSS32, LENGTH32, RECIPROCAL, FIRST, SECOND, SWAPPED, NEGATED = (1 << i for i in range(7))
LEARNS, UNIT, SIGNED_ZEROS = 4, 8, 16

def class_(h, first, per, n): return clamp(int((h - first) / per), 0, n - 1)
def is_unit(v): return bool(abs(dot(v, v) - 1) < 0.02)

class Estimate:
    """The normal (m) of some places with the covariances P, and its covariance; `known`: whether there is one."""

    def __init__(self, places, P):
        S, n, self.P = area(places), len(places), P
        l = length(S)
        self.known = bool(1e-100 < l < 1e100)
        if not self.known:
            return
        self.m = m = S * (1 / l)
        self.t = t = [cross(m, places[(i + 1) % n] - places[i - 1]) * (1 / l) for i in range(n)]
        self.cov = np.zeros((3, 3))
        for i in range(n):
            for j in range(n):
                block = P[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
                h = sum(m[a] * dot(block[a], m) for a in range(3))
                self.cov += np.outer(t[i] * h, t[j])

class FaceNormals:
    """An array of coding 9 in a patch. `values` are by face, then of loose cells."""

    def __init__(self, fields, array, patch):
        flags, self.formula, self.how, scale = fields.numbers("BBBh")
        self.maps, self.s, self.patch = [Map(fields, array.type) for _ in range(3)], patch.surface, patch
        replaced, self.q = exceptions(fields.section(), array.dtype), CodedSequence(fields.rest())
        self.width, self.h, self.kept, self.places = 8 * int(array.dtype[1]), 0, [], {}
        odd = sum(bool(self.formula & flag) for flag in (FIRST, SECOND, SWAPPED, NEGATED)) % 2
        self.side, self.U, self.count = -1.0 if odd else 1.0, self.unit(0, 0.6), len(self.s.faces) + len(patch.loose)
        self.round_corners(scale)
        bits_ = [self.cell(f) for f in range(self.count)]
        self.values = np.array(bits_, array.of_bits).reshape(-1, 3)
        for place, value in replaced.items():
            self.values[place // 3, place % 3] = value
        self.values = self.values.view(array.dtype)

    def round_corners(self, scale):
        at = self.patch.numbers
        H, L = 2.0 ** (scale >> 1) * (1.5 if scale % 2 else 1), max(np.minimum(np.abs(at), 1e30).max(initial=0), 1e-30)

        def s(x, base):
            power, x = 1.0, clamp(abs(x), L / 65536, L)
            while base > 1 and power * base <= x:
                power *= base
            while base > 1 and power > x:
                power /= base
            return H * power

        self.moved, steps = np.zeros_like(at), ([s(x, (1, 2, 10)[self.how & 3]) for x in p] for p in at)
        self.covariance = [np.diag([x * x / 12 for x in p]) for p in steps]

    # --- numbers and codes

    def unit(self, k, x):
        m, c = self.maps[k], self.maps[k].code(x)
        u = abs(float(m.number(c + 1)) - float(m.number(c)))
        return u if 1e-60 < u < 1e60 else 1e-60

    def near(self, v): return tuple(self.plus(k, self.maps[k].code(float(x))) for k, x in enumerate(v))
    def plus(self, k, c): return self.maps[k].code(0.0) if self.maps[k].number(c) == 0 else c
    def numbers(self, codes): return np.array([m.number(c) for m, c in zip(self.maps, codes)], "f8")

    def turned(self, codes, signs):
        """With the numbers of some components negated."""
        def negated(m, c):
            return -1 - c if m.kind in (1, 5, 6) and not m.has_table else m.code(-float(m.number(c)))
        made = (negated(m, c) if signs >> k & 1 else c for k, (m, c) in enumerate(zip(self.maps, codes)))
        return tuple(self.plus(k, c) for k, c in enumerate(made))

    # --- one cell

    def computed(self, at):
        """C, for each corner of a triangle, or one."""
        if len(at) != 3:
            S = area(at)
            l = length(S)
            return [S * (self.side / l)] if 0 < l < math.inf else []
        made, formula = [], self.formula
        for i in range(3):
            a, b, c = (at[(i + j) % 3].astype("f4" if formula & CROSS32 else "f8") for j in range(3))
            u, v = a - b if formula & FIRST else b - a, a - c if formula & SECOND else c - a
            n = cross(v, u) if formula & SWAPPED else cross(u, v)
            n = n.astype("f4") if formula & LENGTH32 else n.astype("f8")
            l = length(n)
            made.append(np.zeros(3) if not 0 < l < math.inf else n * (1 / l) if formula & RECIPROCAL else n / l)
            if formula & NEGATED and 0 < l < math.inf:
                made[-1] = -made[-1]
        return [n.astype("f8") for n in made]

    def cell(self, f):
        """Its bits."""
        s, self.corners, self.halves, self.at = self.s, [], [], []
        if f < len(s.faces):
            self.corners = self.halves = s.corners(f)
            if s.flipped[f]:
                self.corners, self.halves = [self.corners[0]] + self.corners[:0:-1], self.corners[::-1]
            self.at = [self.patch.numbers[s.point[h]] for h in self.corners]
        beside = [(i, s.face[s.opposite[h]]) for i, h in enumerate(self.halves)]
        self.beside = [(i, self.kept[m]) for i, m in beside if m < f]
        based = [x for x in self.beside if x[1].base is not None] or self.beside
        self.entry = max(based, key=lambda x: x[1].number)[0] if based else 0
        self.C, self.own = self.computed(self.at) if self.at else [], SimpleNamespace(number=f, base=None, way=2)
        self.C0 = self.C[0] if self.C else ZERO  # which is no unit vector
        self.own.signs = sum(1 << k for k in range(3) if self.C0[k] < 0)
        self.estimate()
        codes = self.by_others() or self.components()
        own = self.own
        own.codes, number = codes, self.numbers(codes)
        own.vector = np.where(np.isfinite(number), number, 0.0)
        own.error = half(self.dist(own.vector) + 0.001)
        signed = self.signs_of_zeros(codes) if self.how & SIGNED_ZEROS and (number == 0).any() else codes
        if is_unit(self.C0):
            place = self.place()
            place[1:] = [own] + [x for x in place[1:] if self.turned(x.codes, x.signs ^ own.signs) != codes][:2]
        self.kept.append(own)
        if self.how & LEARNS and is_unit(own.vector) and len(self.at) in (3, 4):
            self.learn(own.vector)
        return [m.stored(c, "f%d" % (self.width // 8)) for m, c in zip(self.maps, signed)]

    def prior(self):
        points, P = [self.s.point[h] for h in self.corners], np.zeros((3 * len(self.at),) * 2)
        for i, p in enumerate(points):
            P[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = self.covariance[p]
        return points, np.array([self.patch.numbers[p] + self.moved[p] for p in points]), P

    def estimate(self):
        """M and cov."""
        if len(self.at) in (3, 4):
            _, places, P = self.prior()
            for i, near in self.beside if self.how & LEARNS else []:
                if is_unit(near.vector):
                    self.lean(places, P, i, near.vector * self.side)
            found = Estimate(places, P)
            if found.known:
                self.M, self.cov = found.m * self.side, found.cov
                return
        vectors = self.C[:1] + [x.vector for x in self.kept[-1:]] + [np.array([0.0, 0.0, 1.0])]
        self.M, self.cov = next(v for v in vectors if is_unit(v)), 1e-4 * np.eye(3)

    def lean(self, places, P, i, n):
        """Moves places so that the edge from corner i is at a right angle to a normal."""
        j = (i + 1) % len(places)
        rows = P[:, 3 * j : 3 * j + 3] - P[:, 3 * i : 3 * i + 3]
        r, e = rows[:, 0] * n[0] + rows[:, 1] * n[1] + rows[:, 2] * n[2], places[j] - places[i]
        w = dot(e, e) * (self.U * self.U / 12)
        for a in range(3):
            w += n[a] * (r[3 * j + a] - r[3 * i + a])
        if 1e-280 < w < 1e280:
            places += (r * (-dot(n, e) / w)).reshape(-1, 3)
            P -= np.outer(r / w, r)

    def learn(self, V):
        points, places, P = self.prior()
        found = Estimate(places, P)
        if not found.known:
            return
        m, t, cov, (a, b, _) = found.m, found.t, found.cov, axes(found.m)
        u = [max(self.unit(k, V[k]), 0.1 * self.U) for k in range(3)]
        aa, bb, ab = cov[a][a] + u[a] * u[a] / 12, cov[b][b] + u[b] * u[b] / 12, cov[a][b]
        d = aa * bb - ab * ab
        if not 1e-280 < d < 1e280:
            return
        x, y = (V * self.side - m)[[a, b]]
        f, g = (bb * x - ab * y) / d, (aa * y - ab * x) / d
        for i, p in enumerate(points):
            block = P[3 * i : 3 * i + 3, 3 * i : 3 * i + 3]
            q, ta, tb = np.array([dot(row, m) for row in block]), t[i][a], t[i][b]
            self.moved[p] += q * (ta * f + tb * g)
            k = (bb * ta * ta - 2 * ab * ta * tb + aa * tb * tb) / d
            self.covariance[p] = block - np.outer(q, q) * k

    def dist(self, v):
        (a, b, _), cov, u = axes(self.M), self.cov, self.U
        x, y, aa, bb, ab = v[a] - self.M[a], v[b] - self.M[b], cov[a][a] + u * u, cov[b][b] + u * u, cov[a][b]
        d = (x * x * bb - 2 * x * y * ab + y * y * aa) / max(aa * bb - ab * ab, 0.01 * u * u * (aa + bb))
        return clamp(real(float(d)), 0.0, 1e30)

    # --- what its tuple is

    def by_others(self):
        """The codes, if they are those computed, or of a neighbour or of a cell of this direction."""
        q, own, near = self.q, self.own, [x for _, x in self.beside]
        around = 0
        for x in near or self.kept[-1:]:
            around |= x.way
        trace = clamp(real(self.cov[0][0] + self.cov[1][1] + self.cov[2][2]), 0.0, 1e60)
        G = class_(half(math.sqrt(trace) / self.U, 1e-9, 1e30), -20, 4, 16)
        by_corner = [(i, self.near(self.C[i])) for i in self.from_entry()]
        K = list(dict.fromkeys(codes for _, codes in by_corner))
        if K and q.bit("Computed", G, around):
            own.way = 1
            return self.choose(by_corner)
        others = {x.codes: x for x in reversed(near) if x.codes not in K}
        others = [others[codes] for codes in dict.fromkeys(x.codes for x in near) if codes in others][:4]
        refused = set(K) | {x.codes for x in others}
        for i, (d, x) in enumerate(sorted(((self.dist(x.vector), x) for x in others), key=lambda pair: pair[0])):
            if q.bit("Neighbour", class_(half(d + 0.001), -20, 4, 16), i):
                return x.codes
        return self.recalled(refused) if is_unit(self.C0) else None

    def recalled(self, refused):
        asked, found = 0, None
        for x in self.place()[1:]:
            codes = self.turned(x.codes, x.signs ^ self.own.signs)
            if found is None and codes not in refused:
                refused.add(codes)
                d = self.dist(self.numbers(codes))
                found = codes if self.q.bit("Recall", asked, class_(half(d + 0.001), -20, 8, 8), self.h) else None
                asked += 1
        if asked:
            self.h = (2 * self.h + (found is not None)) % 4
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
        giving, s = {}, self.s
        for i, what in by_corner:
            giving.setdefault(what, []).append(i)
        state, near = 0, next((x for i, x in self.beside if i == self.entry), None)
        if near and near.base is not None:
            o = s.opposite[self.halves[self.entry]]
            state = 1 if near.base == o else 2 if near.base == s.next[o] else 3
        for i, (what, corners) in enumerate(giving.items()):
            n = len(giving)
            if n == 1:
                return what
            sides = [dot(d, d) for d in (self.at[k - 2] - self.at[k - 1] for k in range(3))]
            g = sum(side > sides[corners[0]] for side in sides)
            if i == n - 1 or self.q.bit("Base", state, g, i, len(corners) > 1, n - 2):
                if len(corners) == 1:
                    self.own.base = self.corners[corners[0]]
                return what

    def signs_of_zeros(self, codes):
        zeros = np.flatnonzero(self.numbers(codes) == 0)
        corners = [i for i in self.from_entry() if self.own.way == 2 or self.near(self.C[i]) == codes]
        given = [(i, tuple(bool(math.copysign(1, self.C[i][k]) < 0) for k in zeros)) for i in corners]
        if given and self.q.bit("Signs", self.own.way == 1):
            negative = self.choose(given)
        else:
            negative = [self.q.bit("Sign") for _ in zeros]
        minus = dict(zip(zeros, negative))
        return [-1 - c if minus.get(k) else c for k, c in enumerate(codes)]

    # --- components

    def components(self):
        M, cov, near, codes = self.M, self.cov, [x for _, x in self.beside], [0, 0, 0]
        E = class_(int(sum(x.error for x in near) / len(near)), -9, 2, 9) if near else 9
        a, b, last = axes(M) if self.how & UNIT else (0, 1, 2)

        def number(k, mean, variance, *models):
            codes[k], variance = self.component(k, mean, variance, *models)
            return float(self.maps[k].number(codes[k])), variance

        x, va = number(a, M[a], cov[a][a], "First", E)
        r = cov[a][b] / va
        z = class_(half(abs(x - M[a]) / math.sqrt(va), 0.05, 100.0), -9, 3, 7)
        w = 0 if E < 3 else 1 if E < 6 or E == 9 else 2
        y, _ = number(b, M[b] + r * (x - M[a]), cov[b][b] - r * cov[a][b], "Second", z, w)
        if not self.how & UNIT:
            number(last, M[last], cov[last][last], "Third")
            return tuple(codes)
        left = math.sqrt(max(1 - x * x - y * y, 0.0))
        l, (s, t) = clamp(left, 1e-6, 1.0), (self.unit(k, v) * self.unit(k, v) / 12 for k, v in ((a, x), (b, y)))
        negative = (M[last] < 0) != self.q.bit("Side")
        number(last, -left if negative else left, (x * x * s + y * y * t) / (l * l), "Third")
        return tuple(codes)

    def component(self, k, mean, variance, *models):
        """Its code, and the variance."""
        q, m, zero = self.q, self.maps[k], bool(self.C and self.C0[k] == 0)
        mean = clamp(mean, -1e30, 1e30) if mean == mean else -1e30
        u, variance = self.unit(k, mean), clamp(variance, 0.0, 1e60) if variance == variance else 0.0
        variance = variance + u * u / 12
        spread = math.sqrt(variance)
        A, o = clamp(abs(mean) / spread, 0.001, 1000.0), 0
        for _, x in self.beside:
            o |= 2 if x.vector[k] == 0 else 1
        if (zero or not A > 8) and q.bit("Zero", zero, class_(half(A), -8, 2, 8), o):
            return m.code(0.0), variance
        size = half(spread / u, 1e-9, 1e30)
        n = q.offset(*models, class_(size, -4, 1, 8))
        if abs(n) > 4096:
            code = q.raw(32) if self.width == 32 else q.raw(32) << 32 | q.raw(32)
        elif size <= 2:
            code = m.code(mean) + n
        else:
            low, high = (m.code(mean + (n + off) * (spread / 2)) for off in (-0.5, 0.5))
            code = low + self.one_of(high - low)
        return self.plus(k, wrap(code, m.code_size)), variance

    def one_of(self, size):
        if size < 2:
            return 0
        r = max((size - 1).bit_length() - 10, 0)
        v = self.q.part_of((size - 1 >> r) + 1, 15) << r
        return min(v | (self.q.raw(32) << r - 32 | self.q.raw(r - 32) if r > 32 else self.q.raw(r)), size - 1)
