"""Section 16.7 of docs/format.md: positions and arrays of mode stream."""
import math
from collections import defaultdict
import numpy as np
from container import clamp, unzigzag, wrap
from entropy import CodedSequence, Models
from maps import MOST, bits_of, exponent_of, f32, narrow_float, ordered, real

F32 = np.float32

def half_octaves(x):
    """Bits 22 to 30 of |x| as f32."""
    return bits_of(F32(clamp(abs(x), 0.0, 1e39) if x == x else x), "f4") >> 22 & 511

class Weights:
    """Least squares: as 14.6 has them (`rare`), and of twists (16.7)."""

    def __init__(self, n, rare=False):
        self.n, self.g, self.samples, self.rare = n, F32(1), 0, rare
        self.M, self.T, self.weights = np.zeros((n, n), "f4"), np.zeros(n, "f4"), np.zeros(n, "f4")

    def learn(self, f, target, certainty):
        w = F32(certainty) * self.g
        fw, tw = f * w, F32(target) * w
        if not ((np.abs(fw) < 1e6).all() and abs(tw) < 1e6):
            if self.rare:
                return
            fw, tw = np.zeros(self.n, "f4"), F32(0)
        self.M += np.tril(np.outer(fw, fw).astype("f4"))
        self.T += fw * tw
        self.g *= F32(1.0002)
        if self.g > 1024:
            self.M, self.T, self.g = self.M * F32(2.0**-20), self.T * F32(2.0**-20), self.g * F32(2.0**-10)
        self.samples += 1
        if self.samples % (256 if self.rare and self.samples >= 1024 else 32) == 0:
            self.solve()

    def solve(self):
        S, x, g, D = self.M.astype("f8"), self.T.astype("f8"), float(self.g), np.zeros(self.n)
        S += np.diag(1e-4 * S.diagonal() + 1e-3 * g * g)
        L = np.zeros_like(S)
        for j in range(self.n):
            if not S[j, j] > 1e-12:
                return
            D[j] = 1 / S[j, j]
            below = S[j + 1 :, j].copy()
            L[j + 1 :, j] = below * D[j]
            S[j + 1 :, j + 1 :] -= np.outer(below, L[j + 1 :, j])
            x[j + 1 :] -= L[j + 1 :, j] * x[j]
        for i in reversed(range(self.n)):
            x[i] *= D[i]
            for k in range(i + 1, self.n):
                x[i] -= L[k, i] * x[k]
        if (np.abs(x) <= 1e4).all():
            self.weights = x.astype("f4")

class Kept:
    """What later tuples ask of one, by component."""

    def __init__(self, n):
        self.place, self.error, self.size, self.code, self.was = [0.0] * n, [0.0] * n, [0] * n, [0] * n, [False] * n
        self.twist, self.bend, self.residual = np.zeros((3, n), "f4")

