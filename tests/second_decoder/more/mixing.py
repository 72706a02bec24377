"""Sections 10.5 and 16.6 of docs/format.md: decisions mixed from several cells."""
import math
from collections import defaultdict
from entropy import Asker, Cell, hash32

LOGISTIC = [math.floor(65536 / (1 + math.exp(-x / 256)) + 0.5) for x in range(-2048, 2048)]
LOGIT = [max(-2047, min(2047, round(256 * math.log((i + 0.5) / (4095.5 - i))))) for i in range(4096)]

def logistic(x): return LOGISTIC[x + 2048]
def logit(cell): return LOGIT[cell.p >> 4] * (512 * cell.v // (2 * cell.v + 3)) >> 8

class Mixer:
    def __init__(self, weights):
        self.rows = [defaultdict(lambda: list(weights)) for _ in range(2)]
        self.maps = defaultdict(lambda: [logistic(max(-2047, min(128 * k - 2048, 2047))) for k in range(34)])
        self.rate, self.decisions = 1966, 0

    def bit(self, sequence, inputs, row0, row1, map_):
        rows, table = (self.rows[0][row0], self.rows[1][row1]), self.maps[map_]
        dots = [max(-2047, min(sum(w * x for w, x in zip(row, inputs)) >> 14, 2047)) for row in rows]
        m = sum(dots) >> 1
        k, w = divmod(m + 2048, 128)
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

class MixedAsker(Asker):
    def __init__(self):
        super().__init__()
        self.few, self.mixer = 0, Mixer([5000] * 4)

    def cell(self, x): return self.cells[(x * 2654435761 & 0xFFFFFFFF) >> 32 - self.t]

    def decide(self, base, Q, local, nearby, valence):
        cell = self.cell(base)
        if cell.v >= 100 and cell.p < 128:
            return self.plainly(cell)
        near, before = hash32(base, nearby + 131072), self.signature
        hashes = (base, valence + 196608), (base, before + 262144), (near, before + 458752)
        cells = [cell] + [self.cell(hash32(*h)) for h in hashes]
        met = max(sum(c.v > 2 for c in cells) - 1, 0)
        bit = self.mixer.bit(self.sequence, [logit(c) for c in cells], 8 * Q + met, 16 * Q + local % 16, Q)
        for c in cells:
            self.few += c.v < 2
            c.learn(bit)
        if self.few > 1 << self.t - 1 and self.t < 18:
            self.grow()
        return bit

    def grow(self):
        self.few, self.t, old, self.cells = 0, self.t + 1, self.cells, defaultdict(Cell)
        for j, c in ((j, c) for i, c in old.items() for j in (2 * i, 2 * i + 1)):
            self.cells[j].p, self.cells[j].v = c.p, min(c.v, 1)
