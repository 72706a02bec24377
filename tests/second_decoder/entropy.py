"""Sections 10.2 to 10.5 of docs/format.md: coded sequences, models, static tables, mixed sequences."""

import math
from bisect import bisect_right
from collections import defaultdict

from container import Refused, require, unzigzag

BLOCK = 131072
RATES = [1, 2, 2] + 4 * [3] + 9 * [4] + 32 * [5] + 143 * [6] + [7]
STEPS = [131072 // (2 * v + 3) for v in range(1100)]


class Bit:
    __slots__ = ("p", "v")

    def __init__(self):
        self.p, self.v = 32768, 0

    def learn(self, bit):
        self.p += ((65504 if bit else 32) - self.p) * STEPS[self.v] >> 16
        self.v = min(self.v + 1, 126)


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


class Count:
    def __init__(self):
        self.symbol, self.length = Symbol(), [Bit() for _ in range(33)]


class Offset:
    def __init__(self):
        self.symbol, self.sign, self.count = Symbol(), Bit(), Count()


class Byte:
    def __init__(self):
        self.trees, self.before = bits(), 0


def bits():
    """Bit models by whatever stands in the brackets of the text."""
    return defaultdict(Bit)


def symbols():
    return defaultdict(Symbol)


def counts():
    return defaultdict(Count)


class Operations:
    """What coded and mixed sequences have in common: the models of 10.2."""

    def count(self, model):
        s = self.symbol(model.symbol)
        if s < 15:
            return s
        n = 1
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

    def byte(self, model):
        node = 1
        for _ in range(8):
            node = 2 * node + self.bit(model.trees[model.before, node])
        model.before = node - 256
        return model.before

    def tree(self, models, n, *context):
        """n bits, highest first, each by the node that those before it lead to; the node in the end."""
        node = 1
        for _ in range(n):
            node = 2 * node + self.bit(models[context + (node,)])
        return node


class CodedSequence(Operations):
    """10.2: blocks of states and words, read by asymmetric numeral systems."""

    def __init__(self, data, lanes=1):
        self.data, self.lanes, self.at, self.operations = data, lanes, 0, 0
        self.x = [0] * lanes

    def _word(self, size):
        require(self.at + size <= len(self.data), "a coded sequence ends early")
        self.at += size
        return int.from_bytes(self.data[self.at - size : self.at], "little")

    def _begin(self):
        if self.operations % BLOCK == 0:
            self.x = [self._word(8) for _ in range(self.lanes)]
        self.operations += 1

    def _take(self, lane, width, start, frequency, slot):
        x = frequency * (self.x[lane] >> width) + slot - start
        if x < 2**32:
            x = x << 32 | self._word(4)
        self.x[lane] = x

    def raw(self, n, lane=0):
        self._begin()
        slot = self.x[lane] & (1 << n) - 1
        self._take(lane, n, slot, 1, slot)
        return slot

    def bit(self, model, lane=0):
        self._begin()
        slot, p = self.x[lane] & 0xFFFF, model.p
        bit = slot < p
        self._take(lane, 16, 0 if bit else p, p if bit else 65536 - p, slot)
        model.learn(bit)
        return int(bit)

    def symbol(self, model, lane=0):
        self._begin()
        slot = self.x[lane] & 0x7FFF
        s = bisect_right(model.c, slot) - 1
        start, frequency = model.interval(s)
        self._take(lane, 15, start, frequency, slot)
        model.learn(s)
        return s

    def part(self, bounds, width, lane=0):
        """An operation whose intervals the text gives by their bounds, a function of the value."""
        self._begin()
        slot = self.x[lane] & (1 << width) - 1
        value = bounds.find(slot)
        start = bounds(value)
        self._take(lane, width, start, bounds(value + 1) - start, slot)
        return value

    def end(self):
        """A reader MAY ignore what a writer MUST see to; this one looks, as it is here to find fault."""
        require(self.at == len(self.data), "bytes behind the last word of a coded sequence")
        require(not self.operations or all(x == 2**32 for x in self.x), "a coded sequence does not end with states of 2^32")


# --- 10.3: static tables

OCTAVE = [32768, 34219, 35734, 37316, 38968, 40693, 42495, 44376, 46341, 48393, 50535, 52773, 55109, 57549, 60097, 62757]


class Table:
    def __init__(self, depths, octave_steps, b):
        weights = [self._weight(depth, octave_steps) for depth in depths]
        total = sum(weights)
        frequencies = [max(1, (w << b) // total) if w else 0 for w in weights]
        if not total:
            frequencies[0] = 1 << b
        while sum(frequencies) > 1 << b:
            frequencies[frequencies.index(max(frequencies))] -= 1
        frequencies[frequencies.index(max(frequencies))] += (1 << b) - sum(frequencies)
        self.symbols = [s for s, f in enumerate(frequencies) if f]
        self.frequencies = [frequencies[s] for s in self.symbols]
        self.starts = [sum(self.frequencies[:i]) for i in range(len(self.symbols))]

    @staticmethod
    def _weight(depth, octave_steps):
        if not depth:
            return 0
        d = (depth - 1) * 16 // octave_steps
        octaves = (d + 15) // 16
        return OCTAVE[16 * octaves - d] * 32768 >> octaves

    def step(self, x, b):
        slot = x & (1 << b) - 1
        i = bisect_right(self.starts, slot) - 1
        return self.symbols[i], self.frequencies[i] * (x >> b) + slot - self.starts[i]


def tables(sequence, contexts, size, most, b):
    """The table of each context."""
    count_model, new, which, length = Count(), Bit(), Count(), Count()
    there, step = bits(), defaultdict(Offset)
    octave_steps = 2 ** min(sequence.raw(3), 4)
    n = min(sequence.count(count_model), most - 1) + 1
    known, runs = 0, []
    if n == 1:
        runs = [0] * contexts
    while len(runs) < contexts:
        if known == 0 or known < n and sequence.bit(new):
            table = known
            known += 1
        else:
            table = min(sequence.count(which), known - 1)
        runs += [table] * min(sequence.count(length) + 1, contexts - len(runs))
    old, made = [0] * size, []
    for _ in range(n):
        depth, last = [0] * size, octave_steps
        for s in range(size):
            if not sequence.bit(there[2 * (old[s] > 0) + (s > 0 and depth[s - 1] > 0)]):
                continue
            move = sequence.offset(step[old[s] > 0])
            depth[s] = last = max(1, min((old[s] or last) + move, 10 * octave_steps + 1))
            old[s] = depth[s]
        made.append(Table(depth, octave_steps, b))
    return [made[table] for table in runs]


# --- 10.4: symbols with static tables


class StaticSymbols:
    """States, and one row of words that all of them take from."""

    def __init__(self, data, lanes, state_bytes, word_bytes, width, lowest):
        require(len(data) >= lanes * state_bytes, "a row of symbols lacks its states")
        self.x = [int.from_bytes(data[i * state_bytes : (i + 1) * state_bytes], "little") for i in range(lanes)]
        self.data, self.at = data, lanes * state_bytes
        self.word_bytes, self.width, self.lowest = word_bytes, width, lowest

    def _refill(self, lane, x):
        if x < self.lowest:
            require(self.at + self.word_bytes <= len(self.data), "a row of symbols ends early")
            x = x << 8 * self.word_bytes | int.from_bytes(self.data[self.at : self.at + self.word_bytes], "little")
            self.at += self.word_bytes
        self.x[lane] = x

    def symbol(self, lane, table):
        s, x = table.step(self.x[lane], self.width)
        self._refill(lane, x)
        return s

    def end(self):
        require(self.at == len(self.data), "bytes behind the last symbol")


class Events(StaticSymbols):
    def __init__(self, data, width=9):
        super().__init__(data, 1, 8, 4, width, 2**31)

    def raw(self, n):
        value = self.x[0] & (1 << n) - 1
        self._refill(0, self.x[0] >> n)
        return value

    def number(self, table):
        s = self.symbol(0, table)
        if s < 12:
            return s
        n = s - 9
        return (1 << n) + self.raw(min(n, 16)) + (self.raw(n - 16) << 16 if n > 16 else 0)


class RawBits:
    """12.3: raw bits, lowest bit of the first byte first."""

    def __init__(self, data):
        self.bits, self.left = int.from_bytes(data, "little"), 8 * len(data)

    def raw(self, n):
        require(n <= self.left, "raw bits end early")
        value = self.bits & (1 << n) - 1
        self.bits >>= n
        self.left -= n
        return value


# --- 10.5: mixed sequences


class MixedSequence(Operations):
    def __init__(self, data):
        self.data, self.at, self.range = data, 0, 2**64 - 1
        self.value = self._next(8)

    def _next(self, n):
        self.at += n
        require(self.at <= len(self.data) + 4, "a mixed sequence ends early")
        return int.from_bytes(self.data[self.at - n : self.at].ljust(n, b"\0"), "big")

    def _refill(self):
        if self.range < 2**32:
            self.range <<= 32
            self.value = self.value << 32 | self._next(4)

    def decision(self, p):
        bound = (self.range >> 16) * p
        bit = self.value < bound
        if bit:
            self.range = bound
        else:
            self.value -= bound
            self.range -= bound
        self._refill()
        return int(bit)

    def slot(self, b):
        unit = self.range >> b
        return min(self.value // unit, (1 << b) - 1)

    def take(self, b, start, frequency):
        unit = self.range >> b
        self.value -= unit * start
        self.range = unit * frequency
        self._refill()

    def raw(self, n, lane=0):
        slot = self.slot(n)
        self.take(n, slot, 1)
        return slot

    def bit(self, model, lane=0):
        bit = self.decision(model.p)
        model.learn(bit)
        return bit

    def symbol(self, model, lane=0):
        s = bisect_right(model.c, self.slot(15)) - 1
        self.take(15, *model.interval(s))
        model.learn(s)
        return s

    def end(self):
        require(self.at >= len(self.data), "bytes behind a mixed sequence")


LOGISTIC = [math.floor(65536 / (1 + math.exp(-x / 256)) + 0.5) for x in range(-2048, 2048)]
LOGIT = [max(-2047, min(2047, round(256 * math.log((i + 0.5) / 4096 / (1 - (i + 0.5) / 4096))))) for i in range(4096)]


def hash32(h, v):
    g = (h ^ v & 0xFFFFFFFF) * 2654435761 & 0xFFFFFFFF
    return g ^ g >> 15


class Cell:
    """A wide cell."""

    __slots__ = ("p", "v")

    def __init__(self):
        self.p, self.v = 32768, 0

    def logit(self):
        return LOGIT[self.p >> 4] * (512 * self.v // (2 * self.v + 3)) >> 8

    def learn(self, bit):
        self.p += ((65535 if bit else 0) - self.p) * STEPS[self.v] >> 16
        self.v = min(self.v + 1, 250)


def logistic(x):
    return LOGISTIC[x + 2048]


class Mixer:
    def __init__(self, n, weight):
        self.rows = (defaultdict(lambda: [weight] * n), defaultdict(lambda: [weight] * n))
        self.maps = defaultdict(lambda: [logistic(max(-2047, min(128 * k - 2048, 2047))) for k in range(34)])
        self.rate, self.decisions = 1966, 0

    def bit(self, sequence, inputs, row0, row1, map_):
        rows = self.rows[0][row0], self.rows[1][row1]
        dots = [max(-2047, min(sum(w * x for w, x in zip(row, inputs)) >> 14, 2047)) for row in rows]
        m = dots[0] + dots[1] >> 1
        k, w = m + 2048 >> 7, (m + 2048) % 128
        table = self.maps[map_]
        a = table[k] * (128 - w) + table[k + 1] * w >> 7
        bit = sequence.decision(max(24, min(logistic(m) + a + 1 >> 1, 65512)))
        for row, z in zip(rows, dots):
            step = ((65536 if bit else 0) - logistic(z)) * self.rate >> 13
            row[:] = [max(-32768, min(v + ((16 * x * step >> 16) + 1 >> 1), 32767)) for v, x in zip(row, inputs)]
        table[k + (w >> 6)] += (65535 if bit else 0) - table[k + (w >> 6)] >> 7
        self.decisions += 1
        if self.decisions % 256 == 0:
            self.rate = 131 + 1835 * 300000 // (300000 + self.decisions)
        return bit


class Run:
    """16.4: flags that are nearly always the same."""

    __slots__ = ("p", "v")

    def __init__(self):
        self.p, self.v = 1 << 31, 0

    def read(self, sequence):
        bit = sequence.decision(max(self.p >> 16, 1))
        change = ((2**32 - 1 if bit else 0) - self.p) * (655360 // (10 * self.v + 16))
        self.p += change // 65536 if change >= 0 else -(-change // 65536)
        self.v = min(self.v + 1, 1000)
        return bit


class Difference:
    """16.4: signed numbers of 64 bits."""

    def __init__(self):
        self.length, self.sign, self.head = bits(), bits(), bits()

    def read(self, sequence):
        n = sequence.tree(self.length, 6) - 64
        negative = sequence.bit(self.sign[n])
        size = 0
        if n:
            size = 1
            for i in range(n - 1):
                size = 2 * size + (sequence.bit(self.head[8 * n + size]) if i < 2 else sequence.raw(1))
        return -size - 1 if negative else size


class Asker:
    """16.6: ask, with the cells and the mixer that a set of questions has."""

    def __init__(self, mixed):
        self.mixed, self.t, self.few = mixed, 14, 0
        self.cells, self.mixer, self.signature, self.sequence = defaultdict(Cell), Mixer(4, 5000), 0, None

    def plain(self, cell):
        bit = self.sequence.decision(max(32, min(cell.p, 65504)))
        cell.learn(bit)
        return bit

    def cell(self, x):
        return self.cells[(x * 2654435761 & 0xFFFFFFFF) >> 32 - self.t]

    def __call__(self, Q, local, nearby, valence):
        base = hash32(Q + 1, local)
        if not self.mixed:
            bit = self.plain(self.cells[base >> 18])
        else:
            bit = self.by_mix(Q, local, nearby, valence, base, self.cell(base))
        self.signature = hash32(self.signature, bit)
        return bit

    def by_mix(self, Q, local, nearby, valence, base, cell):
        if cell.v >= 100 and cell.p < 128:
            return self.plain(cell)
        before = self.signature
        near = hash32(base, nearby + 131072)
        cells = [cell] + [self.cell(x) for x in (near, hash32(base, valence + 196608), hash32(base, before + 262144), hash32(near, before + 458752))]
        cells = [cells[0]] + cells[2:]
        m = sum(c.v > 2 for c in cells)
        self.few += sum(c.v < 2 for c in cells)
        bit = self.mixer.bit(self.sequence, [c.logit() for c in cells], 8 * Q + max(m - 1, 0), 16 * Q + local % 16, Q)
        for c in cells:
            c.learn(bit)
        if self.few > 1 << self.t - 1 and self.t < 18:
            self.grow()
        return bit

    def grow(self):
        self.few, self.t, old = 0, self.t + 1, self.cells
        self.cells = defaultdict(Cell)
        for i, c in old.items():
            for j in (2 * i, 2 * i + 1):
                self.cells[j].p, self.cells[j].v = c.p, min(c.v, 1)