class Values:
    """Tuples of an array, batch after batch."""
    lanes = 3

    def __init__(self, array, maps):
        self.array, self.maps, self.n, self.bytes = array, maps, array.components, int(array.dtype[1])
        self.B = 32 if self.bytes < 8 or all(m.has_factor for m in maps) else 64
        self.models, self.records = Models(), defaultdict(lambda: [16384, 16448, 16512])
        self.last_again, self.last_bits, self.had_exception = 0, 0, False
        self.fits, self.full_groups = defaultdict(lambda: Weights(7)), 0
        self.slots, self.last = defaultdict(lambda: Kept(self.n)), Kept(self.n)

    def batch(self, data, elements):
        self.q = CodedSequence(data, min(self.n, self.lanes), self.models)
        return [self.element(*element) for element in elements]

    def element(self, number, slot, sums, near, situation, corners):
        """Sums as lists of (slot, weight), or seven slots if full."""
        self.situation, self.full = situation, situation < 8
        self.sums = [self.slots[s] if self.full else [(self.slots[t], w) for t, w in s] for s in sums]
        self.near, self.own = [self.slots[s] for s in near], Kept(self.n)
        row = self.tuple(number, corners)
        self.last = self.own
        if slot is not None:
            self.slots[slot] = self.own
        return row

    def tuple(self, number, corners):
        return [x for first in range(0, self.n, 3) for x in self.group(range(first, min(first + 3, self.n)))]

    def group(self, components):
        own, staged, row = self.own, [], []
        for k in components:
            own.was[k] = self.flag(k)
        for k in components:
            candidates, record = self.candidates(k), self.records[k, self.situation]
            best = min(zip(record, range(3), candidates))[2]
            code, x, spread, unit = self.expected(k, best)
            first = (0, None) if own.was[k] else self.first_stage(k, x, spread)
            staged.append((k, candidates, best, code, unit, record, *first))
        self.full_groups += self.full
        for k, candidates, best, code, unit, record, residual, length in staged:
            if length is not None:
                residual = self.q.rest_of_residual(min(k, 2), length, self.B, k % 3, scored=True)
            c = wrap(code + residual, self.B)
            row.append(self.exception() if own.was[k] else self.maps[k].stored(c, self.array.dtype))
            own.place[k] = real(best) if own.was[k] else self.place(k, c)
            own.size[k] = half_octaves(f32(2 * F32(abs(residual)) + F32(1))) - 254 + unit
            own.twist[k] = F32(own.place[k] - candidates[0])
            for i, candidate in enumerate(candidates):
                record[i] += half_octaves(own.place[k] - candidate) - record[i] // 64
            if self.full and self.n <= 16 and (self.full_groups <= 16384 or self.full_groups % 4 == 0):
                f = np.array([s.twist[k] for s in self.sums], "f4")
                largest = np.abs(f).max()
                self.fits[k, self.situation].learn(f, own.twist[k], F32(1) / largest if largest else 0)
        return row

    def place(self, k, c):
        m = self.maps[k]
        return m.value(c) if m.by_value or m.digits else float(c)

    # --- exceptions

    def flag(self, k):
        if not self.maps[k].flags:
            return False
        there, last = [t.was[k] for t in self.near], self.last.was[k]
        around = 2 * last if not there else any(there) + all(there)
        before = [1 + self.own.was[j] for j in range(k) if self.maps[j].flags][-1:]
        flag = self.q.bit("Mask", 1 + 6 * around + 3 * last + sum(before) if self.had_exception else 0)
        self.had_exception |= flag
        return flag

    def exception(self):
        self.last_again, q = self.q.bit("Again", self.last_again), self.q
        if not self.last_again:
            self.last_bits = q.raw(8) if self.bytes == 1 else sum(q.raw(16) << 16 * i for i in range(self.bytes // 2))
        return self.last_bits

    # --- predictions

    def candidates(self, k):
        if self.full:
            A, B, C, D, E, F, G = (t.place[k] for t in self.sums)
            first, weights = ((A + B) + C) - ((D + E) + F) + G, self.fits[k, self.situation].weights
            correction = sum((w * t.twist[k] for w, t in zip(weights, self.sums)), F32(0))
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
            return (m if m.has_table else m.digits).code(x)
        if m.by_value:
            return ordered(bits_of(self.rounded(m, x), m.dtype), m.size)
        x = clamp(real(x), -(2.0 ** (self.B - 1)), 2.0 ** (self.B - 1) - 1)
        return math.floor(x + 0.5) if abs(x) < 2.0**52 else int(x)

    def expected(self, k, prediction):
        """The code, the size, the spread that are expected, and the unit."""
        m = self.maps[k]
        x = self.rounded(m, prediction) if m.by_value and not m.has_table else prediction
        same = all(g.plain for g in self.maps[k - k % 3 : k - k % 3 + 3])
        unit = self.unit(m, x if same or m.dtype != "f4" else prediction)
        sizes = [t.size[k] for t in self.near] or [self.last.size[k]]
        wide = max(sizes) - min(sizes)
        parallelograms = len(self.sums) > 1 if self.array.domain else 12 <= self.situation < 24
        group = 0 if self.full else 3 if self.situation == 31 else 1 if parallelograms else 2
        size = clamp(sum(sizes) // len(sizes) - unit, 0, 2 * self.B - 1)
        return self.code_near(k, prediction), size, 3 * group + (wide > 2) + (wide > 7), unit

    @staticmethod
    def unit(m, x):
        if m.has_table or m.kind != 1 or m.digits:
            return m.digits.unit(x) if m.digits else 0
        return 2 * (max(exponent_of(x) - 896, 1) - 150 if m.dtype == "f4" else max(exponent_of(x) - 1023, -1022) - 52)

    def first_stage(self, k, x, spread):
        """The residual, or none and its length."""
        f, m = self.q.symbol("Small", min(k, 2), x, spread, lane=k % 3) if x < 7 else 15, min(k, 2)
        return (unzigzag(f), None) if f < 15 else (None, self.q.length_of_residual(m, x, spread, self.B, k % 3))
