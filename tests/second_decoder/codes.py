"""Section 10.6 of docs/format.md: maps, which say which numbers codes stand for."""

import math
import struct

import numpy as np

from container import Fields, require
from entropy import CodedSequence, bits

DTYPES = ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"]
F32_MOST = float(np.finfo(np.float32).max)
F64_MOST = float(np.finfo(np.float64).max)


def wrap(x, size):
    """10.1: the signed number of `size` bits."""
    x &= (1 << size) - 1
    return x - (1 << size) if x >> size - 1 else x


def clamp(x, low, high):
    return max(low, min(x, high))


def f32(x):
    return float(np.float32(x))


def bits_of(x, kind):
    return struct.unpack("<" + {"f4": "i", "f8": "q"}[kind], struct.pack("<" + kind[0] if kind == "f4" else "<d", x))[0]


def from_bits(x, kind):
    form = {"f4": "If", "f8": "Qd"}[kind]
    return struct.unpack("<" + form[1], struct.pack("<" + form[0], x))[0]


def narrow_float(x, kind):
    """A double as a number of a floating type: clamped to its finite numbers."""
    if kind == "f8" or x != x:
        return clamp(x, -F64_MOST, F64_MOST) if x == x else x
    return f32(clamp(x, -F32_MOST, F32_MOST))


def binary_power(e):
    return 0.0 if e < -1074 else math.ldexp(1.0, e)


def exponent_of(x):
    """The biased exponent in the bits of a double."""
    return bits_of(x, "f8") >> 52 & 2047


