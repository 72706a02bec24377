"""Section 12.3 of docs/format.md, and 13.2 where it codes arrays in the same way: numbers by what is around."""

import copy
from bisect import bisect_left

import numpy as np

from codes import Details, Map, bits_of, clamp, exponent_of, wrap
from container import Fields, require
from entropy import CodedSequence, RawBits, StaticSymbols, bits, symbols, tables

WIDE, GATE, VALENCES, SPREAD, LISTED, CANDIDATES, REFINED, SHEARED, POLYGONS = (1 << i for i in range(9))
FOCUS, NEXT, BEYOND, LATE0, LATE1, LATE2, BEFORE, LAST = range(8)
DEGREES = [60, 60, 60, 60, 30, 12, 0, -9, -15, -20, -24]
CLOSING = (0, 2, 5, 9)


class Element:
    """References by number, in the order of their weights; those that are not given are the focus."""

    __slots__ = ("refs", "late", "place", "swapped")

    def __init__(self, focus, last=None, before=None, next_=None, beyond=None, late=None, place=13, swapped=False):
        self.refs = [focus if r is None else r for r in (focus, next_, beyond, *(late or [None] * 3), before, last)]
        self.late, self.place, self.swapped = late is not None, place, swapped

    @property
    def closing(self):
        return self.place in CLOSING

    @property
    def parallelograms(self):
        return 0 if self.place == 13 else 1 + self.closing + self.late


def exceptions(section, kind):
    """13.1: bits of numbers by place."""
    found, place, fields = {}, 0, Fields(section)
    for i in range(fields.count() if section else 0):
        gap = fields.count()
        require(i == 0 or gap, "exceptions do not rise")
        place += gap
        found[place] = fields.number({1: "B", 2: "H", 4: "I", 8: "Q"}[int(kind[1])])
    fields.end()
    return found


def useful(place, late):
    if place == 13:
        return []
    refs = {FOCUS, BEFORE}
    if place < 10 or place in (17, 18):
        refs |= {BEYOND} if place == 17 else {NEXT, BEYOND}
    if late:
        refs |= {LATE0, LATE1, LATE2} if place < 14 else {LATE2}
    return sorted(refs)


def plain_weights(place, late):
    """Of w0 to w6, in 1/128."""
    w, closing = [0] * 7, place in CLOSING
    if place == 17:
        w[FOCUS], w[BEYOND], w[BEFORE] = 104, -40, -40
    elif place >= 14:
        w[FOCUS], w[BEFORE] = 128, {19: -207, 20: -256}.get(place, -128)
        if place == 18:
            w[BEYOND], w[NEXT] = -128, 128
    elif place != 13:
        share = 128 // (1 + closing + late)
        for there, refs in ((True, (FOCUS, None, BEFORE)), (closing, (FOCUS, NEXT, BEYOND)), (late, (LATE0, LATE1, LATE2))):
            for r, sign in zip(refs, (1, 1, -1)):
                if there and r is not None:
                    w[r] += sign * share
    return w


def read_rows(side, groups):
    """For each group six rows of seven weights."""
    kept_model, length, rows = bits(), symbols(), np.zeros((groups, 6, 7), "i4")
    for group in range(groups):
        place, late = group // 2, bool(group % 2)
        rows[group, 0] = plain_weights(place, late)
        refs, kept = useful(place, late), 0
        while refs and kept < 2 and side.bit(kept_model[kept]):
            kept += 1
        for t in range((0, 1, 6)[kept]):
            for r in refs if t != 4 or place < 10 else []:
                n = side.symbol(length[t > 0])
                if n:
                    negative = side.raw(1)
                    m = (1 << n - 1) + side.raw(n - 1)
                    rows[group, t, r] = wrap(int(rows[group, t, r]) + (-m if negative else m), 16)
    return rows.astype("f4") / np.array([128] + 5 * [4096], "f4")[:, None]


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
        length += side.raw(6) if length == 15 else 0
        require(length <= 62, "a gap that is too large")
        step = 1
        if length:
            low = side.raw(min(length - 1, 32))
            step += (1 << length - 1) + low + (side.raw(length - 33) << 32 if length > 33 else 0)
        values.append(values[-1] + step)
    return values


