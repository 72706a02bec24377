"""Section 16.7 of docs/format.md: positions and arrays of mode stream."""

import math
from collections import defaultdict

import numpy as np

from codes import MOST, Map, bits_of, clamp, f32, from_bits, narrow_float, wrap
from container import unzigzag
from entropy import CodedSequence, bits, symbols


def power_of_ten(x, k):
    return x * 10.0**k if k >= 0 else x / 10.0**-k


class Digits:
    """16.1: significant digits."""

    def __init__(self, d):
        self.d, self.F = d, 10 ** (d - 1)

    def value(self, c):
        if c == 0:
            return 0.0
        decade, mantissa = divmod(abs(c) - 1, 9 * self.F)
        x = 0.0 if decade > 20 else power_of_ten(float(mantissa + self.F), decade - 6 - self.d + 1)
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
        c = (e + 6) * 9 * self.F + mantissa - self.F + 1  # 10F is F with e + 1
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
    m.by_value = m.has_table or m.kind == 1 and not m.digits  # what places are
    m.plain = m.kind == 1 and not (m.digits or m.has_factor or m.has_table)
    m.flags = m.kind != 0 and not m.plain  # whether exceptions are told
    return m


def half_octaves(x):
    """Bits 22 to 30 of |x| as f32."""
    with np.errstate(over="ignore"):
        return bits_of(np.float32(clamp(abs(x), 0.0, 1e39) if x == x else x), "f4") >> 22 & 511


class Weights:
    """Least squares: as 14.6 has them (`rare`), and of twists (16.7)."""

    def __init__(self, n, rare=False):
        self.n, self.g, self.samples, self.rare = n, np.float32(1), 0, rare
        self.M, self.T, self.weights = np.zeros((n, n), "f4"), np.zeros(n, "f4"), np.zeros(n, "f4")

    def learn(self, f, target, certainty):
        w = np.float32(certainty) * self.g
        fw, tw = f * w, np.float32(target) * w
        if not (np.abs(fw) < 1e6).all() or not abs(tw) < 1e6:
            if self.rare:
                return
            fw, tw = np.zeros(self.n, "f4"), np.float32(0)
        self.M += np.tril(np.outer(fw, fw).astype("f4"))
        self.T += fw * tw
        self.g *= np.float32(1.0002)
        if self.g > 1024:
            self.M *= np.float32(2.0**-20)
            self.T *= np.float32(2.0**-20)
            self.g *= np.float32(2.0**-10)
        self.samples += 1
        if self.samples % (256 if self.rare and self.samples >= 1024 else 32) == 0:
            self.solve()

    def solve(self):
        n, g = self.n, float(self.g)
        P, L, D, x = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n), self.T.astype("f8")
        for i in range(n):
            for j in range(i + 1):
                S = float(self.M[i, j])
                S = S + (1e-4 * S + 1e-3 * g * g) if i == j else S
                for k in range(j):
                    S = S - P[i, k] * L[j, k]
                if i == j and not S > 1e-12:
                    return
                if i == j:
                    D[i] = 1 / S
                else:
                    P[i, j], L[i, j] = S, S * D[j]
        for i in range(n):
            for k in range(i):
                x[i] = x[i] - L[i, k] * x[k]
        for i in reversed(range(n)):
            x[i] = x[i] * D[i]
            for k in range(i + 1, n):
                x[i] = x[i] - L[k, i] * x[k]
        if (np.abs(x) <= 1e4).all():
            self.weights = x.astype("f4")


class Tuple:
    """What later tuples ask of one, by component."""

    def __init__(self, n):
        self.place, self.twist, self.size, self.was = [0.0] * n, [np.float32(0)] * n, [0] * n, [False] * n


