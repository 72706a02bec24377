"""Section 12.3 of docs/format.md, and 13.2 where it codes arrays in the same way: numbers by what is around."""
from bisect import bisect_left
from collections import Counter
from copy import copy
from functools import reduce
import numpy as np
from container import Fields, clamp, wrap
from entropy import CodedSequence, StaticSymbols, tables
from maps import Details, Map, bits_of, exponent_of, real

WIDE, GATE, VALENCES, SPREAD, LISTED, CANDIDATES, REFINED, SHEARED, POLYGONS = (1 << i for i in range(9))
FOCUS, NEXT, BEYOND, LATE0, LATE1, LATE2, BEFORE, LAST = range(8)
DEGREES = [60, 60, 60, 60, 30, 12, 0, -9, -15, -20, -24]
CLOSING = (0, 2, 5, 9)

class Element:
    """References by number, in the order of their weights; those that are not given are the focus."""

    def __init__(self, focus, last=None, before=None, next_=None, beyond=None, late=None, place=13, swapped=False):
        refs = focus, next_, beyond, *(late or [None] * 3), before, last
        self.refs = [focus if r is None else r for r in refs]
        self.late, self.place, self.swapped, self.closing = late is not None, place, swapped, place in CLOSING

    @property
    def parallelograms(self): return 0 if self.place == 13 else 1 + self.closing + self.late

def with_rest(elements, count):
    """Elements of which nothing is known follow the one before."""
    return elements + [Element(max(e - 1, 0)) for e in range(len(elements), count)]

def exceptions(section, kind):
    """13.1: bits of numbers by place."""
    found, place, fields = {}, 0, Fields(section)
    for _ in range(fields.count() if section else 0):
        place += fields.count()
        found[place] = fields.number({1: "B", 2: "H", 4: "I", 8: "Q"}[int(kind[1])])
    return found

def put_exceptions(rows, found):
    for place, value in found.items():
        rows.view("u" + rows.dtype.str[2:]).reshape(-1)[place] = value

class RawBits:
    """Raw bits, lowest bit of the first byte first."""

    def __init__(self, data):
        self.bits = int.from_bytes(data, "little")

    def __call__(self, n):
        value, self.bits = self.bits & (1 << n) - 1, self.bits >> n
        return value

def useful(place, late):
    beside = {NEXT, BEYOND} if place < 10 or place == 18 else {BEYOND} if place == 17 else set()
    lates = {LATE0, LATE1, LATE2} if place < 14 else {LATE2}
    return sorted({FOCUS, BEFORE} | beside | (lates if late else set())) if place != 13 else []