class Header:
    """The fields of 12.3 up to `side`, which a set of charts has in common (17.7)."""

    def __init__(self, fields, dtype, n, shared=False):
        self.n, self.flags = n, fields.count(511)
        self.wide = bool(self.flags & WIDE)
        self.maps = [Map(fields, dtype) for _ in range(n)]
        self.kind = self.maps[0].dtype if not self.maps[0].has_factor else "f8"
        self.details = Details(fields, dtype, n) if self.flags & REFINED else None
        self.own(fields, not shared)
        self.order = None
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
        self.dictionaries = [read_dictionary(side) if self.listed or self.candidates else [] for _ in range(n)]
        self.E = 16 if self.flags & SPREAD else 1
        self.residual = tables(side, 64 * n * self.E, 64, 24, 10)
        self.listed_tables = tables(side, 8**n, 2**n, 16, 10) if self.listed else None
        self.index = tables(side, 512, 16, 24, 10) if self.listed or self.candidates else None
        self.candidate = tables(side, 1600 * n, 9, 16, 10) if self.candidates else None
        side.end()

    def own(self, fields, here=True):
        """What a chart has of its own."""
        self.details_data = fields.section() if self.details and here else None
        self.exceptions = exceptions(fields.section(), self.kind) if here else {}

    def stored(self, codes, kind):
        """Codes as rows of an array of this kind, exceptions and details in place."""
        made = np.zeros((len(codes), self.n), kind)
        as_bits = made.view("u" + kind[1])
        if self.details:
            for i, row in enumerate(self.details.read(self.details_data, self.maps, codes)):
                made[i] = row
        else:
            for i, row in enumerate(codes):
                as_bits[i] = [m.stored(wrap(c, 32) if int(kind[1]) <= 4 else c, kind) for m, c in zip(self.maps, row)]
        put_exceptions(made, self.exceptions)
        return made


def put_exceptions(rows, found):
    for place, value in found.items():
        require(place < rows.size, "an exception of no number")
        rows.view("u" + rows.dtype.str[2:]).reshape(-1)[place] = value