class Values:
    """Tuples of an array, batch after batch."""

    def __init__(self, array, maps):
        self.array, self.maps, self.n = array, maps, array.components
        self.bytes = int(array.dtype[1])
        self.B = 32 if self.bytes < 8 or all(m.has_factor for m in maps) else 64
        self.small, self.lengths, self.heads, self.low, self.lower = (symbols() for _ in range(5))
        self.scores, self.lasts = defaultdict(int), defaultdict(int)
        self.mask, self.again, self.last_again, self.last_bits, self.had_exception = bits(), bits(), 0, 0, False
        self.records = defaultdict(lambda: [16384, 16448, 16512])
        self.fits, self.full_groups = defaultdict(lambda: Weights(7)), 0
        self.slots, self.last = defaultdict(lambda: Tuple(self.n)), Tuple(self.n)

    def batch(self, data, elements, numbers):
        self.sequence = CodedSequence(data, min(self.n, 3))
        with np.errstate(all="ignore"):
            rows = [self.element(*element) for element in elements]
        self.sequence.end()
        return rows

    def element(self, slot, sums, near, situation, _):
        self.situation, self.full = situation, situation < 8
        self.sums = [self.slots[s] for s in sums] if self.full else [[(self.slots[s], w) for s, w in terms] for terms in sums]
        self.near, self.own, row = [self.slots[s] for s in near], Tuple(self.n), []
        for first in range(0, self.n, 3):
            row += self.group(range(first, min(first + 3, self.n)))
        self.last = self.own
        if slot is not None:
            self.slots[slot] = self.own
        return row

    def group(self, components):
        own, staged, row = self.own, [], []
        for k in components:
            own.was[k] = self.flag(k)
        for k in components:
            candidates, record = self.candidates(k), self.records[k, self.situation]
            best = candidates[min(range(len(candidates)), key=lambda i: record[i])]
            code, x, spread, unit = self.expected(k, best)
            staged.append((candidates, best, code, unit, None if own.was[k] else self.first_stage(k, x, spread)))
        self.full_groups += self.full
        for k, (candidates, best, code, unit, first) in zip(components, staged):
            m, residual = self.maps[k], 0
            if own.was[k]:
                row.append(self.exception())
                own.place[k] = best if best == best else 0.0
            else:
                residual = self.rest(k, *first)
                c = wrap(code + residual, self.B)
                own.place[k] = self.place(k, c)
                row.append(self.bits_of(m, c))
            own.size[k] = half_octaves(f32(2 * np.float32(abs(residual)) + np.float32(1))) - 254 + unit
            own.twist[k] = np.float32(own.place[k] - candidates[0])
            record = self.records[k, self.situation]
            for i, candidate in enumerate(candidates):
                record[i] += half_octaves(own.place[k] - candidate) - record[i] // 64
            if self.full and self.n <= 16 and (self.full_groups <= 16384 or self.full_groups % 4 == 0):
                f = np.array([s.twist[k] for s in self.sums], "f4")
                largest = np.abs(f).max()
                self.fits[k, self.situation].learn(f, own.twist[k], np.float32(1) / largest if largest else 0)
        return row

    def place(self, k, c):
        m = self.maps[k]
        return m.value(c) if m.by_value else m.digits.value(c) if m.digits else float(c)

    def bits_of(self, m, c):
        if not m.digits:
            return m.stored(c, self.array.dtype)
        return int(np.array(narrow_float(m.digits.value(c), m.dtype) * m.factor, self.array.dtype).view("u" + self.array.dtype[1]))

    # --- exceptions

    def flag(self, k):
        if not self.maps[k].flags:
            return False
        c = 0
        if self.had_exception:
            there, last = [t.was[k] for t in self.near], self.last.was[k]
            around = 2 * last if not there else 0 if not any(there) else 2 if all(there) else 1
            earlier = [j for j in range(k) if self.maps[j].flags]
            c = 1 + 6 * around + 3 * last + (1 + self.own.was[earlier[-1]] if earlier else 0)
        flag = bool(self.sequence.bit(self.mask[c]))
        self.had_exception |= flag
        return flag

    def exception(self):
        self.last_again = self.sequence.bit(self.again[self.last_again])
        if not self.last_again:
            self.last_bits = self.sequence.raw(8) if self.bytes == 1 else sum(self.sequence.raw(16) << 16 * i for i in range(self.bytes // 2))
        return self.last_bits

    # --- predictions

    def candidates(self, k):
        if self.full:
            A, B, C, D, E, F, G = (t.place[k] for t in self.sums)
            first, correction = ((A + B) + C) - ((D + E) + F) + G, np.float32(0)
            for w, t in zip(self.fits[k, self.situation].weights, self.sums):
                correction = correction + w * t.twist[k]
            return [first, first + float(correction)] if self.n <= 16 else [first]
        return [sum(t.place[k] * w for t, w in terms) for terms in self.sums] or [self.last.place[k]]

    def rounded(self, m, x):
        """A prediction as the type has it."""
        if not math.isfinite(x) and m.dtype == "f4":
            x = 0.0 if x != x else math.copysign(MOST["f4"], x)
        return narrow_float(x, m.dtype)

    def code_near(self, k, x):
        m = self.maps[k]
        if m.has_table or m.digits:
            return m.code(x) if m.has_table else m.digits.code(x)
        if m.by_value:
            code = bits_of(self.rounded(m, x), m.dtype)
            return code if code >= 0 else code ^ (1 << m.float_size - 1) - 1
        x = clamp(x, -(2.0 ** (self.B - 1)), 2.0 ** (self.B - 1) - 1) if x == x else 0.0
        return math.floor(x + 0.5) if abs(x) < 2.0**52 else int(x)

    def expected(self, k, prediction):
        """The code, the size, the spread that are expected, and the unit."""
        m = self.maps[k]
        code = self.code_near(k, prediction)
        x = self.rounded(m, prediction) if m.by_value and not m.has_table else prediction
        same = all(g.plain for g in self.maps[k - k % 3 : k - k % 3 + 3])
        unit = self.unit(m, x if same or m.dtype != "f4" else prediction)
        sizes = [t.size[k] for t in self.near] or [self.last.size[k]]
        wide = max(sizes) - min(sizes)
        parallelograms = len(self.sums) > 1 if self.array.domain else 12 <= self.situation < 24
        group = 0 if self.full else 3 if self.situation == 31 else 1 if parallelograms else 2
        return code, clamp(sum(sizes) // len(sizes) - unit, 0, 2 * self.B - 1), 3 * group + (wide > 2) + (wide > 7), unit

    @staticmethod
    def unit(m, x):
        if m.has_table or m.kind != 1:
            return 0
        if m.digits:
            return m.digits.unit(x)
        exponent = (bits_of(x, "f8") >> 52 & 2047) - 1023
        return 2 * (max(exponent + 127, 1) - 150) if m.dtype == "f4" else 2 * (max(exponent, -1022) - 52)

    # --- residuals

    def first_stage(self, k, x, spread):
        """The residual, or none and its length."""
        m, lane, q = min(k, 2), k % 3, self.sequence
        f = q.symbol(self.small[m, x, spread], lane) if x < 7 else 15
        if f < 15:
            return unzigzag(f), None
        o = x // 2
        s = q.symbol(self.lengths[m, min(o, 19), spread], lane)
        return None, min(max(o - 7, 0) + s if s < 15 else q.raw(7, lane), self.B)

    def rest(self, k, residual, length):
        if not length:
            return residual or 0
        m, lane, q = min(k, 2), k % 3, self.sequence
        n = min(length - 1, 3)
        left = after = length - 1 - n
        head, w = q.symbol(self.heads[m, length], lane), min(left, 8)
        v = (1 << n) + head % (1 << n)
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
            rise = 1 << w - 4 if self.lasts[m, length, head] == t else -1
            self.scores[m, length] = clamp(self.scores[m, length] + rise, -255, 255)
            self.lasts[m, length, head] = t
        return wrap(-v if head >> n & 1 else v, self.B)
