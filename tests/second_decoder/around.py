"""Section 12.3 of docs/format.md, and 13.2 where it codes arrays in the same way: numbers by what is around."""

import copy
import math
import struct
from bisect import bisect_left
from collections import defaultdict

import numpy as np

from codes import Details, Map, bits_of, clamp, exponent_of, wrap
from container import Fields, require, unzigzag
from entropy import CodedSequence, RawBits, StaticSymbols, Symbol, bits, symbols, tables

WIDE, GATE, VALENCES, SPREAD, LISTED, CANDIDATES, REFINED, SHEARED, POLYGONS = (1 << i for i in range(9))
FOCUS, NEXT, BEYOND, LATE0, LATE1, LATE2, BEFORE, LAST = range(8)
DEGREES = [60, 60, 60, 60, 30, 12, 0, -9, -15, -20, -24]
CLOSING = (0, 2, 5, 9)


def degree(valence):
    return DEGREES[min(valence, 10)]


def exceptions(section, kind):
    """13.1: bits of numbers by place."""
    found, place = {}, 0
    if not section:
        return found
    fields = Fields(section)
    for i in range(fields.count()):
        gap = fields.count()
        require(i == 0 or gap, "exceptions do not rise")
        place += gap
        found[place] = int.from_bytes(fields.take(int(kind[1])), "little")
    fields.end()
    return found


class Element:
    """References by number, in the order focus, next, beyond, late 0 to 2, before, last; late triple; place."""

    __slots__ = ("refs", "late", "place", "swapped")

    def __init__(self, refs, late, place, swapped=False):
        self.refs, self.late, self.place, self.swapped = refs, late, place, swapped

    @property
    def closing(self):
        return self.place in CLOSING

    @property
    def parallelograms(self):
        return 0 if self.place == 13 else 1 + self.closing + self.late


def alone(before):
    return Element((before,) * 8, False, 13)


def useful(place, late):
    if place == 13:
        return []
    if place < 10:
        refs = [FOCUS, NEXT, BEYOND]
    elif place < 14:
        refs = [FOCUS]
    else:
        refs = [FOCUS] + ([NEXT] if place == 18 else []) + ([BEYOND] if place in (17, 18) else [])
    if late:
        refs += [LATE0, LATE1, LATE2] if place < 14 else [LATE2]
    return sorted(refs + [BEFORE])


def plain_weights(place, late):
    """Of w0 to w6, in 1/128."""
    w = [0] * 7
    if place >= 14:
        w[FOCUS], w[BEFORE] = 128, -128
        if place == 17:
            w[FOCUS], w[BEYOND], w[BEFORE] = 104, -40, -40
        if place == 18:
            w[BEYOND], w[NEXT] = -128, 128
        if place in (19, 20):
            w[BEFORE] = -207 if place == 19 else -256
        return w
    if place == 13:
        return w
    closing = place in CLOSING
    share = 128 // (1 + closing + late)
    w[FOCUS] += share
    w[BEFORE] -= share
    if closing:
        w[FOCUS] += share
        w[NEXT] += share
        w[BEYOND] -= share
    if late:
        w[LATE0] += share
        w[LATE1] += share
        w[LATE2] -= share
    return w


def read_rows(side, groups):
    """For each group six rows of seven weights."""
    kept_model, length, made = bits(), symbols(), []
    for group in range(groups):
        place, late = group // 2, bool(group % 2)
        rows = [plain_weights(place, late)] + [[0] * 7 for _ in range(5)]
        made.append(rows)
        refs = useful(place, late)
        if not refs:
            continue
        kept = 0
        while kept < 2 and side.bit(kept_model[kept]):
            kept += 1
        for t in range((0, 1, 6)[kept]):
            if t == 4 and place >= 10:
                continue
            for r in refs:
                n = side.symbol(length[t > 0])
                if n:
                    negative = side.raw(1)
                    m = (1 << n - 1) + side.raw(n - 1)
                    rows[t][r] = wrap(rows[t][r] + (-m if negative else m), 16)
    return made


