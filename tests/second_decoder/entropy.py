"""Sections 10.2 to 10.5 of docs/format.md: coded sequences, models, static tables, mixed sequences."""

import math
from bisect import bisect_right
from collections import defaultdict
from functools import partial
from itertools import accumulate

from container import require

BLOCK = 131072
RATES = [1, 2, 2] + 4 * [3] + 9 * [4] + 32 * [5] + 143 * [6] + [7]
STEPS = [131072 // (2 * v + 3) for v in range(251)]


class Bit:
    __slots__ = ("p", "v")
    low, high, most = 32, 65504, 126

    def __init__(self):
        self.p, self.v = 32768, 0

    def learn(self, bit):
        self.p += ((self.high if bit else self.low) - self.p) * STEPS[self.v] >> 16
        self.v = min(self.v + 1, self.most)


class Symbol:
    __slots__ = ("c", "v")

    def __init__(self):
        self.c, self.v = [2048 * i for i in range(16)], 0

    def interval(self, s):
        return self.c[s], (self.c[s + 1] if s < 15 else 32768) - self.c[s]

    def learn(self, s):
        rate = RATES[self.v]
        self.v = min(self.v + 1, 191)
        self.c = [c + ((i if i <= s else 32752 + i) - c >> rate) for i, c in enumerate(self.c)]


bits, symbols = partial(defaultdict, Bit), partial(defaultdict, Symbol)  # by whatever stands in the brackets of the text


class Count:
    def __init__(self):
        self.symbol, self.length = Symbol(), bits()


class Offset:
    def __init__(self):
        self.symbol, self.sign, self.count = Symbol(), Bit(), Count()


counts = partial(defaultdict, Count)


class Operations:
    """The operations of 10.2, over slot(width, lane) and take(width, lane, start, frequency, slot)."""

    def raw(self, n, lane=0):
        slot = self.slot(n, lane)
        self.take(n, lane, slot, 1, slot)
        return slot

    def bit(self, model, lane=0):
        slot, p = self.slot(16, lane), model.p
        bit = int(slot < p)
        self.take(16, lane, 0 if bit else p, p if bit else 65536 - p, slot)
        model.learn(bit)
        return bit

    def symbol(self, model, lane=0):
        slot = self.slot(15, lane)
        s = bisect_right(model.c, slot) - 1
        self.take(15, lane, *model.interval(s), slot)
        model.learn(s)
        return s

    def long_raw(self, n, most=16):
        """n bits, `most` at a time, the highest first."""
        value = 0
        while n > 0:
            r = min(n, most)
            value, n = value << r | self.raw(r), n - r
        return value

    def count(self, model):
        s, n = self.symbol(model.symbol), 1
        if s < 15:
            return s
        while n <= 32 and self.bit(model.length[n]):
            n += 1
        return 14 + (1 << n - 1) + self.raw(n - 1) & 0xFFFFFFFF

    def offset(self, model):
        s = self.symbol(model.symbol)
        if s < 15:
            return s - 7
        negative = self.bit(model.sign)
        m = self.count(model.count) % 2**30 + 8
        return -m if negative else m

    def tree(self, models, n, *context):
        """n bits, highest first, each by the node that those before it lead to."""
        node = 1
        for _ in range(n):
            node = 2 * node + self.bit(models[context + (node,)])
        return node - (1 << n)


class CodedSequence(Operations):
    """10.2: blocks of states and words, read by asymmetric numeral systems."""

    def __init__(self, data, lanes=1):
        self.data, self.at, self.operations, self.x = data, 0, 0, [0] * lanes

    def word(self, size):
        self.at += size
        require(self.at <= len(self.data), "a coded sequence ends early")
        return int.from_bytes(self.data[self.at - size : self.at], "little")

    def slot(self, width, lane):
        if self.operations % BLOCK == 0:
            self.x = [self.word(8) for _ in self.x]
        self.operations += 1
        return self.x[lane] & (1 << width) - 1

    def take(self, width, lane, start, frequency, slot):
        x = frequency * (self.x[lane] >> width) + slot - start
        self.x[lane] = x << 32 | self.word(4) if x < 2**32 else x

    def end(self):
        """A reader MAY ignore what a writer MUST see to; this one looks, as it is here to find fault."""
        require(self.at == len(self.data), "bytes behind the last word of a coded sequence")
        require(not self.operations or all(x == 2**32 for x in self.x), "a coded sequence does not end with states of 2^32")


# --- 10.3 and 10.4: static tables, and symbols with them

OCTAVE = [32768, 34219, 35734, 37316, 38968, 40693, 42495, 44376, 46341, 48393, 50535, 52773, 55109, 57549, 60097, 62757]


class Table:
    def __init__(self, depths, R, b):
        halvings = [(l - 1) * 16 // R for l in depths]
        weights = [OCTAVE[-d % 16] * 32768 >> (d + 15) // 16 if l else 0 for l, d in zip(depths, halvings)]
        total = sum(weights)
        frequencies = [max(1, (w << b) // total) if w else 0 for w in weights]
        while sum(frequencies) > 1 << b:
            frequencies[frequencies.index(max(frequencies))] -= 1
        frequencies[frequencies.index(max(frequencies))] += (1 << b) - sum(frequencies)
        self.frequencies, self.starts, self.b = frequencies, list(accumulate(frequencies, initial=0)), b

    def step(self, x):
        slot = x & (1 << self.b) - 1
        s = bisect_right(self.starts, slot) - 1
        return s, self.frequencies[s] * (x >> self.b) + slot - self.starts[s]


def tables(sequence, contexts, size, most, b):
    """The table of each context."""
    count_model, new, which, length, there, step = Count(), Bit(), Count(), Count(), bits(), defaultdict(Offset)
    R = 2 ** min(sequence.raw(3), 4)
    n = min(sequence.count(count_model), most - 1) + 1
    known, runs = 0, [0] * contexts if n == 1 else []
    while len(runs) < contexts:
        if known == 0 or known < n and sequence.bit(new):
            table, known = known, known + 1
        else:
            table = min(sequence.count(which), known - 1)
        runs += [table] * min(sequence.count(length) + 1, contexts - len(runs))
    old, made = [0] * size, []
    for _ in range(n):
        depth, last = [0] * size, R
        for s in range(size):
            if sequence.bit(there[2 * (old[s] > 0) + (s > 0 and depth[s - 1] > 0)]):
                move = sequence.offset(step[old[s] > 0])
                old[s] = depth[s] = last = max(1, min((old[s] or last) + move, 10 * R + 1))
        made.append(Table(depth, R, b))
    return [made[table] for table in runs]


class StaticSymbols:
    """States, and one row of words that all of them take from when they fall below `lowest`."""

    def __init__(self, data, lanes, state_bytes, word_bytes, lowest):
        require(len(data) >= lanes * state_bytes, "a row of symbols lacks its states")
        self.x = [int.from_bytes(data[i * state_bytes :][:state_bytes], "little") for i in range(lanes)]
        self.data, self.at, self.word_bytes, self.lowest = data, lanes * state_bytes, word_bytes, lowest

    def refill(self, lane, x):
        if x < self.lowest:
            x = x << 8 * self.word_bytes | int.from_bytes(self.data[self.at : self.at + self.word_bytes], "little")
            self.at += self.word_bytes
            require(self.at <= len(self.data), "a row of symbols ends early")
        self.x[lane] = x

    def symbol(self, lane, table):
        s, x = table.step(self.x[lane])
        self.refill(lane, x)
        return s

    def end(self):
        require(self.at == len(self.data), "bytes behind the last symbol")


class Events(StaticSymbols):
    def __init__(self, data):
        super().__init__(data, 1, 8, 4, 2**31)

    def raw(self, n):
        value = self.x[0] & (1 << n) - 1
        self.refill(0, self.x[0] >> n)
        return value

    def number(self, table):
        s = self.symbol(0, table)
        n = s - 9
        return s if s < 12 else (1 << n) + self.raw(min(n, 16)) + (self.raw(n - 16) << 16 if n > 16 else 0)


class RawBits:
    """12.3: raw bits, lowest bit of the first byte first."""

    def __init__(self, data):
        self.bits, self.left = int.from_bytes(data, "little"), 8 * len(data)

    def raw(self, n):
        self.left -= n
        require(self.left >= 0, "raw bits end early")
        value = self.bits & (1 << n) - 1
        self.bits >>= n
        return value


# --- 10.5: mixed sequences


class MixedSequence(Operations):
    def __init__(self, data):
        self.data, self.at, self.range, self.value = data, 0, 2**64 - 1, 0
        self.value = self.next(8)

    def next(self, n):
        self.at += n
        require(self.at <= len(self.data) + 4, "a mixed sequence ends early")
        return self.value << 8 * n | int.from_bytes(self.data[self.at - n : self.at].ljust(n, b"\0"), "big")

    def refill(self):
        if self.range < 2**32:
            self.range <<= 32
            self.value = self.next(4)

    def decision(self, p):
        bound = (self.range >> 16) * p
        bit = int(self.value < bound)
        self.value -= 0 if bit else bound
        self.range = bound if bit else self.range - bound
        self.refill()
        return bit

    def slot(self, width, lane):
        return min(self.value // (self.range >> width), (1 << width) - 1)

    def take(self, width, lane, start, frequency, slot):
        unit = self.range >> width
        self.value, self.range = self.value - unit * start, unit * frequency
        self.refill()

    def bit(self, model, lane=0):
        bit = self.decision(model.p)
        model.learn(bit)
        return bit

    def end(self):
        require(self.at >= len(self.data), "bytes behind a mixed sequence")


LOGISTIC = [math.floor(65536 / (1 + math.exp(-x / 256)) + 0.5) for x in range(-2048, 2048)]
LOGIT = [max(-2047, min(2047, round(256 * math.log((i + 0.5) / (4095.5 - i))))) for i in range(4096)]


def logistic(x):
    return LOGISTIC[x + 2048]


def hash32(h, v):
    g = (h ^ v & 0xFFFFFFFF) * 2654435761 & 0xFFFFFFFF
    return g ^ g >> 15


class Cell(Bit):
    """A wide cell."""

    __slots__ = ()
    low, high, most = 0, 65535, 250

    def logit(self):
        return LOGIT[self.p >> 4] * (512 * self.v // (2 * self.v + 3)) >> 8


class Mixer:
    def __init__(self, n, weight):
        weights = weight if isinstance(weight, list) else [weight] * n
        self.rows = [defaultdict(lambda: list(weights)) for _ in range(2)]
        self.maps = defaultdict(lambda: [logistic(max(-2047, min(128 * k - 2048, 2047))) for k in range(34)])
        self.rate, self.decisions = 1966, 0

    def bit(self, sequence, inputs, row0, row1, map_):
        rows = self.rows[0][row0], self.rows[1][row1]
        dots = [max(-2047, min(sum(w * x for w, x in zip(row, inputs)) >> 14, 2047)) for row in rows]
        m = sum(dots) >> 1
        k, w, table = m + 2048 >> 7, (m + 2048) % 128, self.maps[map_]
        a = table[k] * (128 - w) + table[k + 1] * w >> 7
        bit = sequence.decision(max(24, min(logistic(m) + a + 1 >> 1, 65512)))
        for row, z in zip(rows, dots):
            step = (65536 * bit - logistic(z)) * self.rate >> 13
            row[:] = [max(-32768, min(v + ((16 * x * step >> 16) + 1 >> 1), 32767)) for v, x in zip(row, inputs)]
        table[k + (w >> 6)] += 65535 * bit - table[k + (w >> 6)] >> 7
        self.decisions += 1
        if self.decisions % 256 == 0:
            self.rate = 131 + 1835 * 300000 // (300000 + self.decisions)
        return bit


class Run:
    """16.4: flags that are nearly always the same."""

    def __init__(self):
        self.p, self.v = 1 << 31, 0

    def read(self, sequence):
        bit = sequence.decision(max(self.p >> 16, 1))
        change = ((2**32 - 1) * bit - self.p) * (655360 // (10 * self.v + 16))
        self.p += change // 65536 if change >= 0 else -(-change // 65536)
        self.v = min(self.v + 1, 1000)
        return bit


class Difference:
    """16.4: signed numbers of 64 bits."""

    def __init__(self):
        self.length, self.sign, self.head = bits(), bits(), bits()

    def read(self, sequence):
        n = sequence.tree(self.length, 6)
        negative, size = sequence.bit(self.sign[n]), int(n > 0)
        for i in range(n - 1):
            size = 2 * size + (sequence.bit(self.head[8 * n + size]) if i < 2 else sequence.raw(1))
        return -size - 1 if negative else size


class Asker:
    """16.6: ask, with the cells and the mixer that a set of questions has."""

    def __init__(self, mixed):
        self.mixed, self.t, self.few = mixed, 14, 0
        self.cells, self.mixer, self.signature, self.sequence = defaultdict(Cell), Mixer(4, 5000), 0, None

    def cell(self, x):
        return self.cells[(x * 2654435761 & 0xFFFFFFFF) >> 32 - self.t]

    def __call__(self, Q, local, nearby, valence):
        base, before = hash32(Q + 1, local), self.signature
        cell = self.cell(base) if self.mixed else self.cells[base >> 18]
        if not self.mixed or cell.v >= 100 and cell.p < 128:
            bit = self.sequence.decision(max(32, min(cell.p, 65504)))
            cell.learn(bit)
        else:
            hashes = (valence + 196608, base), (before + 262144, base), (before + 458752, hash32(base, nearby + 131072))
            cells = [cell] + [self.cell(hash32(h, v)) for v, h in hashes]
            few = max(sum(c.v > 2 for c in cells) - 1, 0)
            self.few += sum(c.v < 2 for c in cells)
            bit = self.mixer.bit(self.sequence, [c.logit() for c in cells], 8 * Q + few, 16 * Q + local % 16, Q)
            for c in cells:
                c.learn(bit)
            if self.few > 1 << self.t - 1 and self.t < 18:
                self.grow()
        self.signature = hash32(before, bit)
        return bit

    def grow(self):
        self.few, self.t, old, self.cells = 0, self.t + 1, self.cells, defaultdict(Cell)
        for i, c in old.items():
            for j in (2 * i, 2 * i + 1):
                self.cells[j].p, self.cells[j].v = c.p, min(c.v, 1)
