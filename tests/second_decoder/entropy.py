"""Sections 10.2 to 10.5, 16.4 and 16.6 of docs/format.md: sequences, models, static tables."""
from bisect import bisect_right
from collections import Counter, defaultdict
from itertools import accumulate
from container import M64, clamp, wrap

RATES = [1, 2, 2] + 4 * [3] + 9 * [4] + 32 * [5] + 143 * [6] + [7]
OPENED = []  # all sequences, to see in the end that they were read to theirs

class Bit:
    p, v, low, high, most = 32768, 0, 32, 65504, 126

    def learn(self, bit):
        self.p += ((self.high if bit else self.low) - self.p) * (131072 // (2 * self.v + 3)) >> 16
        self.v = min(self.v + 1, self.most)

class Symbol:
    c, v = [2048 * i for i in range(17)], 0

    def learn(self, s):
        rate = RATES[self.v]
        self.v = min(self.v + 1, 191)
        self.c = [c + ((i if i <= s else 32752 + i) - c >> rate) for i, c in enumerate(self.c)]

class Run:
    p, v = 1 << 31, 0

    def learn(self, bit):
        change = ((2**32 - 1) * bit - self.p) * (655360 // (10 * self.v + 16))
        self.p += change // 65536 if change >= 0 else -(-change // 65536)
        self.v = min(self.v + 1, 1000)

class Models(dict):
    """Models by kind and name, with what stands in the brackets of the text; one that is asked for first is fresh."""

    def __missing__(self, key): return self.setdefault(key, key[0]())

def tree(n, question):
    """n bits, highest first, each by the node that those before it lead to."""
    node = 1
    for _ in range(n):
        node = 2 * node + question(node)
    return node - (1 << n)

class Sequence:
    """Operations of 10.2, over slot(width, lane) and take(width, lane, start, frequency, slot)."""

    def __init__(self, data, models=None):
        self.data, self.at, self.models = data, 0, Models() if models is None else models
        OPENED.append(self)

    def word(self, size, order="little"):
        self.at += size
        return int.from_bytes(self.data[self.at - size : self.at].ljust(size, b"\0"), order)

    def ended(self): return self.at == len(self.data)

    def forget(self):
        self.models = Models()  # fresh ones from here on

    def raw(self, n, lane=0):
        slot = self.slot(n, lane)
        self.take(n, lane, slot, 1, slot)
        return slot

    def decision(self, p, lane=0):
        slot = self.slot(16, lane)
        self.take(16, lane, *((0, p) if slot < p else (p, 65536 - p)), slot)
        return int(slot < p)

    def bit(self, *name, lane=0):
        model = self.models[Bit, name]
        bit = self.decision(model.p, lane)
        model.learn(bit)
        return bit

    def bit_by_last_two(self, name, *context):
        """With `last two` (10.1) of its kind as the last part of the context."""
        lasts = self.models[Counter, "last two"]
        bit = self.bit(name, *context, lasts[name])
        lasts[name] = 2 * lasts[name] % 4 + bit
        return bit

    def symbol(self, *name, lane=0):
        model, slot = self.models[Symbol, name], self.slot(15, lane)
        s = bisect_right(model.c, slot) - 1
        self.take(15, lane, model.c[s], model.c[s + 1] - model.c[s], slot)
        model.learn(s)
        return s

    def part_of(self, n, width):
        """One of n equal parts of the slots."""
        slot = self.slot(width, 0)
        i = next(i for i in range(slot * n >> width, n) if slot < (i + 1 << width) // n)
        begin = (i << width) // n
        self.take(width, 0, begin, (i + 1 << width) // n - begin, slot)
        return i

    def raws(self, n):
        return self.raw(16) << n - 16 | self.raws(n - 16) if n > 16 else self.raw(n) if n > 0 else 0

    def count(self, *name):
        s, n = self.symbol(*name), 1
        if s < 15:
            return s
        while n <= 32 and self.bit(*name, n):
            n += 1
        return 14 + (1 << n - 1) + self.raw(n - 1) & 0xFFFFFFFF

    def offset(self, *name):
        s = self.symbol(*name)
        if s < 15:
            return s - 7
        negative, m = self.bit(*name), self.count(*name, "count") % 2**30 + 8
        return -m if negative else m

    def tree(self, n, *name): return tree(n, lambda node: self.bit(*name, node))

    def run(self, *name):
        """16.4: flags that are nearly always the same."""
        model = self.models[Run, name]
        bit = self.decision(max(model.p >> 16, 1))
        model.learn(bit)
        return bit

    def difference(self, name):
        """16.4: signed numbers of 64 bits."""
        n = self.tree(6, name, "length")
        negative, size = self.bit(name, "sign", n), int(n > 0)
        for i in range(n - 1):
            size = 2 * size + (self.bit(name, "head", n, size) if i < 2 else self.raw(1))
        return -size - 1 if negative else size

    def residual(self, m, expected, spread, B):
        """13.4."""
        return self.rest_of_residual(m, self.length_of_residual(m, expected, spread, B), B)

    def length_of_residual(self, m, expected, spread, B, lane=0):
        o = expected // 2
        s = self.symbol("Length", m, min(o, 19), spread, lane=lane)
        return min(max(o - 7, 0) + s if s < 15 else self.raw(7, lane), B)

    def rest_of_residual(self, m, length, B, lane=0, scored=False):
        """`scored`: 16.7, where low bits have models that count if they were right before."""
        if length == 0:
            return 0
        n = min(length - 1, 3)
        left = after = length - 1 - n
        head, w = self.symbol("Head", m, length, lane=lane), min(left, 8)
        v, score = (1 << n) + head % (1 << n), self.models[Counter, (m, length)]  # and what low bits were last by head
        if scored and left >= 4 and score["score"] > 0:
            v = v << 4 | self.symbol("Low", m, length, head, lane=lane)
            if w > 4:
                v = v << w - 4 | self.symbol("Lower", m, length, head, v % 16, lane=lane) % (1 << w - 4)
            left -= w
        if B == 64 and left > 32:
            left -= 32
            v = v << 32 | self.raw(32, lane)
        v = v << left | self.raw(left, lane)
        if scored and after >= 4:
            t = v >> after - w & (1 << w) - 1
            score["score"] = clamp(score["score"] + (1 << w - 4 if score[head] == t else -1), -255, 255)
            score[head] = t
        return wrap(-v if head >> n & 1 else v, B)

class CodedSequence(Sequence):
    """10.2: states, and one row of words that all of them take from when they fall below the lowest."""

    def __init__(self, data, lanes=1, models=None, state_bytes=8, word_bytes=4, lowest=2**32, block=131072):
        super().__init__(data, models)
        self.word_bytes, self.lowest, self.block, self.operations = word_bytes, lowest, block, 0
        self.x = [self.word(state_bytes) if data else lowest for _ in range(lanes)]

    def slot(self, width, lane):
        if self.operations == self.block:
            self.x, self.operations = [self.word(8) for _ in self.x], 0
        self.operations += 1
        return self.x[lane] & (1 << width) - 1

    def take(self, width, lane, start, frequency, slot):
        x = frequency * (self.x[lane] >> width) + slot - start
        self.x[lane] = x << 8 * self.word_bytes | self.word(self.word_bytes) if x < self.lowest else x

    def ended(self): return super().ended() and all(x == self.lowest for x in self.x)

# --- 10.3 and 10.4: static tables, and symbols with them

OCTAVE = [round(32768 * 2 ** (i / 16)) for i in range(16)]

def table(depths, R, b):
    """Where the slots of each symbol start, and the number of all slots."""
    halvings = [(depth - 1) * 16 // R for depth in depths]
    weights = [OCTAVE[-h % 16] * 32768 >> (h + 15) // 16 if depth else 0 for depth, h in zip(depths, halvings)]
    frequencies = [max(1, (w << b) // sum(weights)) if w else 0 for w in weights]
    while sum(frequencies) > 1 << b:
        frequencies[frequencies.index(max(frequencies))] -= 1
    frequencies[frequencies.index(max(frequencies))] += (1 << b) - sum(frequencies)
    return list(accumulate(frequencies, initial=0))

def tables(sequence, contexts, size, most, b):
    """The table of each context."""
    sequence.forget()
    R, n = 2 ** min(sequence.raw(3), 4), min(sequence.count("tables"), most - 1) + 1
    known, runs = 0, [0] * contexts if n == 1 else []
    while len(runs) < contexts:
        new = known == 0 or known < n and sequence.bit("new")
        which, known = (known, known + 1) if new else (min(sequence.count("which"), known - 1), known)
        runs += [which] * min(sequence.count("run") + 1, contexts - len(runs))
    old, made = [0] * size, []
    for _ in range(n):
        depth, last = [0] * size, R
        for s in range(size):
            if sequence.bit("there", old[s] > 0, s > 0 and depth[s - 1] > 0):
                move = sequence.offset("step", old[s] > 0)
                old[s] = depth[s] = last = max(1, min((old[s] or last) + move, 10 * R + 1))
        made.append(table(depth, R, b))
    return [made[which] for which in runs]

class StaticSymbols(CodedSequence):
    """10.4."""

    def __init__(self, data, lanes, *sizes):
        super().__init__(data, lanes, None, *sizes, block=None)

    def symbol(self, lane, starts):
        slot, width = self.x[lane] % starts[-1], starts[-1].bit_length() - 1
        s = bisect_right(starts, slot) - 1
        self.take(width, lane, starts[s], starts[s + 1] - starts[s], slot)
        return s

    def number(self, starts):
        s = self.symbol(0, starts)
        return s if s < 12 else (1 << s - 9) + self.raw(min(s - 9, 16)) + (self.raw(s - 25) << 16 if s > 25 else 0)

class MixedSequence(Sequence):
    """10.5."""

    def __init__(self, data, models=None):
        super().__init__(data, models)
        self.range, self.value = M64, self.word(8, "big")

    def refill(self):
        if self.range < 2**32:
            self.range, self.value = self.range << 32, self.value << 32 | self.word(4, "big")

    def decision(self, p, lane=0):
        bound = (self.range >> 16) * p
        bit = int(self.value < bound)
        self.value, self.range = (self.value, bound) if bit else (self.value - bound, self.range - bound)
        self.refill()
        return bit

    def slot(self, width, lane): return min(self.value // (self.range >> width), (1 << width) - 1)

    def take(self, width, lane, start, frequency, slot):
        unit = self.range >> width
        self.value, self.range = self.value - unit * start, unit * frequency
        self.refill()

    def ended(self): return len(self.data) <= self.at <= len(self.data) + 4

def hash32(h, v):
    g = (h ^ v & 0xFFFFFFFF) * 2654435761 & 0xFFFFFFFF
    return g ^ g >> 15

class Cell(Bit):
    """A wide cell."""
    low, high, most = 0, 65535, 250

class Asker:
    """16.6: ask, with the cells that a set of questions has; more/mixing.py has those that are mixed."""

    def __init__(self):
        self.t, self.signature, self.sequence, self.cells = 14, 0, None, defaultdict(Cell)

    def __call__(self, Q, local, nearby, valence):
        bit = self.decide(hash32(Q + 1, local), Q, local, nearby, valence)
        self.signature = hash32(self.signature, bit)
        return bit

    def decide(self, base, *_): return self.plainly(self.cells[base >> 18])

    def plainly(self, cell):
        bit = self.sequence.decision(clamp(cell.p, 32, 65504))
        cell.learn(bit)
        return bit
