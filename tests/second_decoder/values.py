"""Section 16.7 of docs/format.md: positions and arrays of mode stream."""

import math
import struct
from collections import defaultdict

import numpy as np

from codes import DTYPES, MOST, Map, bits_of, clamp, f32, from_bits, narrow_float, wrap
from container import require, unzigzag
from entropy import CodedSequence, bits, symbols

RECORDS = (16384, 16448, 16512)


def power_of_ten(x, k):
    return x * 10.0**k if k >= 0 else x / 10.0**-k


class Digits:
    """16.1: significant digits."""

    def __init__(self, d):
        self.d, self.F = d, 10 ** (d - 1)

    def value(self, c):
        if c == 0:
            return 0.0
        decade, mantissa = (abs(c) - 1) // (9 * self.F), (abs(c) - 1) % (9 * self.F) + self.F
        x = 0.0 if decade > 20 else power_of_ten(float(mantissa), decade - 6 - self.d + 1)
        return -x if c < 0 else x

    @staticmethod
    def exponent(x):
        x = abs(x)
        e = max(-6, (math.frexp(x)[1] - 1) * 1233 // 4096) if x else -6
        e += power_of_ten(x, -e) >= 10
        e -= power_of_ten(x, -e) < 1
        return max(e, -6)

    def code(self, x):
        if not 1e-6 <= abs(x) < 1e15:
            return 0
        e = self.exponent(x)
        mantissa = max(math.floor(power_of_ten(abs(x), self.d - 1 - e) + 0.5), self.F)
        if mantissa == 10 * self.F:
            mantissa, e = self.F, e + 1
        c = (e + 6) * 9 * self.F + mantissa - self.F + 1
        return -c if x < 0 else c

    def unit(self, x):
        return int((self.exponent(x) - self.d + 1) * 6.644)


class Decimals:
    """16.1: decimals of f32, and bits of larger ones."""

    def __init__(self, d):
        self.d, self.E = d, 2.0**-10
        while self.E * 10.0**d < 0.9 * 2**23:
            self.E *= 2
        self.N, self.bits = math.floor(self.E * 10.0**d + 0.5), bits_of(self.E, "f4")

    def value(self, c):
        n = abs(c)
        x = float(n) / 10.0**self.d if n < self.N else from_bits(min(self.bits + n - self.N, 0x7F7FFFFF), "f4")
        return -x if c < 0 else x

    def code(self, x):
        n = abs(x)
        c = math.floor(n * 10.0**self.d + 0.5) if n < self.E else self.N + bits_of(narrow_float(n, "f4"), "f4") - self.bits
        return -c if x < 0 else c

    def unit(self, x):
        return int(-self.d * 6644 / 1000) if abs(x) < self.E else 2 * (math.frexp(x)[1] - 1 - 23)


def stream_map(fields, type_, tables):
    m = Map(fields, type_, tables)
    m.digits = Decimals(m.digits - 128) if m.digits > 128 else Digits(m.digits) if m.digits else None
    m.plain = m.kind == 1 and not (m.digits or m.has_factor or m.has_table)
    m.flags = m.kind != 0 and not m.plain  # whether exceptions are told
    return m


def half_octaves(x):
    """Bits 22 to 30 of |x| as f32."""
    x = clamp(abs(x), 0.0, 1e39) if x == x else x
    with np.errstate(over="ignore"):
        return int(np.float32(x).view(np.uint32)) >> 22 & 511


class Weights:
    """Least squares (14.6), of twists (16.7)."""

    def __init__(self, n):
        self.n, self.g, self.samples = n, np.float32(1), 0
        self.M, self.T, self.weights = np.zeros((n, n), "f4"), np.zeros(n, "f4"), np.zeros(n, "f4")

    def learn(self, f, target, certainty):
        w = np.float32(certainty) * self.g
        fw, tw = f * w, np.float32(target) * w
        if not (np.abs(fw) < 1e6).all() or not abs(tw) < 1e6:
            fw, tw = fw * 0, np.float32(0)
            fw = np.zeros(self.n, "f4")
        self.M += np.tril(np.outer(fw, fw).astype("f4"))
        self.T += fw * tw
        self.g *= np.float32(1.0002)
        if self.g > 1024:
            self.M *= np.float32(2.0**-20)
            self.T *= np.float32(2.0**-20)
            self.g *= np.float32(2.0**-10)
        self.samples += 1
        if self.samples % 32 == 0:
            self.solve()

    def solve(self):
        n, g = self.n, float(self.g)
        P, L, D = [[0.0] * n for _ in range(n)], [[0.0] * n for _ in range(n)], [0.0] * n
        for i in range(n):
            for j in range(i + 1):
                S = float(self.M[i, j])
                if i == j:
                    S = S + (1e-4 * S + 1e-3 * g * g)
                for k in range(j):
                    S = S - P[i][k] * L[j][k]
                if j < i:
                    P[i][j], L[i][j] = S, S * D[j]
                elif not S > 1e-12:
                    return
                else:
                    D[i] = 1 / S
        x = [0.0] * n
        for i in range(n):
            x[i] = float(self.T[i])
            for k in range(i):
                x[i] = x[i] - L[i][k] * x[k]
        for i in range(n - 1, -1, -1):
            x[i] = x[i] * D[i]
            for k in range(i + 1, n):
                x[i] = x[i] - L[k][i] * x[k]
        if all(abs(v) <= 1e4 for v in x):
            self.weights = np.array(x, "f4")


class Values:
    """Tuples of an array, batch after batch."""

    def __init__(self, array, maps):
        self.array, self.maps, self.n = array, maps, array.components
        n = self.n
        self.B = 32 if int(array.dtype[1]) < 8 or all(m.has_factor for m in maps) else 64
        self.small, self.lengths, self.heads, self.low, self.lower = (symbols() for _ in range(5))
        self.scores, self.lasts = defaultdict(int), defaultdict(int)
        self.mask, self.again, self.last_again, self.last_bits = bits(), bits(), 0, 0
        self.had_exception = False
        self.records = defaultdict(lambda: list(RECORDS))
        self.fits = defaultdict(lambda: Weights(7))
        self.full_groups = 0
        zero = [0.0] * n
        self.place, self.twist = defaultdict(lambda: [0.0] * n), defaultdict(lambda: [np.float32(0)] * n)
        self.size, self.was = defaultdict(lambda: [0] * n), defaultdict(lambda: [False] * n)
        self.last_place, self.last_size, self.last_was = list(zero), [0] * n, [False] * n

    def batch(self, data, elements):
        self.sequence = CodedSequence(data, min(self.n, 3))
        rows = [self.element(*element) for element in elements]
        self.sequence.end()
        return rows

    def element(self, slot, sums, near, situation):
        self.slot, self.sums, self.near, self.situation = slot, sums, near, situation
        self.full = situation < 8
        made = {name: [None] * self.n for name in ("place", "twist", "size", "was", "bits")}
        with np.errstate(all="ignore"):
            for first in range(0, self.n, 3):
                self.group(range(first, min(first + 3, self.n)), made)
        if slot is not None:
            self.place[slot], self.twist[slot], self.size[slot], self.was[slot] = (made[x] for x in ("place", "twist", "size", "was"))
        self.last_place, self.last_size, self.last_was = made["place"], made["size"], made["was"]
        return made["bits"]

    def group(self, components, made):
        flags = {}
        for k in components:
            flags[k] = self.flag(k, made)
            made["was"][k] = flags[k]
        stage = {}
        for k in components:
            candidates = self.candidates(k)
            record = self.records[k, self.situation]
            best = min(range(len(candidates)), key=lambda i: record[i])
            expected = self.expected(k, candidates[best])
            stage[k] = candidates, record, best, expected, None if flags[k] else self.first_stage(k, expected)
        if self.full:
            self.full_groups += 1
        for k in components:
            candidates, record, best, (code, x, spread, unit), first = stage[k]
            if flags[k]:
                made["bits"][k] = self.exception()
                place = candidates[best] if candidates[best] == candidates[best] else 0.0
                residual = 0
            else:
                residual = self.rest(k, *first)
                c = wrap(code + residual, self.B)
                made["bits"][k], place = self.bits_of(k, c), self.place_of(k, c)
            made["place"][k] = place
            made["size"][k] = half_octaves(f32(2 * np.float32(abs(residual)) + np.float32(1))) - 254 + unit
            made["twist"][k] = np.float32(place - candidates[0])
            for i, candidate in enumerate(candidates):
                record[i] += half_octaves(place - candidate) - record[i] // 64
            if self.full and self.n <= 16 and (self.full_groups <= 16384 or self.full_groups % 4 == 0):
                f = np.array([self.twist[s][k] for s in self.sums], "f4")
                largest = np.abs(f).max()
                certainty = np.float32(1) / largest if largest else np.float32(0)
                self.fits[k, self.situation].learn(f, made["twist"][k], certainty)

    # --- exceptions

    def flag(self, k, made):
        if not self.maps[k].flags:
            return False
        c = 0
        if self.had_exception:
            there = [self.was[s][k] for s in self.near]
            last = self.last_was[k]
            around = 2 * last if not there else 0 if not any(there) else 2 if all(there) else 1
            earlier = [j for j in range(k) if self.maps[j].flags]
            before = 1 + made["was"][earlier[-1]] if earlier else 0
            c = 1 + 6 * around + 3 * last + before
        flag = bool(self.sequence.bit(self.mask[c]))
        self.had_exception |= flag
        return flag

    def exception(self):
        same = self.sequence.bit(self.again[self.last_again])
        self.last_again = same
        if not same:
            size = int(self.array.dtype[1])
            self.last_bits = self.sequence.raw(8) if size == 1 else sum(self.sequence.raw(16) << 16 * i for i in range(size // 2))
        return self.last_bits

    # --- predictions

    def candidates(self, k):
        P = self.place
        if self.full:
            A, B, C, D, E, F, G = (P[s][k] for s in self.sums)
            found = [((A + B) + C) - ((D + E) + F) + G]
            if self.n <= 16:
                correction = np.float32(0)
                for w, s in zip(self.fits[k, self.situation].weights, self.sums):
                    correction = correction + w * self.twist[s][k]
                found.append(found[0] + float(correction))
            return found
        found = []
        for terms in self.sums:
            total = 0.0
            for s, w in terms:
                total = total + P[s][k] * w
            found.append(total)
        return found or [self.last_place[k]]

    def expected(self, k, prediction):
        m = self.maps[k]
        x = prediction
        if m.kind == 1 and not m.digits and not m.has_table:
            if not math.isfinite(x) and m.dtype == "f4":
                x = 0.0 if x != x else math.copysign(MOST["f4"], x)
            x = narrow_float(x, m.dtype)
            code = bits_of(x, m.dtype)
            code = code if code >= 0 else wrap(code ^ (1 << (31 if m.dtype == "f4" else 63)) - 1, 64)
        elif m.has_table or m.digits:
            code = m.digits.code(x) if m.digits else m.code(x)
        else:
            x = clamp(x, -(2.0 ** (self.B - 1)), 2.0 ** (self.B - 1) - 1) if x == x else 0.0
            code = math.floor(x + 0.5) if abs(x) < 2.0**52 else int(x)
        group = self.maps[k - k % 3 : k - k % 3 + 3]
        unit = self.unit(m, x if all(g.plain for g in group) or m.dtype != "f4" else prediction)
        sizes = [self.size[s][k] for s in self.near]
        mean = sum(sizes) // len(sizes) if sizes else self.last_size[k]
        wide = max(sizes) - min(sizes) if sizes else 0
        group = 0 if self.full else 3 if self.situation == 31 else 1 if self.with_parallelograms() else 2
        spread = 3 * group + (0 if wide <= 2 else 1 if wide <= 7 else 2)
        return code, clamp(mean - unit, 0, 2 * self.B - 1), spread, unit

    def with_parallelograms(self):
        if self.array.domain:
            return len(self.sums) > 1
        return 12 <= self.situation < 24

    def unit(self, m, x):
        if m.has_table or m.kind != 1:
            return 0
        if m.digits:
            return m.digits.unit(x)
        if m.dtype == "f4":  # of a double, where another component of the group has another map, or one with a factor
            return 2 * (max((bits_of(x, "f8") >> 52 & 2047) - 1023 + 127, 1) - 150)
        return 2 * (max((bits_of(x, "f8") >> 52 & 2047) - 1023, -1022) - 52)

    # --- residuals

    def first_stage(self, k, expected):
        code, x, spread, unit = expected
        m, lane = min(k, 2), k % 3
        if x < 7:
            f = self.sequence.symbol(self.small[m, x, spread], lane)
            if f < 15:
                return unzigzag(f), None
        o = x // 2
        s = self.sequence.symbol(self.lengths[m, min(o, 19), spread], lane)
        length = max(o - 7, 0) + s if s < 15 else self.sequence.raw(7, lane)
        return None, min(length, self.B)

    def rest(self, k, residual, length):
        if residual is not None:
            return residual
        if length == 0:
            return 0
        m, lane, q = min(k, 2), k % 3, self.sequence
        n = min(length - 1, 3)
        left = length - 1 - n
        head = q.symbol(self.heads[m, length], lane)
        v = (1 << n) + head % (1 << n)
        w, after = min(left, 8), left
        if left >= 4 and self.scores[m, length] > 0:
            four = q.symbol(self.low[m, length, head], lane)
            v = v << 4 | four
            if w > 4:
                v = v << w - 4 | q.symbol(self.lower[m, length, 16 * head + four], lane) % (1 << w - 4)
            left -= w
        if self.B == 64 and left > 32:
            left -= 32
            v = v << 32 | q.raw(32, lane)
        v = v << left | q.raw(left, lane)
        if after >= 4:
            t = v >> after - w & (1 << w) - 1
            hit = self.lasts[m, length, head] == t
            self.scores[m, length] = clamp(self.scores[m, length] + ((1 << w - 4) if hit else -1), -255, 255)
            self.lasts[m, length, head] = t
        return wrap(-v if head >> n & 1 else v, self.B)

    # --- codes

    def place_of(self, k, c):
        m = self.maps[k]
        if m.has_table or m.kind == 1 and not m.digits:
            return m.value(c)
        return m.digits.value(c) if m.digits else float(c)

    def bits_of(self, k, c):
        m = self.maps[k]
        if not m.digits:
            return m.stored(c, self.array.dtype)
        return int(np.array(narrow_float(m.digits.value(c), m.dtype) * m.factor, self.array.dtype).view("u" + self.array.dtype[1]))


def as_rows(rows, dtype, components):
    return np.array(rows, "u8").reshape(-1, components).astype("u" + dtype[1]).view(dtype)