def plain_weights(place, late):
    """Of w0 to w6, in 1/128."""
    others = {17: (104, 0, -40, -40), 18: (128, 128, -128, -128), 19: (128, 0, 0, -207), 20: (128, 0, 0, -256)}
    w = [0] * 8
    if place > 13:
        w[FOCUS], w[NEXT], w[BEYOND], w[BEFORE] = others.get(place, (128, 0, 0, -128))
    triples = [(FOCUS, LAST, BEFORE)] + (place in CLOSING) * [(FOCUS, NEXT, BEYOND)] + late * [(LATE0, LATE1, LATE2)]
    for r, sign in (pair for refs in triples for pair in zip(refs, (1, 1, -1))) if place < 13 else ():
        w[r] += sign * (128 // len(triples))
    return w[:LAST]

def read_rows(side, groups):
    """For each group six rows of seven weights."""
    rows = np.zeros((groups, 6, 7), "i4")
    for group in range(groups):
        place, late, kept = group // 2, group % 2, 0
        rows[group, 0], refs = plain_weights(place, late), useful(place, late)
        while refs and kept < 2 and side.bit("kept", kept):
            kept += 1
        for t in range((0, 1, 6)[kept]):
            for r in refs if t != 4 or place < 10 else []:
                n = side.symbol("length", t > 0)
                if n:
                    negative, m = side.raw(1), (1 << n - 1) + side.raw(n - 1)
                    rows[group, t, r] = wrap(int(rows[group, t, r]) + (-m if negative else m), 16)
    return rows.astype("f4") / np.array([128] + 5 * [4096], "f4")[:, None]

def read_dictionary(side):
    side.forget()
    n, before = side.raw(16), 0
    values = [wrap(side.raw(32) | side.raw(32) << 32, 64)] if n else []
    while len(values) < n:
        length = before = side.symbol("gap", before)
        length += side.raw(6) if length == 15 else 0
        step = 1
        if length:
            low = side.raw(min(length - 1, 32))
            step += (1 << length - 1) + low + (side.raw(length - 33) << 32 if length > 33 else 0)
        values.append(values[-1] + step)
    return values

class Header:
    """The fields of 12.3 up to `side`, which a set of charts has in common (17.7)."""

    def __init__(self, fields, dtype, n, shared=False):
        self.n, self.flags = n, fields.count()
        self.wide = bool(self.flags & WIDE)
        self.maps = [Map(fields, dtype) for _ in range(n)]
        self.kind = self.maps[0].dtype if not self.maps[0].has_factor else "f8"
        self.details = Details(fields, dtype, n) if self.flags & REFINED else None
        if not shared:
            self.own(fields)
        self.order = [fields.u8() for _ in range(n)] if self.flags & SHEARED else []
        self.weights = [fields.zigzag() for _ in range(n * (n - 1) // 2 if self.order else 0)]
        self.bias = [0] * n if self.wide else [fields.zigzag() for _ in range(n)]
        self.base = [fields.u8() for _ in range(n)]
        self.first_size, self.first_spread = fields.u8(), fields.u8()
        side = CodedSequence(fields.section())
        self.rows = read_rows(side, 42 if self.flags & POLYGONS else 28)
        self.listed, self.candidates = bool(self.flags & LISTED), bool(self.flags & CANDIDATES)
        self.dictionaries = [read_dictionary(side) if self.listed or self.candidates else [] for _ in range(n)]
        self.residual = tables(side, 64 * n * (16 if self.flags & SPREAD else 1), 64, 24, 10)
        self.listed_tables = tables(side, 8**n, 2**n, 16, 10) if self.listed else None
        self.index = tables(side, 512, 16, 24, 10) if self.listed or self.candidates else None
        self.candidate = tables(side, 1600 * n, 9, 16, 10) if self.candidates else None

    def own(self, fields):
        """What a chart has of its own."""
        self.details_data = fields.section() if self.details else None
        self.exceptions = exceptions(fields.section(), self.kind)

    def stored(self, codes, kind):
        """Codes as rows of an array of this kind, exceptions and details in place."""
        made = np.zeros((len(codes), self.n), kind)
        if self.details:
            for i, row in enumerate(self.details.read(self.details_data, self.maps, codes)):
                made[i] = row
        else:
            size = 32 if int(kind[1]) <= 4 else 64
            for i, row in enumerate(codes):
                made.view("u" + kind[1])[i] = [m.stored(wrap(c, size), kind) for m, c in zip(self.maps, row)]
        put_exceptions(made, self.exceptions)
        return made

class Numbers:
    """Decodes the codes of all elements, component by component."""

    def __init__(self, header, elements, raw, data, valence=None, placed=None):
        """`placed(v, element)`: with a placement, what positions say (13.2)."""
        h, n, count = header, header.n, len(elements)
        self.h, self.elements, self.valence, self.placed, self.raw = h, elements, valence, placed, RawBits(raw)
        self.real = np.float64 if h.wide else np.float32
        self.symbols = StaticSymbols(data, 1 + (min(n, 3) if h.listed else n - 1), 5, 2, 2**24)
        self.codes, self.values = [list(h.bias) for _ in range(count)], np.zeros((count, n), self.real)
        self.sizes, self.chosen, self.indices = ([[x] * n for _ in range(count)] for x in (0, 0, None))
        self.listed, self.mirrored = [2**n - 1] * count, False
        for v in range(count):
            self.element(v)
        for code in self.codes:
            w = iter(h.weights)
            for i, o in enumerate(h.order):
                total = 128 + sum(next(w) * code[p] for p in h.order[:i])
                code[o] = wrap(code[o] + (wrap(total, 64) >> 8), 64)

    # --- forecast

    def weights_of(self, v, element):
        """w0 to w6 and that of last."""
        r, (w, *rows) = element.refs, self.h.rows[2 * element.place + element.late]
        for row, i in zip(rows if self.h.flags & VALENCES else [], (r[FOCUS], r[LAST], r[BEFORE], r[NEXT], v)):
            w = w + np.float32(DEGREES[min(self.valence[i], 10)]) * row
        last = np.float32(1) - (((w[0] + w[4]) + (w[1] + w[5])) + ((w[2] + w[6]) + w[3]))
        return [*w, last_of_wide(w) if self.h.wide else last]

    def element(self, v):
        h, element, real_, n = self.h, self.elements[v], self.real, self.elements[v].parallelograms
        values = [self.values[r] for r in element.refs]
        focus, next_, beyond, late0, late1, late2, before, last = values
        w, turned = self.placed(v, element, h.wide) if self.placed else (self.weights_of(v, element), None)
        fitted = real_(w[0]) * focus
        for x, value in zip(w[1:], values[1:]):
            fitted = fitted + real_(x) * value
        gate = (focus - before) + last
        c = ((focus - beyond) + next_) - gate if element.closing else 0 * gate
        t = ((late0 - late2) + late1) - gate if element.late else 0 * gate
        mean = gate + (c + t) * real_(0 if element.place >= 14 else 0.25 if n == 3 else 0.5)
        if turned is not None:
            fitted = self.turn(fitted, element, turned)
        spread = np.maximum(np.abs(mean - fitted), np.maximum(np.abs(c), np.abs(t)) / real_(2))
        self.forecast = fitted, gate, c, t
        around, other = (gate, fitted) if h.flags & GATE else (fitted, mean)
        self.symbols_of(v, element, n, [self.to_code(k, around[k]) for k in range(h.n)], other - around, spread)

    def turn(self, fitted, element, turned):
        """13.2: placements 2 and 3."""
        ref = [self.values[r] for r in element.refs]
        E, F = ref[LAST] - ref[FOCUS], ref[BEFORE] - ref[FOCUS]
        area = E[0] * F[1] - E[1] * F[0]
        if area != 0 and area == area:
            self.mirrored = (area < 0) != element.swapped
        tf, tn, t0, t1 = (self.real(x) for x in turned)
        way = ref[FOCUS] * tf + ref[NEXT] * tn + ref[LATE0] * t0 + ref[LATE1] * t1 + ref[LAST] * -(tf + tn + t0 + t1)
        plain = [m.curved or self.h.kind == "i4" for m in self.h.maps]
        steps = [1.0 if p else float(m.number(1)) - float(m.number(0)) for p, m in zip(plain, self.h.maps)]
        ratio = self.real(steps[1] / steps[0])
        move = np.array([way[1] * ratio, -way[0] / ratio], self.real)
        return fitted - move if self.mirrored != element.swapped else fitted + move

    def to_code(self, k, x):
        x = float(x)
        if not self.h.wide:
            return self.h.bias[k] + int(np.rint(clamp(real(x), -(2.0**21), 2.0**21)))
        curved = self.h.maps[k].curved
        return self.h.maps[k].code(x) if curved else int((clamp(x, -(2.0**62), 2.0**62) + 3 * 2.0**51) - 3 * 2.0**51)

    def number(self, k, code):
        if not self.h.wide:
            return code - self.h.bias[k]
        return clamp(self.h.maps[k].value(code), -1e37, 1e37) if self.h.maps[k].curved else float(code)

    # --- symbols

    def context(self, k, element, n, spread, centre):
        h, m, sizes = self.h, self.h.maps[k], [self.sizes[r][k] for r in element.refs]
        a = clamp((2 * sizes[LAST] + 2 * sizes[FOCUS] + sizes[BEFORE] + sizes[NEXT] + 3) // 6 - h.first_size, 0, 15)
        step = exponent_of(m.value(centre + 1) - m.value(centre)) - 2 if h.wide and m.curved else 1021
        octaves = exponent_of(float(spread)) - step if h.wide else (bits_of(spread, "f4") >> 23 & 255) - 125
        context = (4 * k + n) * 16 + a
        return 16 * context + clamp(octaves - h.first_spread, 0, 15) if h.flags & SPREAD else context

    def symbols_of(self, v, element, n, centre, apart, spread):
        """All first symbols come first, then what follows indices, residuals, and residuals that escape."""
        h, code = self.h, [None] * self.h.n
        if h.candidates:
            code = self.known_by_candidates(v, element, n)
        elif h.listed:
            code = self.known_by_list(v, element)
        symbol, near, sizes = ([None] * h.n for _ in range(3))
        for k in range(h.n):
            if code[k] == "index":
                near[k], symbol[k] = self.index(k, element)
            elif code[k] is None:
                symbol[k] = self.symbols.symbol(k, h.residual[self.context(k, element, n, spread[k], centre[k])])
                sizes[k] = symbol_size(symbol[k])
        for k in (k for k in range(h.n) if near[k] is not None):
            index = near[k] + symbol[k] - 7 if symbol[k] < 15 else self.raw(16)
            self.indices[v][k] = index = min(index & 0xFFFFFFFF, len(h.dictionaries[k]) - 1)
            code[k] = h.dictionaries[k][index] + h.bias[k]
        for k in (k for k in range(h.n) if sizes[k] is not None and symbol[k] < 63):
            code[k] = centre[k] + self.residual(h.base[k], symbol[k], apart[k])
        for k in range(h.n):
            if code[k] is None:
                length, negative = min(self.raw(7), 64 if h.wide else 22), self.raw(1)
                magnitude = self.raw(length // 2) | self.raw(length - length // 2) << length // 2
                code[k] = centre[k] + (-magnitude if negative else magnitude)
            self.codes[v][k] = c = wrap(code[k], 64)
            self.values[v, k] = self.number(k, c)
            self.sizes[v][k] = size_of(h.base[k], c - centre[k]) if sizes[k] is None else sizes[k]
            if h.candidates and near[k] is None:
                self.indices[v][k] = self.place_in(k, c)

    def residual(self, b, s, apart):
        if s == 0:
            return self.raw(b + 1) - (1 << b) if b else 0
        magnitude, more, other = (1, b, s == 2) if s < 3 else (2 + (s - 3) % 2, b + (s + 5) // 4 - 2, (s - 3) % 4 > 1)
        magnitude = (magnitude << more) + self.raw(more)
        return -magnitude if bool(apart < 0) != other else magnitude

    # --- dictionaries

    def three(self, element):
        return element.refs[LAST], element.refs[FOCUS], element.refs[NEXT if element.place < 10 else BEFORE]

    def known_by_list(self, v, element):
        h = self.h
        context = reduce(lambda context, r: context * 2**h.n + self.listed[r], self.three(element), 0)
        self.listed[v] = mask = self.symbols.symbol(min(h.n, 3), h.listed_tables[context])
        return ["index" if mask >> k & 1 and h.dictionaries[k] else None for k in range(h.n)]

    def known_by_candidates(self, v, element, n):
        h, r, known, before_m, three = self.h, element.refs, [], 9, self.three(element)
        _, gate, c, t = self.forecast
        for k in range(h.n):
            via_c, via_t = self.to_code(k, gate[k] + c[k]), self.to_code(k, gate[k] + t[k])
            before = self.codes[r[BEFORE]][k] if three[2] != r[BEFORE] or element.place < 10 else via_c
            values = [self.to_code(k, gate[k]), *(self.codes[i][k] for i in three), before, via_c, via_t]
            e = (values[0] == values[1]) + 2 * (values[0] == values[2])
            context = (((k * 10 + before_m) * 10 + self.chosen[r[LAST]][k]) * 4 + e) * 4 + n
            m = self.symbols.symbol(k, h.candidate[context])
            before_m = self.chosen[v][k] = m = 0 if m == 8 and not h.dictionaries[k] else m
            known.append(None if m == 0 else "index" if m == 8 else values[m - 1])
        return known

    def place_in(self, k, code):
        entries, value = self.h.dictionaries[k], code - self.h.bias[k]
        i = bisect_left(entries, value)
        return i if i < len(entries) and entries[i] == value else None

    def index(self, k, element):
        """The entry nearest to what is expected, and the symbol of the step from it."""
        entries, f = self.h.dictionaries[k], self.to_code(k, self.forecast[0][k]) - self.h.bias[k]
        near = bisect_left(entries, f)
        near -= near == len(entries) or near > 0 and f - entries[near - 1] <= entries[near] - f
        beyond, above = abs(f - entries[near]) // 2, f >= entries[near]
        other, g = near + 1 if above else near - 1, 3 if beyond else 0
        if beyond and 0 <= other < len(entries):
            g = int(min(3, np.float32(beyond) * (np.float32(16) / np.float32(abs(entries[other] - entries[near])))))
        context = 4 + g if above else 3 - g
        for r in self.three(element):
            index = self.indices[r][k]
            context = 4 * context + (3 if index is None else {0: 0, 1: 1, -1: 2}.get(index - near, 3))
        return near, self.symbols.symbol(k, self.h.index[context])

def last_of_wide(w): return reduce(lambda x, wi: x - np.float64(wi), w, np.float64(1))

def symbol_size(s):
    return 36 if s == 63 else 0 if s == 0 else 2 if s < 3 else 2 * ((s + 5) // 4) + (s - 3) % 2

def size_of(b, residual):
    """The size of the symbol that a residual has."""
    i = abs(residual).bit_length() - b
    return 0 if i <= 0 else 2 if i == 1 else 36 if i > 16 else 2 * i + (abs(residual) >> b + i - 2) - 2

# --- positions of fans (12.3)

def face_places(walk):
    """The table of polygons: an element for each vertex, from the face in which it comes up first."""
    places = {}
    for face, x in zip(walk.faces, walk.across_at_begin):
        places |= {v: polygon_place(face, k, v, x) for k, v in enumerate(face) if v not in places}
    return [places[v] for v in range(len(walk.births))]

def polygon_place(face, k, v, x):
    d, last, x_known = len(face), face[k - 1], k == 2 and x < v
    c = face + face  # corners, counted on
    late = (last, last, x) if x_known and d > 3 else None
    if k < 2:
        return Element(last if k else max(v - 1, 0))
    if d == 3 and x_known:
        return Element(c[0], last, x, place=10)
    if d == 4 and k == 3:
        return Element(c[0], last, c[1], place=15)
    if d == 4 and c[3] < v:
        return Element(c[3], last, c[0], late=late, place=14)
    if d in (5, 6) and all(i < v for i in c[k + 1 : d]):
        return Element(c[k + 1], last, c[k - 2], c[k + 3] if d == 6 else None, c[k + 2], late, 12 + d)
    if d > 4 and (k > 2 or c[d - 1] < v):
        return Element(c[k - 3 + d], last, c[k - 2], late=late, place=19 if d == 5 else 20)
    return Element(last, last, x, place=16) if x_known else Element(last)

def on_border(cells, points):
    """15.1: whether sides of cells do not come in pairs, by point."""
    neighbours = [0] * points
    for nodes in cells:
        for p, before, behind in zip(nodes, nodes[-1:] + nodes, nodes[1:] + nodes[:1]):
            neighbours[p] ^= before + 1 ^ behind + 1
    return [x != 0 for x in neighbours]

def valences(faces, points):
    """12.3: corners of faces at each point, twice that on a border."""
    corners = Counter(p for face in faces for p in face)
    return [(1 + border) * corners[p] % 256 for p, border in enumerate(on_border(faces, points))]

def positions(fields, fans, points, array, shared=None):
    """POSI 1, or 3 with what charts share."""
    header = copy(shared) if shared else Header(fields, array.type, 3)
    if shared:
        header.own(fields)
    elements = with_rest(face_places(fans.walk) if header.flags & POLYGONS else fans.walk.births, points)
    valence = valences(fans.fan_faces, points) if header.flags & VALENCES else None
    raw = fields.section()
    return header.stored(Numbers(header, elements, raw, fields.rest(), valence).codes, array.dtype)