class Map:
    """The map of one component. `kind` is that of the text without + 64 and + 128."""

    def __init__(self, fields, dtype, tables=None):
        """`tables`: mode stream, which has tables apart, and digits of kind 1 (16.1)."""
        self.dtype = DTYPES[dtype]
        self.is_float = dtype >= 8
        kind = fields.u8()
        self.kind, self.has_factor, self.has_table = kind & 63, bool(kind & 64), bool(kind & 128)
        require(self.kind <= 7 and (self.is_float or self.kind in (0, 4)) and not (self.is_float and self.kind == 0), "a map that its type cannot have")
        self.size = 64 if dtype in (6, 7, 9) else 32
        if self.has_factor:
            self.dtype = "f4"  # the map behind the factor
        read = [lambda: None, lambda: None, self._power, self._power, self._lattice, self._digits, self._digits, self._logarithm]
        read[self.kind](fields)if self.kind > 1 else None
        self.factor = fields.f64() if self.has_factor else None
        self.code_size = 32 if self.has_factor else self.size
        self.table = self._table(tables or fields) if self.has_table else None
        self.digits = fields.u8() if tables and self.kind == 1 else 0
        self.curved = self.kind in (1, 5, 6) or self.has_table

    def _power(self, fields):
        self.e = fields.number("h")

    def _lattice(self, fields):
        self.origin, self.step = fields.f64(), fields.f64()

    def _digits(self, fields):
        self.d, self.t, self.e = fields.u8(), fields.number("b"), fields.number("h")

    def _logarithm(self, fields):
        self.origin, self.step = fields.f64(), fields.f64()

    def _table(self, fields):
        n = fields.count()
        require(n >= 1, "a table of no numbers")
        sequence, length, top = CodedSequence(fields.section()), bits(), bits()
        both, above = bits(), bits()
        codes, before, sides, distance = [], 0, 0, -1
        while len(codes) < n:
            prefix = sequence.tree(length, 7, before)
            l = min(prefix - 128, 64)
            gap, left = int(l > 0), l - 1
            while left > 0:
                if l - left <= 2:
                    gap = 2 * gap + sequence.bit(top[l, gap % 4])
                    left -= 1
                else:
                    r = min(left, 16)
                    gap = gap << r | sequence.raw(r)
                    left -= r
            before = l
            distance += gap + 1
            sides = 3 if sequence.bit(both[sides]) else 1 + sequence.bit(above[sides])
            codes += [-1 - distance if self.kind in (1, 5, 6) else -distance] if sides & 1 else []
            codes += [distance] if sides & 2 else []
        sequence.end()
        require(len(codes) == n, "a table of another size")
        require(distance < 2**63, "a table's codes of more than 63 bits")
        return sorted(codes)

    # --- codes to numbers

    def value(self, c):
        """The number of c as a double, for kinds 5 and 6 without a table before it is rounded; NaN counts as 0."""
        x = self._plain(c) if self.table is None else self.as_double(c)
        return 0.0 if x != x else x

    def _plain(self, c):
        """The double that the map computes for c, not rounded to the type."""
        if self.kind == 0:
            return float(self.integer(c))
        if self.kind == 1:
            size = 32 if self.dtype == "f4" else 64
            c &= (1 << size) - 1
            return from_bits(c if c < 1 << size - 1 else c ^ (1 << size - 1) - 1, self.dtype)
        if self.kind == 2:
            return float(c) / 10.0**self.e
        if self.kind == 3:
            return float(c) * binary_power(self.e)
        if self.kind == 4:
            return self.origin + float(c) * self.step
        if self.kind in (5, 6):
            return self._digits_number(c)
        return 0.0 if c == 0 else math.copysign(power((self.origin + abs(c)) * self.step), c)

    def integer(self, c):
        bits_ = 8 * int(self.dtype[1])
        return wrap(c, bits_) if self.dtype[0] == "i" else c & (1 << bits_) - 1

    def _digits_number(self, c):
        base = 2 if self.kind == 5 else 10
        p, f = (c if c >= 0 else -1 - c), base**self.d
        n, m, q = f - f // base, p, self.e
        if p >= f:
            k = (p - f) // n
            m, q = f // base + (p - f) % n, min(self.e + 1 + k, 2000)
        x = float(m)
        if base == 2:
            x = math.ldexp(x, q) if q < 1100 else (math.inf if m else 0.0)
        else:
            x = scaled(x, q)
        return -x if c < 0 else x

    def number(self, c):
        """The number of c as the type has it."""
        if self.table is not None:
            c = self.table[clamp(c, 0, len(self.table) - 1)]
        if self.kind == 0:
            return self.integer(c)
        x = self._plain(c)
        if self.kind in (5, 6) and self.t >= 0:
            x = decimals(x, self.t)
        if not self.is_float:
            low, high = np.iinfo(self.dtype).min, np.iinfo(self.dtype).max
            return 0 if x != x else clamp(math.floor(clamp(x + 0.5, -1e30, 1e30)), int(low), int(high))
        if self.kind != 1:
            x = narrow_float(x, self.dtype)
        return x * self.factor if self.has_factor else x

    def as_double(self, c):
        return float(self.number(c))

    # --- numbers to codes

    def code(self, x):
        """The code nearest to x: 13.4 for maps that are not curved, 10.6 for those that are."""
        if self.has_factor:
            x = f32(x / self.factor)
        if not self.curved:
            return self._straight_code(x)
        x = 0.0 if x != x else x
        if self.table is not None:
            return self._rank(x)
        return self._ordered_code(x) if self.kind == 1 else self._digits_code(x)

    def _straight_code(self, x):
        c = x
        if self.kind == 2:
            c = x * 10.0**self.e
        elif self.kind == 3:
            c = x * binary_power(-self.e) if -self.e < 1024 else x * 2.0**1023 * binary_power(-self.e - 1023)
        elif self.kind == 4:
            c = (x - self.origin) / self.step if self.step else 0.0
        if c != c or abs(c) >= 9e18:
            return 0
        return wrap(math.floor(c + 0.5), self.code_size)

    def _ordered_code(self, x):
        size = 32 if self.dtype == "f4" else 64
        c = bits_of(narrow_float(x, self.dtype), self.dtype)
        return c if c >= 0 else wrap(c ^ (1 << size - 1) - 1, size)

    def _digits_code(self, x):
        base = 2 if self.kind == 5 else 10
        s, f = min(abs(x), F64_MOST), base**self.d

        def rounded(q):
            x = math.ldexp(s, -q) if base == 2 else scaled(s, -q)
            return math.floor(x + 0.5) if x < 2.0**52 else int(x)

        q = self.e
        if base == 2:
            q = max(q, (math.frexp(s)[1] if s else -2000) - self.d)
        else:
            while rounded(q) >= f:
                q += 1
        m = rounded(q)
        p = m if q == self.e else f + (q - self.e - 1) * (f - f // base) + m - f // base
        if p == 0 and s > 0:
            return 0
        return -1 - p if math.copysign(1.0, x) < 0 else p

    def _rank(self, x):
        low, high = 0, len(self.table)
        while low < high:
            middle = (low + high) // 2
            if self.value(middle) < x:
                low = middle + 1
            else:
                high = middle
        if low == len(self.table):
            return low - 1
        return low - 1 if low and x - self.value(low - 1) < self.value(low) - x else low

    def step_at(self, p):
        """The distance of neighbouring numbers at p (13.5)."""
        if self.curved:
            c = self.code(p)
            return abs(self.value(c + 1) - self.value(c))
        if self.kind == 4:
            return abs(self.step)
        return abs(self.as_double(1)) if self.is_float else 1.0


def scaled(x, q):
    """x * 10^q, by powers that doubles hold exactly."""
    left = abs(q)
    while left > 22:
        x = x / 1e22 if q < 0 else x * 1e22
        left -= 22
    return x / 10.0**left if q < 0 else x * 10.0**left


def decimals(x, t):
    y = narrow_float(x, "f4")
    scaled = y * 10.0**t
    return math.copysign(round(abs(scaled)), scaled) / 10.0**t if abs(scaled) < 2**53 else scaled / 10.0**t


def power(x):
    x = clamp(x, -2000.0, 2000.0)
    whole = math.floor(x)
    rest = x - whole
    a, b, f = 0.4426950408889634, -0.16404256133344508, rest
    for _ in range(4):
        logarithm = f + f * (1 - f) * (a + b * f)
        f -= (logarithm - rest) / (1 + (1 - 2 * f) * (a + b * f) + f * (1 - f) * b)
    return math.ldexp(1 + f, whole) if whole < 1024 else math.inf


class Details:
    """Refined numbers: exact maps, and the differences to what the coarse codes say."""

    def __init__(self, fields, dtype, components):
        self.exact = [Map(fields, dtype) if fields.u8() else None for _ in range(components)]
        require(any(self.exact), "details of no component")

    def read(self, data, tuples, coarse, codes):
        """Lists of numbers for codes[tuple][component]."""
        sequence = CodedSequence(data)
        same, zero, sign, zeros_tree, length_tree, second = (bits() for _ in range(6))
        s = clamp(1 + tuples.bit_length(), 6, 14)
        n = len(self.exact)
        seen, history, zeros_before = [{} for _ in range(n)], [0] * n, [0] * n
        numbers = []
        for row in codes:
            others, out = 0, []
            for k, c in enumerate(row):
                exact = self.exact[k]
                if exact is None:
                    out.append(coarse[k].number(c))
                    continue
                base = exact.code(coarse[k].value(c))
                i = (base * 11400714819323198485 & 2**64 - 1) >> 64 - s
                known, detail = seen[k].get(i), None
                if known and known[0] == base and sequence.bit(same[k, known[1] == 0]):
                    detail = known[1]
                else:
                    z = sequence.bit(zero[k, others, history[k]])
                    history[k] = (2 * history[k] + z) % 8
                    detail = 0
                    if not z:
                        negative = sequence.bit(sign[k])
                        zeros = sequence.tree(zeros_tree, 6, zeros_before[k]) - 64
                        length = 1 + sequence.tree(length_tree, 6, k, min(zeros, 7)) - 64
                        zeros_before[k] = zeros
                        odd = 1
                        if length > 2:
                            odd = 2 + sequence.bit(second[k, length])
                        left = length - 3
                        while left > 0:
                            r = min(left, 16)
                            odd = odd << r | sequence.raw(r)
                            left -= r
                        if length > 1:
                            odd = 2 * odd + 1
                        detail = odd << zeros
                        detail = -detail if negative else detail
                    seen[k][i] = base, detail
                others = (2 * others + (detail == 0)) % 4
                out.append(exact.number(wrap(base + detail, 64)))
            numbers.append(out)
        return numbers
