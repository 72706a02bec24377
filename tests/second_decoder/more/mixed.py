"""Section 16.12 of docs/format.md, and what it takes of 14.7: values of mode stream by mixed decisions."""
import math
from collections import defaultdict
import numpy as np
from container import clamp
from entropy import Cell, hash32
from maps import bits_of, dot
from more.mixing import Mixer, logit
from values import F32, Values, Weights

LOGISTIC_SUM = [math.floor(2**30 / (1 + math.exp(-(j - 1280) / 64)) + 0.5) for j in range(2562)]

def F(x):
    j, rest = divmod(x + 81920, 64)
    return LOGISTIC_SUM[j] + ((LOGISTIC_SUM[j + 1] - LOGISTIC_SUM[j]) * rest >> 6)

def half(x):
    if not 1e-30 < x <= 1e30:
        return 200 if x > 1e30 else -200
    return 2 * (math.frexp(x)[1] - 1) + (bits_of(float(x), "f8") & 2**52 - 1 >= 0x6A09E667F3BCC)

def narrow(x): return F32(clamp(x, -1e32, 1e32))

def log_ratio(above, below):
    b = bits_of(F32(max(above, 1)) / F32(max(below, 1)), "f4")
    x, y = F32((b >> 23) - 127), F32(b & 2**23 - 1) / F32(2**23)
    q = F32(0.44078080) + y * (F32(-0.24266946) + y * F32(0.08161574))
    return clamp(int((x + y + y * (F32(1) - y) * q) * F32(177.44568)), -2047, 2047)

class Samples:
    """Of a point: what planes know around it."""

    def __init__(self, n):
        self.n, self.s, self.P, self.o, self.v, self.w = 0, *map(np.zeros, (3, (3, 3), n, n, (n, 3)))

class Planes:
    def __init__(self, places, n, of_cells):
        self.places, self.n, self.of_cells, self.samples = places, n, of_cells, {}

    def plane(self, number, corners):
        """By component; or nothing. Prepares `learn`."""
        around = self.around = [self.samples.setdefault(p, Samples(self.n)) for p in corners]
        at = [self.places[p] for p in corners]
        if self.of_cells:
            here = sum((x * (1 / len(at)) for x in at), np.zeros(3))
        else:
            here, self.own = self.places[number], Samples(self.n)
            self.samples[number] = self.own
        self.d = [x - here for x in at]
        n, pairs = sum(p.n for p in around), list(zip(around, self.d))
        m = sum((p.s + p.n * d for p, d in pairs), np.zeros(3)) / max(n, 1)
        squares = (p.P + np.outer(p.s, d) + np.outer(d, p.s) + np.outer(p.n * d, d) for p, d in pairs)
        C = sum(squares, np.zeros((3, 3))) - np.outer(n * m, m)
        a, t, way = [0.0] * len(at), 1 / max(n, 1), -m
        if not self.of_cells:
            a, t = [1 / q if q > 1e-60 else 0.0 for q in (dot(d, d) for d in self.d)], 0.0
            a = [x / sum(a) for x in a] if sum(a) > 0 else None
            way = sum((-x * d for x, d in zip(a or [], self.d)), np.zeros(3))
        slope = self.slope(C, m, way) if n else None if self.of_cells else np.zeros(3)
        if a is None or slope is None:
            return None
        weights = (np.array([dot(slope, w) for w in p.w]) for p in around)
        terms = (x * p.o + (t + dot(slope, d - m)) * p.v + w for x, (p, d), w in zip(a, pairs, weights))
        plane = sum(terms, np.zeros(self.n))
        return plane if (np.abs(plane) <= 1e30).all() else None

    @staticmethod
    def slope(C, m, way):
        A = C + (1e-4 * (C[0, 0] + C[1, 1] + C[2, 2]) + 3e-3 * dot(m, m)) * np.eye(3)
        p = A[0, 0]
        f, g = A[1, 0] / p, A[2, 0] / p
        q, o = A[1, 1] - f * A[1, 0], A[2, 1] - g * A[1, 0]
        h = o / q
        r = A[2, 2] - g * A[2, 0] - h * o
        if not (p > 0 and q > 0 and r > 0):
            return None
        y = way[1] - f * way[0]
        slope2 = (way[2] - g * way[0] - h * y) / r
        slope1 = y / q - h * slope2
        return np.array([way[0] / p - f * slope1 - g * slope2, slope1, slope2])

    def learn(self, x):
        x = np.array(x)
        for p, d in zip(self.around, self.d):
            square, by = np.outer(d, d), x if self.of_cells else x + p.o
            p.n, p.v = p.n + (1 if self.of_cells else 2), p.v + by
            if not self.of_cells:
                own = self.own
                own.n, own.s, own.P = own.n + 2, own.s + d, own.P + square
                own.v, own.w = own.v + by, own.w + np.outer(p.o, d)
            p.s, p.P, p.w = p.s - d, p.P + square, p.w - np.outer(x, d)
        if not self.of_cells:
            self.own.o = x

