"""Section 10.6 of docs/format.md: maps, which say which numbers codes stand for; digits of 16.1."""
import math
from bisect import bisect_left
import numpy as np
from container import clamp, wrap
from description import DTYPES
from entropy import CodedSequence

MOST = {kind: float(np.finfo(kind).max) for kind in ("f4", "f8")}
FIELDS = {2: "h", 3: "h", 4: "dd", 5: "Bbh", 6: "Bbh", 7: "dd"}  # behind the kind of a map

def real(x): return 0.0 if x != x else x
def dot(a, b): return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
def f32(x): return float(np.float32(x))

def bits_of(x, kind): return int(np.array(x, kind).view("i" + kind[1]))

def ordered(x, size):
    """Signed bits of a float from a code of kind 1; the code from the bits just as well."""
    x = wrap(x, size)
    return x if x >= 0 else wrap(x ^ (1 << size - 1) - 1, size)

def narrow_float(x, kind):
    """A double as a number of a floating type: clamped to its finite numbers."""
    x = clamp(x, -MOST[kind], MOST[kind]) if x == x else x
    return f32(x) if kind == "f4" else x

def ten(x, k):
    """x * 10^k"""
    return x * 10.0**k if k >= 0 else x / 10.0**-k

def exponent_of(x):
    """The biased exponent in the bits of a double."""
    return bits_of(x, "f8") >> 52 & 2047

def half(x, low=0.0, high=math.inf):
    """13.3: half octaves."""
    m, e = math.frexp(clamp(x, low, high) if x == x else low)
    return 2 * (e - 1) + (m >= 0.75)

def octahedral(i, j, steps):
    """13.1: the unit vector of two codes."""
    x, y = i / steps, j / steps
    z = 1 - abs(x) - abs(y)
    if z < 0:
        x, y = (1 - abs(y)) * (-1.0 if x < 0 else 1.0), (1 - abs(x)) * (-1.0 if y < 0 else 1.0)
    return tuple(a / math.sqrt(x * x + y * y + z * z) for a in (x, y, z))

def scaled(x, q, base=10):
    """x * base^q, by powers of ten that doubles hold exactly."""
    if base == 2:
        return float(np.ldexp(x, q))
    whole = max(abs(q) - 1, 0) // 22
    for left in [22] * whole + [abs(q) - 22 * whole]:
        x = x / 10.0**left if q < 0 else x * 10.0**left
    return x

def power(x):
    """Kind 7: 2^x."""
    x = clamp(x, -2000.0, 2000.0)
    whole = math.floor(x)
    rest = f = x - whole
    a, b = 0.4426950408889634, -0.16404256133344508
    for _ in range(4):
        logarithm = f + f * (1 - f) * (a + b * f)
        f -= (logarithm - rest) / (1 + (1 - 2 * f) * (a + b * f) + f * (1 - f) * b)
    return float(np.ldexp(1 + f, whole))