def read_dictionary(side):
    n = side.raw(16)
    require(n <= 65520, "a dictionary that is too large")
    if not n:
        return []
    gap, before = symbols(), 0
    value = side.raw(32)
    values = [wrap(value | side.raw(32) << 32, 64)]
    for _ in range(n - 1):
        length = before = side.symbol(gap[before])
        if length == 15:
            length += side.raw(6)
        require(length <= 62, "a gap that is too large")
        step = 1
        if length:
            low = side.raw(min(length - 1, 32))
            step += (1 << length - 1) + low + (side.raw(length - 33) << 32 if length > 33 else 0)
        values.append(values[-1] + step)
    return values


class Header:
    """The fields of 12.3 up to `side`, which a set of charts has in common (17.7)."""

    def __init__(self, fields, dtype, n, corners=False, exceptions_here=True, details_here=True, placement=0):
        self.placement, self.n = placement, n
        self.flags = fields.count(511)
        self.wide = bool(self.flags & WIDE)
        self.maps = [Map(fields, dtype) for _ in range(n)]
        self.kind = self.maps[0].dtype if not self.maps[0].has_factor else "f8"
        self.details, self.details_data = None, None
        if self.flags & REFINED:
            self.details = Details(fields, dtype, n)
            self.details_data = fields.section() if details_here else None
        self.exceptions = exceptions(fields.section(), self.kind) if exceptions_here else {}
        self.order = self.weights = None
        if self.flags & SHEARED:
            self.order = [fields.u8() for _ in range(n)]
            self.weights = [fields.zigzag() for _ in range(n * (n - 1) // 2)]
            require(sorted(self.order) == list(range(n)) and max(map(abs, self.weights)) <= 65536, "a shear that cannot be")
        self.bias = [0] * n if self.wide else [fields.zigzag() for _ in range(n)]
        self.base = [fields.u8() for _ in range(n)]
        require(max(self.base) <= (40 if self.wide else 4), "a base that is too large")
        self.first_size, self.first_spread = fields.u8(), fields.u8()
        side = CodedSequence(fields.section())
        self.rows = read_rows(side, 42 if self.flags & POLYGONS else 28)
        self.listed, self.candidates = bool(self.flags & LISTED), bool(self.flags & CANDIDATES)
        self.dictionaries = [read_dictionary(side) for _ in range(n)] if self.listed or self.candidates else [[]] * n
        self.E = 16 if self.flags & SPREAD else 1
        self.residual = tables(side, 64 * n * self.E, 64, 24, 10)
        if self.listed:
            self.listed_tables = tables(side, 8**n, 2**n, 16, 10)
        if self.listed or self.candidates:
            self.index = tables(side, 512, 16, 24, 10)
        if self.candidates:
            self.candidate = tables(side, 1600 * n, 9, 16, 10)
        side.end()


class Numbers:
    """Decodes the codes of all elements, component by component."""

    def __init__(self, header, elements, raw, data, valence=None, weights=None):
        """`weights(e)`: with a placement, what positions say: (w0 to w6, of last, turned ones or None)."""
        h = self.h = header
        self.elements, self.valence, self.placed = elements, valence, weights
        self.real = np.float64 if h.wide else np.float32
        n, count = h.n, len(elements)
        lanes = 1 + (min(n, 3) if h.listed else n - 1)
        self.symbols, self.raw = StaticSymbols(data, lanes, 5, 2, 10, 2**24), RawBits(raw)
        self.codes = [list(h.bias) for _ in range(count)]
        self.values = np.zeros((count + 1, n), self.real)  # numbers, the last row stands for those that do not exist
        self.sizes = [[0] * n for _ in range(count)]
        self.decoded = [False] * count
        self.listed = [2**n - 1] * count
        self.chosen = [[0] * n for _ in range(count)]  # M(r)
        self.indices = [[None] * n for _ in range(count)]
        self.mirrored = False
        self.row_weights = {}
        with np.errstate(all="ignore"):
            for v in range(count):
                self.element(v)
        self.symbols.end()
        self.unshear()

    # --- forecast

    def weights_of(self, v, element):
        """w0 to w6 and that of last."""
        h, real = self.h, self.real
        if not h.rows:
            w = [np.float32(0)] * 7
        else:
            key = 2 * element.place + element.late
            degrees = ()
            if h.flags & VALENCES:
                f, n, _, _, _, _, b, l = element.refs
                degrees = tuple(degree(self.valence[r]) for r in (f, l, b, n, v))
            w = self.row_weights.get((key, degrees))
            if w is None:
                w = []
                for r in range(7):
                    x = np.float32(h.rows[key][0][r]) / np.float32(128)
                    for t, d in enumerate(degrees):
                        x = x + np.float32(d) * (np.float32(h.rows[key][t + 1][r]) / np.float32(4096))
                    w.append(x)
                self.row_weights[key, degrees] = w
        return w, self.last_weight(w)

    def last_weight(self, w):
        if self.h.wide:
            x = 1.0
            for wi in w:
                x = x - float(wi)
            return np.float64(x)
        one = np.float32(1)
        return one - (((w[0] + w[4]) + (w[1] + w[5])) + ((w[2] + w[6]) + w[3]))

    def element(self, v):
        h, element, real = self.h, self.elements[v], self.real
        focus, next_, beyond, late0, late1, late2, before, last = (self.values[r] for r in element.refs)
        turned = None
        if self.placed:
            w, w_last, turned = self.placed(v, element)
        else:
            w, w_last = self.weights_of(v, element)
        w = [real(x) for x in w]
        fitted = w[0] * focus + w[1] * next_ + w[2] * beyond + w[3] * late0 + w[4] * late1 + w[5] * late2 + w[6] * before + real(w_last) * last
        gate = (focus - before) + last
        c = ((focus - beyond) + next_) - gate if element.closing else 0 * gate
        t = ((late0 - late2) + late1) - gate if element.late else 0 * gate
        n = element.parallelograms
        share = real(0 if element.place >= 14 else 0.25 if n == 3 else 0.5)
        mean = gate + (c + t) * share
        if turned is not None:
            fitted = self.turn(fitted, element, turned)
        spread = np.maximum(np.abs(mean - fitted), np.maximum(np.abs(c), np.abs(t)) / real(2))
        self.forecast = fitted, gate, c, t
        if h.flags & GATE:
            centre, apart = [self.to_code(k, gate[k]) for k in range(h.n)], fitted - gate
        else:
            centre, apart = [self.to_code(k, fitted[k]) for k in range(h.n)], mean - fitted
        self.symbols_of(v, element, n, centre, apart, spread)

    def turn(self, fitted, element, turned):
        """13.2: placement 2 and 3."""
        h, real = self.h, self.real
        ref = [self.values[r] for r in element.refs]
        tf, tn, t0, t1 = (real(x) for x in turned)
        E, F = ref[LAST] - ref[FOCUS], ref[BEFORE] - ref[FOCUS]
        area = E[0] * F[1] - E[1] * F[0]
        if area < 0:
            self.mirrored = not element.swapped
        elif area > 0:
            self.mirrored = element.swapped
        way = ref[FOCUS] * tf + ref[NEXT] * tn + ref[LATE0] * t0 + ref[LATE1] * t1 + ref[LAST] * -(tf + tn + t0 + t1)
        steps = [1.0 if m.curved or h.kind == "i4" else m.as_double(1) - m.as_double(0) for m in h.maps]
        ratio = real(steps[1] / steps[0])
        move = np.array([way[1] * ratio, -way[0] / ratio], real)
        return fitted - move if self.mirrored != element.swapped else fitted + move

    def to_code(self, k, x):
        x = float(x)
        if not self.h.wide:
            return self.h.bias[k] + int(np.rint(clamp(x, -(2.0**21), 2.0**21) if x == x else 0.0))
        if self.h.maps[k].curved:
            return self.h.maps[k].code(x)
        x = clamp(x, -(2.0**62), 2.0**62)
        return int((x + 3 * 2.0**51) - 3 * 2.0**51)

    def number(self, k, code):
        if not self.h.wide:
            return code - self.h.bias[k]
        if self.h.maps[k].curved:
            return clamp(self.h.maps[k].value(code), -1e37, 1e37)
        return float(code)

    # --- symbols

    def octaves(self, k, spread, centre):
        if not self.h.wide:
            return (struct.unpack("<I", struct.pack("<f", spread))[0] >> 23 & 255) - 125
        e = exponent_of(float(spread))
        if self.h.maps[k].curved:
            m = self.h.maps[k]
            return e - exponent_of(m.value(centre + 1) - m.value(centre)) + 2
        return e - 1021

    def context(self, v, k, element, n, spread, centre):
        h, r, sizes = self.h, element.refs, self.sizes
        total = 2 * sizes[r[LAST]][k] + 2 * sizes[r[FOCUS]][k] + sizes[r[BEFORE]][k] + sizes[r[NEXT]][k]
        a = clamp((total + 3) // 6 - h.first_size, 0, 15)
        e = clamp(self.octaves(k, spread, centre) - h.first_spread, 0, 15) if h.flags & SPREAD else 0
        return ((4 * k + n) * 16 + a) * h.E + e

    def symbols_of(self, v, element, n, centre, apart, spread):
        h = self.h
        known = self.known_by_candidates(v, element, n) if h.candidates else self.known_by_list(v, element) if h.listed else [None] * h.n
        drawn = []
        for k in range(h.n):
            if known[k] is None:
                table = h.residual[self.context(v, k, element, n, spread[k], centre[k])]
                drawn.append(("residual", self.symbols.symbol(k, table)))
            elif known[k] == "index":
                drawn.append(self.index(v, k, element))
            else:
                drawn.append(("code", known[k]))
        for k, (what, i) in enumerate(drawn):
            if what == "index":
                near, i = i
                index = near + i - 7 if i < 15 else self.raw.raw(16)
                index &= 0xFFFFFFFF
                entries = h.dictionaries[k]
                index = min(index, len(entries) - 1)
                drawn[k] = "code", entries[index] + h.bias[k]
                self.indices[v][k] = index
        sizes = [symbol_size(s) if what == "residual" else None for what, s in drawn]
        for k, (what, s) in enumerate(drawn):
            if what == "residual" and s < 63:
                drawn[k] = "code", centre[k] + self.residual(k, s, apart[k])
        for k, (what, s) in enumerate(drawn):
            code = s
            if what == "residual":
                length = min(self.raw.raw(7), 64 if h.wide else 22)
                negative = self.raw.raw(1)
                low = self.raw.raw(length // 2)
                magnitude = low | self.raw.raw(length - length // 2) << length // 2
                code = centre[k] + (-magnitude if negative else magnitude)
            code = wrap(code, 64)
            self.codes[v][k] = code
            self.values[v, k] = self.number(k, code)
            self.sizes[v][k] = sizes[k] if sizes[k] is not None else self.size_of(k, code - centre[k])
            if h.candidates and self.indices[v][k] is None:
                self.indices[v][k] = self.place_in(k, code)
        self.decoded[v] = True

    def residual(self, k, s, apart):
        b = self.h.base[k]
        if s == 0:
            return self.raw.raw(b + 1) - (1 << b) if b else 0
        if s < 3:
            magnitude, other = (1 << b) + self.raw.raw(b), s == 2
        else:
            l = b + (s + 5) // 4
            magnitude, other = (2 + (s - 3) % 2 << l - 2) + self.raw.raw(l - 2), (s - 3) % 4 // 2 == 1
        return -magnitude if bool(apart < 0) != other else magnitude

    def size_of(self, k, residual):
        """The size of the symbol that a residual has."""
        b, m = self.h.base[k], abs(residual)
        i = m.bit_length() - b
        return 0 if i <= 0 else 2 if i == 1 else 36 if i > 16 else 2 * i + (m >> m.bit_length() - 2) - 2

    # --- dictionaries

    def third(self, element):
        return element.refs[NEXT if element.place < 10 else BEFORE]

    def known_by_list(self, v, element):
        r, h = element.refs, self.h
        P = [self.listed[i] for i in (r[LAST], r[FOCUS], self.third(element))]
        m = 2**h.n
        context = m * m * P[0] + m * P[1] + P[2]
        mask = self.symbols.symbol(min(h.n, 3), h.listed_tables[context])
        self.listed[v] = mask
        return ["index" if mask >> k & 1 and h.dictionaries[k] else None for k in range(h.n)]

    def known_by_candidates(self, v, element, n):
        h, r, known = self.h, element.refs, []
        fitted, gate, c, t = self.forecast
        before_m = 9
        third = self.third(element)
        for k in range(h.n):
            codes = [self.codes[i][k] for i in (r[LAST], r[FOCUS], third, r[BEFORE])]
            via_gate = self.to_code(k, gate[k])
            via_c, via_t = self.to_code(k, gate[k] + c[k]), self.to_code(k, gate[k] + t[k])
            values = [via_gate] + codes[:3] + [codes[3] if third != r[BEFORE] or element.place < 10 else via_c, via_c, via_t]
            e = (values[0] == values[1]) + 2 * (values[0] == values[2])
            context = (((k * 10 + before_m) * 10 + self.chosen[r[LAST]][k]) * 4 + e) * 4 + n
            m = self.symbols.symbol(k, h.candidate[context])
            if m == 8 and not h.dictionaries[k]:
                m = 0
            before_m = self.chosen[v][k] = m
            known.append(None if m == 0 else "index" if m == 8 else values[m - 1])
        return known

    def place_in(self, k, code):
        entries, value = self.h.dictionaries[k], code - self.h.bias[k]
        i = bisect_left(entries, value)
        return i if i < len(entries) and entries[i] == value else None

    def index(self, v, k, element):
        h, r = self.h, element.refs
        entries = h.dictionaries[k]
        f = self.to_code(k, self.forecast[0][k]) - h.bias[k]
        near = bisect_left(entries, f)
        if near == len(entries) or near and f - entries[near - 1] <= entries[near] - f:
            near -= 1
        beyond = abs(f - entries[near]) // 2
        above = f >= entries[near]
        other = near + 1 if above else near - 1
        g = 0
        if beyond > 0:
            g = 3
            if 0 <= other < len(entries):
                apart = np.float32(abs(entries[other] - entries[near]))
                g = int(min(np.float32(3), np.float32(beyond) * (np.float32(16) / apart)))
        part = 4 + g if above else 3 - g

        def Q(i):
            index = self.indices[i][k]
            return 3 if index is None else {0: 0, 1: 1, -1: 2}.get(index - near, 3)

        context = ((part * 4 + Q(r[LAST])) * 4 + Q(r[FOCUS])) * 4 + Q(self.third(element))
        return "index", (near, self.symbols.symbol(k, h.index[context]))

    def unshear(self):
        if self.h.order is None:
            return
        order = self.h.order
        for code in self.codes:
            w = iter(self.h.weights)
            for i, o in enumerate(order[1:], 1):
                total = 128
                for p in order[:i]:
                    total += next(w) * code[p]
                code[o] = wrap(code[o] + (wrap(total, 64) >> 8), 64)


def stored(header, codes, dtype, components=None):
    """Codes as rows of the array's type, exceptions and details in place."""
    return finish(header.maps, codes, dtype, header.exceptions, header.details, header.details_data)


def finish(maps, codes, kind, exceptions_, details=None, details_data=None):
    n = len(maps)
    short = int(kind[1]) <= 4
    made = np.zeros((len(codes), n), kind)
    as_bits = made.view("u" + kind[1])
    if details:
        for i, row in enumerate(details.read(details_data, len(codes), maps, codes)):
            made[i] = row
    else:
        for k, m in enumerate(maps):
            bit_for_bit = m.kind == 1 and not m.has_factor
            for i, code in enumerate(codes):
                c = wrap(code[k], 32) if short else code[k]
                if bit_for_bit:
                    as_bits[i, k] = ordered_bits(m, c)
                else:
                    made[i, k] = m.number(c)
    for place, value in exceptions_.items():
        require(place < made.size, "an exception of no number")
        as_bits.reshape(-1)[place] = value
    return made


def ordered_bits(m, c):
    if m.table is not None:
        c = m.table[clamp(c, 0, len(m.table) - 1)]
    size = 32 if m.dtype == "f4" else 64
    c &= (1 << size) - 1
    return c if c < 1 << size - 1 else c ^ (1 << size - 1) - 1


def symbol_size(s):
    return 36 if s == 63 else 0 if s == 0 else 2 if s < 3 else 2 * ((s + 5) // 4) + (s - 3) % 2


# --- positions of fans (12.3)


def face_places(walk):
    """The table of polygons: an element for each vertex, from the face in which it comes up first."""
    found = {}
    for face, x in zip(walk.faces, walk.across_at_begin):
        d = len(face)
        for k, v in enumerate(face):
            if v in found or walk.births[v] is None:
                continue
            found[v] = polygon_place(face, d, k, v, x)
    return [found[v] for v in range(len(walk.births))]


def polygon_place(face, d, k, v, x):
    def c(i):
        return face[i % d]

    def known(i):
        return c(i) < v

    x_known = k == 2 and x < v
    last = c(k - 1)

    def element(place, focus, before=None, beyond=None, next_=None):
        late = x_known and 14 <= place <= 20 and place != 16
        before = focus if before is None else before
        refs = [focus, focus if next_ is None else next_, focus if beyond is None else beyond, focus, focus, focus, before, last]
        if late:
            refs[LATE0], refs[LATE1], refs[LATE2] = last, last, x
        return Element(tuple(refs), late, place)

    if k < 2:
        return alone(last if k else max(v - 1, 0))
    if d == 3 and x_known:
        return element(10, c(0), x)
    if d == 4 and k == 3:
        return element(15, c(0), c(1))
    if d == 4 and known(3):
        return element(14, c(3), c(0))
    if d in (5, 6) and all(known(i) for i in range(k + 1, d)):
        return element(12 + d, c(k + 1), c(k - 2), c(k + 2), c(k + 3) if d == 6 else None)
    if d > 4 and (k > 2 or known(d - 1)):
        return element(19 if d == 5 else 20, c(k - 3), c(k - 2))
    if x_known:
        return element(16, last, x)
    return alone(last)


def fan_elements(walk, points, polygons):
    if polygons:
        elements = face_places(walk)
    else:
        elements = [Element(b.references(), b.late is not None, b.place) for b in walk.births]
    return elements + [alone(max(p - 1, 0)) for p in range(len(elements), points)]


def valences(faces, points):
    """12.3: corners of faces at each point, twice that on a border (15.1)."""
    corners, neighbours = [0] * points, [0] * points
    for face in faces:
        for a, b in zip(face, face[1:] + face[:1]):
            corners[a] += 1
            neighbours[a] ^= b + 1
            neighbours[b] ^= a + 1
    return [(2 * n if x else n) % 256 for n, x in zip(corners, neighbours)]


def positions(fields, fans, points, array, shared=None):
    """POSI 1, or 3 with what charts share."""
    header = shared or Header(fields, array.type, 3)
    if shared:
        header = copy.copy(shared)
        header.details_data = fields.section() if header.details else None
        header.exceptions = exceptions(fields.section(), array.dtype)
    elements = fan_elements(fans.walk, points, header.flags & POLYGONS)
    valence = valences(fans.fan_faces, points) if header.flags & VALENCES else None
    raw = fields.section()
    numbers = Numbers(header, elements, raw, fields.rest(), valence)
    return stored(header, numbers.codes, array.dtype)