class Situation:
    def __init__(self):
        self.square, self.visits, self.misses = 0.0, 0, [F32(0)] * 5

class MixedValues(Values):
    lanes = 1

    def __init__(self, array, maps, places):
        """`places` of points by number; nothing for positions themselves."""
        super().__init__(array, maps)
        self.weights, self.situations = defaultdict(lambda: Weights(16, True)), defaultdict(Situation)
        self.planes = Planes(places, self.n, array.domain != 0) if places is not None and array.type >= 8 else None
        self.ratios = [defaultdict(lambda: F32(1)) for _ in range(4)]
        self.mixer, self.cells = Mixer([3276] * 4 + [0] + [655] * 3 + [5734] * 8), defaultdict(Cell)
        self.follow, self.hits, self.hits_of_c0, self.score, self.counter = defaultdict(int), defaultdict(int), 0, 0, 0

    def tuple(self, number, corners):
        with_plane = self.planes and corners is not None
        self.plane = self.planes.plane(number, corners) if with_plane else None
        row = [self.component(k) for k in range(self.n)]
        if with_plane:
            self.planes.learn(self.own.place)
        return row

    def place(self, k, c): return clamp(super().place(k, c), -1e30, 1e30)

    def three_sums(self, k):
        if self.full:
            A, B, C, D, E, G, H = (t.place[k] for t in self.sums)
            near, across = (A + B) + C, (D + E) + G
            return [near - across + H, near * (2 / 3) - across * (1 / 3), near * (1 / 3)]
        sums = [sum(t.place[k] * w for t, w in terms) for terms in self.sums] or [self.last.place[k]]
        return (sums + [sums[-1]] * 2)[:3]

    def features(self, k, sums):
        f, near, last = np.zeros(16, "f4"), self.near, self.last
        apart = [narrow(s - sums[0]) for s in sums[1:]]
        if self.full:
            f[:7] = [t.twist[k] for t in self.sums]
            f[8] = (near[0].residual[k] + near[1].residual[k]) + near[2].residual[k]
            f[9:12] = *apart, last.residual[k]
        elif self.sums:
            f[:2], f[5] = apart, last.residual[k]
            for i, t in enumerate(near):
                f[2 + i], f[(6, 8, 11)[i]] = t.residual[k], t.twist[k]
            for i, t in enumerate(near[1:], 1):
                f[8 + i] = narrow(t.place[k] - near[0].place[k])
        f[7] = self.own.residual[k - 1] if k else 0
        if self.plane is not None:
            f[12] = narrow(self.plane[k] - sums[0])
            f[13 : 13 + len(near)] = [t.bend[k] for t in near]
        return f

    def component(self, k):
        own, m = self.own, self.maps[k]
        own.was[k] = self.flag(k)
        sums, near, state = self.three_sums(k), self.near or [self.last], self.situations[k, self.situation]
        features, weights = self.features(k, sums), self.weights[0 if self.full else self.situation]
        # experts
        n = len(near)
        deviation = math.sqrt((sum(float(t.error[k]) ** 2 for t in near) + state.square) / (n + 1))
        mean_size = sum(t.size[k] for t in near) / n
        third = sums[0] + float(sum((w * x for w, x in zip(weights.weights, features)), F32(0)))
        if not (third - sums[0]) ** 2 < 100 * deviation * deviation:
            third = sums[0]
        plane = None if self.plane is None else float(self.plane[k])
        candidates = [*sums, third, third if plane is None else plane]
        best = min(zip(state.misses, range(5), candidates))[2]
        self.means = means = [sums[0], sums[1] if plane is None else plane, best, third]
        highest = 2 ** (self.B - 1) - 1
        c0 = clamp(self.code_near(k, best), -highest, highest)
        base = self.place(k, c0)
        step = max(abs(self.place(k, c0 - 1 if c0 == highest else c0 + 1) - base), 1e-28)
        deviation, whole = max(deviation, 0.3 * step), math.floor(mean_size)
        size = 2.0 ** (whole >> 1) * (1.4142135623730951 if whole % 2 else 1.0)
        size = max(size * (1 + (mean_size - whole) * 0.41421356237309515), 0.3 * step)
        self.size_bin, self.dev_bin = clamp(whole - half(step) + 3, 0, 63), clamp(half(deviation / step) + 3, 0, 63)
        (a, b), (s, t) = (deviation, size), (self.dev_bin, self.size_bin)
        spreads, bins = [a, a, b, a], [s, s, t, s]
        self.scales = [max(0.55 * s * float(r[b]), 0.1 * step) for s, r, b in zip(spreads, self.ratios, bins)]
        if own.was[k]:
            own.place[k], own.code[k] = best, c0
            return self.exception()
        self.k, self.c0, self.base, self.interval = k, c0, base, [-highest - 1, highest]
        own.code[k] = code = self.number(k, c0, step, deviation)
        # learning
        x = own.place[k] = self.place(k, code)
        own.twist[k], own.bend[k], own.residual[k] = narrow(x - sums[0]), narrow(x - candidates[4]), narrow(x - best)
        error = clamp(abs(x - best), 0.22 * step, 20 * deviation)
        own.error[k], own.size[k] = narrow(error), half(abs(x - best) + 0.3 * step)
        state.visits = min(state.visits + 1, 50)
        state.square += (error * error - state.square) * (1 / state.visits)
        for i, candidate in enumerate(candidates):
            state.misses[i] += F32(0.02) * (F32(half(abs(x - candidate) + 0.3 * step)) - state.misses[i])
        for ratio, b, mean, s in zip(self.ratios, bins, means, spreads):
            ratio[b] = ratio[b] + F32(0.03) * (F32(min(abs(x - mean) / s, 20)) - ratio[b])
        weights.learn(features, own.twist[k], F32(1 / math.sqrt(size * size + (x - third) ** 2)))
        return m.stored(code, self.array.dtype)

    # --- one number (14.7)

    def boundary(self, c):
        own = self.place(self.k, c)
        return own if c == -(2 ** (self.B - 1)) else (self.place(self.k, c - 1) + own) / 2

    def number(self, k, c0, step, deviation):
        self.counter += self.score <= 0
        matching = self.score > 0 or self.counter % 16 == 0
        N0 = (self.near[0] if self.near else self.last).code[k]
        before = self.own.code[k - 1] if k else self.last.code[k]
        seeds = [hash32(j, k + 19088743) for j in (1, 2)]
        hashes = hash32(seeds[0], N0), hash32(hash32(seeds[1], before), self.own.code[k - 2] if k > 1 else N0)
        places = [(i, h >> 18) for i, h in enumerate(hashes)]
        codes = {0: self.follow[places[0]], **{1 + i: t.code[k] for i, t in enumerate(self.near[:3])}, 4: c0}
        codes |= {5: self.follow[places[1]], 6: self.last.code[k]}
        low, high = self.interval
        self.matches, found = {}, set()
        for kind, code in sorted(codes.items()) if matching else []:
            if code not in found and low <= code <= high:
                found.add(code)
                distance = clamp(half(abs(self.place(k, code) - self.means[2]) / deviation) + 3, 0, 7)
                self.matches[kind] = code, ((8 * kind + self.hits[kind]) * 8 + distance) * 16
        self.ends = [[0, 2**30] for _ in range(4)]
        code = self.decide(c0, step)
        if matching:
            for kind in range(7):
                right = kind in self.matches and self.matches[kind][0] == code
                self.hits[kind] = (2 * self.hits[kind] + right) % 8
            self.score = clamp(self.score + (100 if code in found else -1), -1, 2000)
            self.follow.update((place, code) for place in places)
        return code

    def decide(self, c0, step):
        exact = self.cells["exact", 8 * self.dev_bin + self.hits_of_c0]
        up = self.ask(c0, 0, 1)
        o = c0 - 1 if up else c0
        off, scale = (self.means[2] - self.base) * (1 if up else -1), self.scales[2]
        c = e = min(max(half(max(off + scale, scale / 2) / step + 1), 0) // 2, self.B - 1)

        def beyond(k, type_):
            few = 2 + 16 * up + min(k, 15)
            return self.ask(o + 2 ** (k + 1), type_, few) if up else not self.ask(o - 2 ** (k + 1) + 1, type_, few)

        if up and exact.p > 40000 and not beyond(0, 14):
            c = 0
        elif beyond(c, 1):
            c += 1
            while c < self.B and beyond(c, min(1 + c - e, 3)):
                c += 1
        else:
            while c > 0 and not beyond(c - 1, min(4 + e - c, 6)):
                c -= 1
        code = self.within(up, c)
        exact.learn(code == c0)
        self.hits_of_c0 = (2 * self.hits_of_c0 + (code == c0)) % 8
        return code

    def within(self, up, c):
        prefix, i, interval = 1, 0, self.interval
        while interval[0] < interval[1]:
            low, high = interval
            middle = low + (high - low + 1) // 2
            if i >= 2 and self.flat(low, middle, high):
                for code, cell in self.alive().values():
                    model = self.cells["match", cell + 15]
                    bit = self.q.decision(clamp(model.p, 64, 65472))
                    model.learn(bit)
                    if bit:
                        return code
                return self.even()
            few = 34 + 3 * (16 * up + min(c, 15)) + (0 if i == 0 else 1 + prefix % 2) if i < 2 else None
            prefix = 2 * prefix + self.ask(middle, 7 + min(i, 6), few) & 0xFFFFFFFF
            i += 1
        return interval[0]

    def flat(self, low, middle, high):
        begin, width = self.boundary(low), self.boundary(high) - self.boundary(low)
        return width < self.scales[2] and width > 0 and 0.3 < (self.boundary(middle) - begin) / width < 0.7

    def even(self):
        low, high = self.interval
        while low < high:
            z = high - low + 1
            b = min(z.bit_length() - 1, 16)
            u, v = z >> b, self.q.raw(b)
            low, high = low + u * v, high if v == 2**b - 1 else min(low + u * v + u - 1, high)
        return low

    def alive(self):
        low, high = self.interval
        return {kind: match for kind, match in self.matches.items() if low <= match[0] <= high}

    def ask(self, x, type_, few):
        """Whether the code is x or more."""
        if x <= self.interval[0] or x > self.interval[1]:
            return int(x <= self.interval[0])
        y, inputs, cells, now = F32(self.boundary(x) - self.base), [0] * 16, [], []
        for i, (mean, scale, (low, high)) in enumerate(zip(self.means, self.scales, self.ends)):
            now.append(F(int(clamp((y - narrow(mean - self.base)) * F32(4096 / scale), -81920, 81920))))
            inputs[i] = log_ratio(high - now[-1], now[-1] - low)
        inputs[4] = 77
        mean0, _, mean2, mean3 = self.means
        if few is not None:
            bins = ("size", 2 * self.size_bin + (mean0 > mean2)), ("dev", 2 * self.dev_bin + (mean3 > mean2))
            cells = [(self.cells[*b, few], True) for b in bins]
            inputs[5:7] = [logit(cell) for cell, _ in cells]
        for kind, (code, cell) in self.alive().items():
            cells.append((self.cells["match", cell + type_], code >= x))
            inputs[8 + kind] = logit(cells[-1][0]) * (1 if code >= x else -1)
        row = 16 * (2 * self.situation + (self.k > 0)) + type_
        bit = self.mixer.bit(self.q, inputs, 16 * self.dev_bin + type_, row, type_)
        for cell, right in cells:
            cell.learn(bit == right)
        self.interval[0 if bit else 1] = x if bit else x - 1
        for ends, moved in zip(self.ends, now):
            ends[0 if bit else 1] = moved
        return bit