class Digits:
    """16.1: significant digits."""

    def __init__(self, d):
        self.d, self.F = d, 10 ** (d - 1)

    def value(self, c):
        decade, mantissa = divmod(abs(c) - 1, 9 * self.F)
        x = 0.0 if c == 0 or decade > 20 else ten(float(mantissa + self.F), decade - 6 - self.d + 1)
        return -x if c < 0 else x

    @staticmethod
    def exponent(x):
        x = abs(x)
        e = max(-6, (math.frexp(x)[1] - 1) * 1233 // 4096) if x else -6
        e += ten(x, -e) >= 10
        e -= ten(x, -e) < 1
        return max(e, -6)

    def code(self, x):
        if not 1e-6 <= abs(x) < 1e15:
            return 0
        e = self.exponent(x)
        mantissa = max(math.floor(ten(abs(x), self.d - 1 - e) + 0.5), self.F)
        c = (e + 6) * 9 * self.F + mantissa - self.F + 1  # 10F is F with e + 1
        return -c if x < 0 else c

    def unit(self, x): return int((self.exponent(x) - self.d + 1) * 6.644)

class Decimals:
    """16.1: decimals of f32, and bits of larger ones."""

    def __init__(self, d):
        self.d, self.E = d, next(2.0**e for e in range(-10, 99) if 2.0**e * 10.0**d >= 0.9 * 2**23)
        self.N, self.bits = math.floor(self.E * 10.0**d + 0.5), bits_of(self.E, "f4")

    def value(self, c):
        n = abs(c)
        of_bits = np.array(min(self.bits + max(n - self.N, 0), 0x7F7FFFFF), "u4").view("f4")
        x = float(n) / 10.0**self.d if n < self.N else float(of_bits)
        return -x if c < 0 else x

    def code(self, x):
        n = abs(x)
        more = bits_of(narrow_float(n, "f4"), "f4") - self.bits
        c = math.floor(n * 10.0**self.d + 0.5) if n < self.E else self.N + more
        return -c if x < 0 else c

    def unit(self, x):
        return int(-self.d * 6644 / 1000) if abs(x) < self.E else 2 * (math.frexp(x)[1] - 1 - 23)

class Map:
    """The map of one component. `kind` is that of the text without + 64 and + 128."""

    def __init__(self, fields, dtype, tables=None):
        """`tables`: mode stream, which has tables apart, and digits of kind 1 (16.1)."""
        self.dtype, self.is_float, kind = DTYPES[dtype], dtype >= 8, fields.u8()
        self.kind, self.has_factor, self.has_table = kind & 63, bool(kind & 64), bool(kind & 128)
        self.own = fields.numbers(FIELDS.get(self.kind, ""))
        self.code_size = 64 if dtype in (6, 7, 9) and not self.has_factor else 32
        self.factor = 1.0
        if self.has_factor:
            self.dtype, self.factor = "f4", fields.number("d")  # the map is for f32 then
        self.size = 8 * int(self.dtype[1])
        self.table = self.read_table(tables or fields) if self.has_table else None
        digits = fields.u8() if tables and self.kind == 1 else 0
        self.digits = Decimals(digits - 128) if digits > 128 else Digits(digits) if digits else None
        self.by_value = self.has_table or self.kind == 1 and not digits  # 16.7: what places are
        self.plain = self.kind == 1 and not (digits or self.has_factor or self.has_table)
        self.flags = self.kind != 0 and not self.plain  # whether exceptions are told
        self.curved = self.kind in (1, 5, 6) or self.has_table
        self.base = 2 if self.kind == 5 else 10

    def read_table(self, fields):
        n, sequence = fields.count(), CodedSequence(fields.section())
        codes, before, sides, distance = [], 0, 0, -1
        while len(codes) < n:
            before = l = min(sequence.tree(7, "length", before), 64)
            gap, left = int(l > 0), max(l - 3, 0)
            for _ in range(clamp(l - 1, 0, 2)):
                gap = 2 * gap + sequence.bit("top", l, gap % 4)
            distance += (gap << left | sequence.raws(left)) + 1
            sides = 3 if sequence.bit("both", sides) else 1 + sequence.bit("above", sides)
            codes += (sides & 1) * [-distance - (self.kind in (1, 5, 6))] + (sides >> 1) * [distance]
        return sorted(codes)

    # --- codes to numbers

    def value(self, c):
        """The number of c as a double, for kinds 5 and 6 without a table before it is rounded; NaN counts as 0."""
        return real(self.plain_number(c) if self.table is None else float(self.number(c)))

    def plain_number(self, c):
        """The double that the map computes for c, not rounded to the type."""
        if self.digits:
            return self.digits.value(c)
        if self.kind < 2:
            bits = (ordered(c, self.size) if self.kind else c) & (1 << self.size) - 1
            return np.array(bits, "u" + self.dtype[1]).view(self.dtype).item()
        if self.kind < 4:
            return float(c) * math.ldexp(1.0, self.own[0]) if self.kind == 3 else float(c) / 10.0 ** self.own[0]
        if self.kind == 4:
            return self.own[0] + float(c) * self.own[1]
        if self.kind == 7:
            return 0.0 if c == 0 else math.copysign(power((self.own[0] + abs(c)) * self.own[1]), c)
        p, f, q = max(c, -1 - c), self.base ** self.own[0], self.own[2]
        if p >= f:
            k, m = divmod(p - f, f - f // self.base)
            p, q = f // self.base + m, min(q + 1 + k, 2000)
        x = scaled(float(p), q, self.base)
        return -x if c < 0 else x

    def plain_code(self, c):
        return c if self.table is None else self.table[clamp(c, 0, len(self.table) - 1)]

    def number(self, c):
        """The number of c as the type has it."""
        x = self.plain_number(self.plain_code(c))
        if self.kind == 0:
            return x
        if self.kind in (5, 6) and self.own[1] >= 0:
            y = narrow_float(x, "f4") * 10.0 ** self.own[1]
            x = math.copysign(np.rint(abs(y)), y) / 10.0 ** self.own[1]
        if not self.is_float:
            limits = np.iinfo(self.dtype)
            return 0 if x != x else clamp(math.floor(clamp(x + 0.5, -1e30, 1e30)), int(limits.min), int(limits.max))
        return (x if self.kind == 1 and not self.digits else narrow_float(x, self.dtype)) * self.factor

    def stored(self, c, kind):
        """The bits of the number of c in an array of this kind."""
        if self.kind == 1 and not self.has_factor and not self.digits:
            return ordered(self.plain_code(c), self.size) & (1 << self.size) - 1
        return int(np.array(self.number(c), kind).view("u" + kind[1]))

    # --- numbers to codes

    def code(self, x):
        """The code nearest to x: 13.4 for maps that are not curved, 10.6 for those that are."""
        if self.has_factor:
            x = f32(x / self.factor)
        if not self.curved:
            return self.straight_code(x)
        x = real(x)
        if self.table is not None:
            i = bisect_left(range(len(self.table)), x, key=self.value)
            return i - (i == len(self.table) or i > 0 and x - self.value(i - 1) < self.value(i) - x)
        if self.kind == 1:
            return ordered(bits_of(narrow_float(x, self.dtype), self.dtype), self.size)
        return self.digits_code(x)

    def straight_code(self, x):
        e = self.own[0] if self.own else 0
        if self.kind in (2, 3):
            x = x * 10.0**e if self.kind == 2 else float(np.ldexp(x, -e))
        elif self.kind == 4:
            x = (x - e) / self.own[1] if self.own[1] else 0.0
        return wrap(math.floor(x + 0.5), self.code_size) if abs(x) < 9e18 else 0

    def digits_code(self, x):
        s, f, least = min(abs(x), MOST["f8"]), self.base ** self.own[0], self.own[2]

        def rounded(q):
            y = scaled(s, -q, self.base)
            return math.floor(y + 0.5) if y < 2.0**52 else int(y)

        q = least if self.base == 10 else max(least, (math.frexp(s)[1] if s else -2000) - self.own[0])
        while self.base == 10 and rounded(q) >= f:
            q += 1
        p = rounded(q) + ((q - least) * (f - f // self.base) if q > least else 0)
        return 0 if p == 0 and s > 0 else -1 - p if math.copysign(1.0, x) < 0 else p

    def step_at(self, p):
        """The distance of neighbouring numbers at p (13.5)."""
        if self.curved:
            c = self.code(p)
            return abs(self.value(c + 1) - self.value(c))
        return abs(self.own[1]) if self.kind == 4 else abs(float(self.number(1))) if self.is_float else 1.0

class Details:
    """Refined numbers: exact maps, and the differences to what the coarse codes say."""

    def __init__(self, fields, dtype, components):
        self.exact = [Map(fields, dtype) if fields.u8() else None for _ in range(components)]

    def read(self, data, coarse, codes):
        """Rows of numbers for codes[tuple][component]."""
        q, s, n = CodedSequence(data), clamp(1 + len(codes).bit_length(), 6, 14), len(self.exact)
        seen, history, zeros_before, rows = [{} for _ in range(n)], [0] * n, [0] * n, []
        for row in codes:
            others, made = 0, []
            for k, (c, exact) in enumerate(zip(row, self.exact)):
                if exact is None:
                    made.append(coarse[k].number(c))
                    continue
                base = exact.code(coarse[k].value(c))
                i = (base * 11400714819323198485 & 2**64 - 1) >> 64 - s
                known, detail = seen[k].get(i, (None, 0))
                if known != base or not q.bit("same", k, detail == 0):
                    z, detail = q.bit("zero", k, others, history[k]), 0
                    history[k] = (2 * history[k] + z) % 8
                    if not z:
                        negative = q.bit("sign", k)
                        zeros_before[k] = zeros = q.tree(6, "zeros", k, zeros_before[k])
                        length = 1 + q.tree(6, "length", k, min(zeros, 7))
                        odd = 2 + q.bit("second", k, length) if length > 2 else 1
                        odd = odd << max(length - 3, 0) | q.raws(length - 3)
                        detail = ((2 * odd + 1 if length > 1 else odd) << zeros) * (-1 if negative else 1)
                    seen[k][i] = base, detail
                others = (2 * others + (detail == 0)) % 4
                made.append(exact.number(wrap(base + detail, 64)))
            rows.append(made)
        return rows