class Numbers:
    """Decodes the codes of all elements, component by component."""

    def __init__(self, header, elements, raw, data, valence=None, placed=None):
        """`placed(v, element)`: with a placement, what positions say (13.2)."""
        h = self.h = header
        self.elements, self.valence, self.placed = elements, valence, placed
        self.real = np.float64 if h.wide else np.float32
        n, count = h.n, len(elements)
        self.symbols, self.raw = StaticSymbols(data, 1 + (min(n, 3) if h.listed else n - 1), 5, 2, 2**24), RawBits(raw)
        self.codes = [list(h.bias) for _ in range(count)]
        self.values = np.zeros((count + 1, n), self.real)  # the last row stands for those that do not exist
        self.sizes, self.chosen, self.indices = ([[x] * n for _ in range(count)] for x in (0, 0, None))
        self.listed = [2**n - 1] * count
        self.mirrored, self.known_weights = False, {}
        with np.errstate(all="ignore"):
            for v in range(count):
                self.element(v)
        self.symbols.end()
        self.unshear()

    # --- forecast

    def weights_of(self, v, element):
        """w0 to w6 and that of last."""
        degrees, group = (), 2 * element.place + element.late
        if self.h.flags & VALENCES:
            r = element.refs
            degrees = tuple(DEGREES[min(self.valence[i], 10)] for i in (r[FOCUS], r[LAST], r[BEFORE], r[NEXT], v))
        if (group, degrees) not in self.known_weights:
            rows = self.h.rows[group]
            w = rows[0]
            for row, d in zip(rows[1:], degrees):
                w = w + np.float32(d) * row
            last = np.float32(1) - (((w[0] + w[4]) + (w[1] + w[5])) + ((w[2] + w[6]) + w[3]))
            self.known_weights[group, degrees] = [*w, last_of_wide(w) if self.h.wide else last]
        return self.known_weights[group, degrees]

    def element(self, v):
        h, element, real = self.h, self.elements[v], self.real
        values = [self.values[r] for r in element.refs]
        focus, next_, beyond, late0, late1, late2, before, last = values
        w, turned = self.placed(v, element, h.wide) if self.placed else (self.weights_of(v, element), None)
        fitted = real(w[0]) * focus
        for x, value in zip(w[1:], values[1:]):
            fitted = fitted + real(x) * value
        gate = (focus - before) + last
        c = ((focus - beyond) + next_) - gate if element.closing else 0 * gate
        t = ((late0 - late2) + late1) - gate if element.late else 0 * gate
        n = element.parallelograms
        mean = gate + (c + t) * real(0 if element.place >= 14 else 0.25 if n == 3 else 0.5)
        if turned is not None:
            fitted = self.turn(fitted, element, turned)
        spread = np.maximum(np.abs(mean - fitted), np.maximum(np.abs(c), np.abs(t)) / real(2))
        self.forecast = fitted, gate, c, t
        around, other = (gate, fitted) if h.flags & GATE else (fitted, mean)
        self.symbols_of(v, element, n, [self.to_code(k, around[k]) for k in range(h.n)], other - around, spread)

    def turn(self, fitted, element, turned):
        """13.2: placements 2 and 3."""
        real, ref = self.real, [self.values[r] for r in element.refs]
        E, F = ref[LAST] - ref[FOCUS], ref[BEFORE] - ref[FOCUS]
        area = E[0] * F[1] - E[1] * F[0]
        if area != 0 and area == area:
            self.mirrored = (area < 0) != element.swapped
        tf, tn, t0, t1 = (real(x) for x in turned)
        way = ref[FOCUS] * tf + ref[NEXT] * tn + ref[LATE0] * t0 + ref[LATE1] * t1 + ref[LAST] * -(tf + tn + t0 + t1)
        steps = [1.0 if m.curved or self.h.kind == "i4" else float(m.number(1)) - float(m.number(0)) for m in self.h.maps]
        ratio = real(steps[1] / steps[0])
        move = np.array([way[1] * ratio, -way[0] / ratio], real)
        return fitted - move if self.mirrored != element.swapped else fitted + move

    def to_code(self, k, x):
        x = float(x)
        if not self.h.wide:
            return self.h.bias[k] + int(np.rint(clamp(x, -(2.0**21), 2.0**21) if x == x else 0.0))
        if self.h.maps[k].curved:
            return self.h.maps[k].code(x)
        return int((clamp(x, -(2.0**62), 2.0**62) + 3 * 2.0**51) - 3 * 2.0**51)

    def number(self, k, code):
        if not self.h.wide:
            return code - self.h.bias[k]
        return clamp(self.h.maps[k].value(code), -1e37, 1e37) if self.h.maps[k].curved else float(code)

    # --- symbols

    def context(self, k, element, n, spread, centre):
        h, m, sizes = self.h, self.h.maps[k], [self.sizes[r][k] for r in element.refs]
        a = clamp((2 * sizes[LAST] + 2 * sizes[FOCUS] + sizes[BEFORE] + sizes[NEXT] + 3) // 6 - h.first_size, 0, 15)
        if not h.flags & SPREAD:
            return (4 * k + n) * 16 + a
        if h.wide:
            octaves = exponent_of(float(spread)) - (exponent_of(m.value(centre + 1) - m.value(centre)) - 2 if m.curved else 1021)
        else:
            octaves = (bits_of(spread, "f4") >> 23 & 255) - 125
        return ((4 * k + n) * 16 + a) * 16 + clamp(octaves - h.first_spread, 0, 15)

    def symbols_of(self, v, element, n, centre, apart, spread):
        """All first symbols come first, then what follows indices, residuals, and residuals that escape."""
        h = self.h
        code = self.known_by_candidates(v, element, n) if h.candidates else self.known_by_list(v, element) if h.listed else [None] * h.n
        symbol, near, sizes = [None] * h.n, [None] * h.n, [None] * h.n
        for k in range(h.n):
            if code[k] == "index":
                near[k], symbol[k] = self.index(k, element)
            elif code[k] is None:
                symbol[k] = self.symbols.symbol(k, h.residual[self.context(k, element, n, spread[k], centre[k])])
                sizes[k] = symbol_size(symbol[k])
        for k in range(h.n):
            if near[k] is not None:
                index = near[k] + symbol[k] - 7 if symbol[k] < 15 else self.raw.raw(16)
                self.indices[v][k] = index = min(index & 0xFFFFFFFF, len(h.dictionaries[k]) - 1)
                code[k] = h.dictionaries[k][index] + h.bias[k]
        for k in range(h.n):
            if sizes[k] is not None and symbol[k] < 63:
                code[k] = centre[k] + self.residual(h.base[k], symbol[k], apart[k])
        for k in range(h.n):
            if code[k] is None:
                length = min(self.raw.raw(7), 64 if h.wide else 22)
                negative = self.raw.raw(1)
                low = self.raw.raw(length // 2)
                magnitude = low | self.raw.raw(length - length // 2) << length // 2
                code[k] = centre[k] + (-magnitude if negative else magnitude)
            self.codes[v][k] = c = wrap(code[k], 64)
            self.values[v, k] = self.number(k, c)
            self.sizes[v][k] = size_of(h.base[k], c - centre[k]) if sizes[k] is None else sizes[k]
            if h.candidates and near[k] is None:
                self.indices[v][k] = self.place_in(k, c)

    def residual(self, b, s, apart):
        if s == 0:
            return self.raw.raw(b + 1) - (1 << b) if b else 0
        if s < 3:
            magnitude, other = (1 << b) + self.raw.raw(b), s == 2
        else:
            l = b + (s + 5) // 4
            magnitude, other = (2 + (s - 3) % 2 << l - 2) + self.raw.raw(l - 2), (s - 3) % 4 // 2 == 1
        return -magnitude if bool(apart < 0) != other else magnitude

    # --- dictionaries

    def three(self, element):
        return element.refs[LAST], element.refs[FOCUS], element.refs[NEXT if element.place < 10 else BEFORE]

    def known_by_list(self, v, element):
        h, context = self.h, 0
        for r in self.three(element):
            context = context * 2**h.n + self.listed[r]
        self.listed[v] = mask = self.symbols.symbol(min(h.n, 3), h.listed_tables[context])
        return ["index" if mask >> k & 1 and h.dictionaries[k] else None for k in range(h.n)]

    def known_by_candidates(self, v, element, n):
        h, r, known, before_m = self.h, element.refs, [], 9
        _, gate, c, t = self.forecast
        for k in range(h.n):
            codes = [self.codes[i][k] for i in self.three(element)]
            via_c, via_t = self.to_code(k, gate[k] + c[k]), self.to_code(k, gate[k] + t[k])
            before = self.codes[r[BEFORE]][k] if self.three(element)[2] != r[BEFORE] or element.place < 10 else via_c
            values = [self.to_code(k, gate[k]), *codes, before, via_c, via_t]
            e = (values[0] == values[1]) + 2 * (values[0] == values[2])
            m = self.symbols.symbol(k, h.candidate[(((k * 10 + before_m) * 10 + self.chosen[r[LAST]][k]) * 4 + e) * 4 + n])
            m = 0 if m == 8 and not h.dictionaries[k] else m
            before_m = self.chosen[v][k] = m
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
        if near == len(entries) or near and f - entries[near - 1] <= entries[near] - f:
            near -= 1
        beyond, above, g = abs(f - entries[near]) // 2, f >= entries[near], 0
        other = near + 1 if above else near - 1
        if beyond > 0:
            g = 3
            if 0 <= other < len(entries):
                g = int(min(np.float32(3), np.float32(beyond) * (np.float32(16) / np.float32(abs(entries[other] - entries[near])))))
        context = 4 + g if above else 3 - g
        for r in self.three(element):
            index = self.indices[r][k]
            context = 4 * context + (3 if index is None else {0: 0, 1: 1, -1: 2}.get(index - near, 3))
        return near, self.symbols.symbol(k, self.h.index[context])

    def unshear(self):
        order = self.h.order or []
        for code in self.codes if order else []:
            w = iter(self.h.weights)
            for i, o in enumerate(order[1:], 1):
                total = 128 + sum(next(w) * code[p] for p in order[:i])
                code[o] = wrap(code[o] + (wrap(total, 64) >> 8), 64)


def last_of_wide(w):
    x = np.float64(1)
    for wi in w:
        x = x - np.float64(wi)
    return x


def symbol_size(s):
    return 36 if s == 63 else 0 if s == 0 else 2 if s < 3 else 2 * ((s + 5) // 4) + (s - 3) % 2


def size_of(b, residual):
    """The size of the symbol that a residual has."""
    m = abs(residual)
    i = m.bit_length() - b
    return 0 if i <= 0 else 2 if i == 1 else 36 if i > 16 else 2 * i + (m >> m.bit_length() - 2) - 2


# --- positions of fans (12.3)


def face_places(walk):
    """The table of polygons: an element for each vertex, from the face in which it comes up first."""
    found = {}
    for face, x in zip(walk.faces, walk.across_at_begin):
        for k, v in enumerate(face):
            if v not in found:
                found[v] = polygon_place(face, k, v, x)
    return [found[v] for v in range(len(walk.births))]


def polygon_place(face, k, v, x):
    d, last = len(face), face[k - 1]
    x_known = k == 2 and x < v

    def element(place, focus, before=None, beyond=None, next_=None):
        late = (last, last, x) if x_known and 14 <= place <= 20 and place != 16 else None
        return Element(focus, last, before, next_, beyond, late, place)

    def c(i):
        return face[i % d]

    if k < 2:
        return Element(last if k else max(v - 1, 0))
    if d == 3 and x_known:
        return element(10, c(0), x)
    if d == 4:
        return element(15, c(0), c(1)) if k == 3 else element(14, c(3), c(0)) if c(3) < v else element(16, last, x) if x_known else Element(last)
    if d in (5, 6) and all(c(i) < v for i in range(k + 1, d)):
        return element(12 + d, c(k + 1), c(k - 2), c(k + 2), c(k + 3) if d == 6 else None)
    if d > 4 and (k > 2 or c(d - 1) < v):
        return element(19 if d == 5 else 20, c(k - 3), c(k - 2))
    return element(16, last, x) if x_known else Element(last)


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
    header = copy.copy(shared) if shared else Header(fields, array.type, 3)
    if shared:
        header.own(fields)
    elements = face_places(fans.walk) if header.flags & POLYGONS else fans.walk.births
    elements = elements + [Element(max(p - 1, 0)) for p in range(len(elements), points)]
    valence = valences(fans.fan_faces, points) if header.flags & VALENCES else None
    raw = fields.section()
    return header.stored(Numbers(header, elements, raw, fields.rest(), valence).codes, array.dtype)
