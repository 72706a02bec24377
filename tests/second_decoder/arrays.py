"""Sections 13.1 and 13.2 of docs/format.md: arrays, coded by what is around their elements."""

import math

import numpy as np

import around
from around import BEFORE, BEYOND, FOCUS, LAST, LATE0, LATE1, LATE2, NEXT, Element, Header, Numbers, alone, finish
from codes import clamp, wrap
from container import Fields, Unread, require
from description import CELLS, CORNERS, MESH, POINTS, TWINS
from entropy import CodedSequence, bits


class Corners:
    """The corners of the faces, counted over all faces, and the edges across (13.2)."""

    def __init__(self, faces):
        self.faces = faces
        self.point = [p for face in faces for p in face]
        self.face = [f for f, face in enumerate(faces) for _ in face]
        self.next, self.previous, at = [], [], 0
        for face in faces:
            n = len(face)
            self.next += [at + (i + 1) % n for i in range(n)]
            self.previous += [at + (i - 1) % n for i in range(n)]
            at += n
        self.across, waiting = [None] * at, {}
        for c in range(at):
            a, b = self.point[c], self.point[self.next[c]]
            there = waiting.setdefault(b, [])
            o = next((o for o in there[:-65:-1] if self.point[self.next[o]] == a), None)
            if o is None:
                waiting.setdefault(a, []).append(c)
            else:
                there.remove(o)
                self.across[c], self.across[o] = o, c

    def size(self, c):
        return len(self.faces[self.face[c]])


def element_references(corners, element, count):
    """The references of points or of joined corners; `element` by corner."""
    own = [[] for _ in range(count)]
    for c, e in enumerate(element):
        own[e].append(c)
    return [references_of(corners, element, e, own[e]) for e in range(count)], [len(cs) % 256 for cs in own]


def references_of(corners, element, e, own):
    nxt, prv, across = corners.next, corners.previous, corners.across
    found = []  # (a, b, x, kind)
    for c in own:
        if len(found) == 3:
            break
        n, p = nxt[c], prv[c]
        i, j = element[n], element[p]
        if i >= e or j >= e:
            continue
        if corners.size(c) == 3:
            o = across[n]
            if o is not None and element[o] == j and element[nxt[o]] == i and element[prv[o]] < e:
                found.append((i, j, element[prv[o]], "triangle"))
        elif element[nxt[n]] < e:
            found.append((i, j, element[nxt[n]], "larger"))
    for c in own:
        if len(found) == 3:
            break
        if corners.size(c) == 3:
            continue
        n, p = nxt[c], prv[c]
        i, j = element[n], element[p]
        if i < e and element[nxt[n]] < e and j >= e:
            o = across[n]
            if o is not None and element[nxt[o]] == i and element[nxt[nxt[o]]] < e:
                found.append((i, i, element[nxt[nxt[o]]], "straight"))
        elif j < e and element[prv[p]] < e and i >= e:
            o = across[prv[p]]
            if o is not None and element[o] == j and element[prv[o]] < e:
                found.append((j, j, element[prv[o]], "straight"))
    if found:
        return by_parallelograms(found)
    for c in own:
        i, j = element[nxt[c]], element[prv[c]]
        if i < e and j < e:
            f, l = min(i, j), max(i, j)
            return Element((f, f, f, f, f, f, f, l), False, 1, f == j and i != j)
    for c in own:
        for r in (element[nxt[c]], element[prv[c]]):
            if r < e:
                return alone(r)
    return alone(max(e - 1, 0))


def by_parallelograms(found):
    a, b, before, kind = found[0]
    focus, last = min(a, b), max(a, b)
    place = {"triangle": 10, "larger": 11, "straight": 12}[kind]
    next_ = beyond = None
    late = found[1] if len(found) > 1 else None
    if len(found) == 3:
        for k in (1, 2):
            pair = found[k][:2]
            if focus in pair or last in pair:
                late = found[3 - k]
                if focus not in pair:
                    focus, last = last, focus
                next_ = pair[1] if pair[0] == focus else pair[0]
                beyond, place = found[k][2], 0 if found[k][3] == "triangle" else 2
                break
    if next_ is None:
        next_ = beyond = focus
    triple = late[:3] if late else (focus,) * 3
    return Element((focus, next_, beyond) + triple + (before, last), bool(late), place, focus == b and a != b)


def face_references(corners, count):
    made = [None] * count
    at = 0
    for f in range(count):
        beside = set()
        for c in range(at, at + len(corners.faces[f])):
            o = corners.across[c]
            if o is not None and corners.face[o] < f:
                beside.add(corners.face[o])
        at += len(corners.faces[f])
        highest = sorted(beside, reverse=True)[:3]
        if len(highest) < 2:
            made[f] = alone(highest[0] if highest else max(f - 1, 0))
        else:
            last, second, third = highest[0], highest[1], highest[-1]
            made[f] = Element((second, third, third, second, second, second, second, last), False, 1)
    return made


class Joined:
    """Corners that are one element (13.2)."""

    def __init__(self, section, patch, twins):
        corners, sequence = patch.corners_, CodedSequence(section)
        self.parent = list(range(len(corners.point)))
        points, _ = patch.point_references()
        joints = self.joints(corners, twins)
        left = [0] * patch.points
        for c, o, edge, p, q in joints:
            left[p] += 1
        many = [n > 254 for n in left]
        cut_models, joint_models = bits(), bits()
        cut, apart = [0] * patch.points, [0] * patch.points
        for p in range(patch.points):
            if left[p]:
                r = points[p].refs
                C = [cut[i] if i < p else 0 for i in (r[around.LAST], r[around.FOCUS], r[around.BEFORE])]
                cut[p] = sequence.bit(cut_models[4 * C[0] + 2 * C[1] + C[2]])
        before, last_edge = 0, None
        for c, o, edge, p, q in joints:
            before = 0 if edge != last_edge else before
            last_edge = edge
            left[p] -= not many[p]
            joined = 1
            if cut[p]:
                joined = sequence.bit(joint_models[((before * 2 + cut[q]) * 3 + min(2, apart[p])) * 4 + min(3, left[p])])
                apart[p] += not joined
            if joined:
                self.join(c, o)
            before = 1 + joined
        sequence.end()
        if twins is not None:
            first = {}
            for c, twin in enumerate(twins):
                self.join(first.setdefault(twin, c), c)
        number, self.element = {}, []
        for c in range(len(corners.point)):
            self.element.append(number.setdefault(self.find(c), len(number)))
        self.count = len(number)

    @staticmethod
    def joints(corners, twins):
        found = []
        for c, o in enumerate(corners.across):
            if o is None or o < c:
                continue
            a, b = corners.point[c], corners.point[corners.next[c]]
            for x, y, p, q in ((c, corners.next[o], a, b), (corners.next[c], o, b, a)):
                if twins is None or twins[x] != twins[y]:
                    found.append((x, y, c, p, q))
        return found

    def find(self, c):
        while self.parent[c] != c:
            self.parent[c] = self.parent[self.parent[c]]
            c = self.parent[c]
        return c

    def join(self, a, b):
        a, b = self.find(a), self.find(b)
        self.parent[max(a, b)] = min(a, b)


def unit_vector(i, j, steps):
    x, y = i / steps, j / steps
    z = 1 - abs(x) - abs(y)
    if z < 0:
        sign = [-1.0 if u < 0 else 1.0 for u in (x, y)]
        x, y = (1 - abs(y)) * sign[0], (1 - abs(x)) * sign[1]
    length = math.sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def dot(u, v):
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


class Placement:
    """13.2: positions give the weights."""

    def __init__(self, places, placement, wide):
        self.at, self.m, self.placement, self.wide = places, {1: 0.0, 2: 1.0, 3: 0.5}[placement], placement, wide

    def __call__(self, e, element):
        """w0 to w6, that of last, and the turned ones of focus, next, late 0 and 1, if there are such."""
        self.w, self.turned = np.zeros(8), np.zeros(8)
        if element.place == 13:
            self.w[LAST] = 1
        elif element.place == 1:
            self.between(e, element.refs)
        else:
            share = 1 / element.parallelograms
            self.add(e, element.refs, (FOCUS, LAST, BEFORE), share, 1)
            if element.closing:
                self.add(e, element.refs, (FOCUS, NEXT, BEYOND), share, -1)
            if element.late:
                self.add(e, element.refs, (LATE0, LATE1, LATE2), share, -1 if element.swapped else 1)
        w = self.w.astype("f4")
        last = w[LAST]
        if self.wide:
            last = np.float64(1)
            for x in w[:LAST]:
                last = last - np.float64(x)
        return w[:LAST], last, self.turned[[FOCUS, NEXT, LATE0, LATE1]].astype("f4") if self.m else None

    def between(self, e, refs):
        A, B, T = self.at[refs[FOCUS]], self.at[refs[LAST]], self.at[e]
        d = dot(B - A, B - A)
        along = dot(T - A, B - A) / d
        t = (T - A) - (B - A) * along
        off = np.sqrt(dot(t, t) / d)
        if not (abs(along - 0.5) < 4 and off < 4):
            self.w[FOCUS] = self.w[LAST] = 0.5
            return
        along = clamp(along, -1.0, 2.0)
        self.w[FOCUS], self.w[LAST] = 1 - along, along
        if self.m:
            self.turned[FOCUS], self.turned[LAST] = -off, off

    def add(self, e, refs, abx, share, s):
        a, b, x = abx
        A, B, X, T = (self.at[i] for i in (refs[a], refs[b], refs[x], e))
        if refs[a] == refs[b]:
            beyond = np.sqrt(dot(T - A, T - A) / dot(X - A, X - A))
            beyond = beyond if beyond < 4 else 1
            self.w[a] += (1 + beyond) * share
            self.w[x] += -beyond * share
            return
        d = dot(B - A, B - A)
        along, xalong = dot(T - A, B - A) / d, dot(X - A, B - A) / d
        t, away = (T - A) - (B - A) * along, (X - A) - (B - A) * xalong
        off, beyond = np.sqrt(dot(t, t) / d), np.sqrt(dot(t, t) / dot(away, away))
        if not (abs(along - 0.5) < 4 and off < 4 and beyond < 4 and abs(xalong - 0.5) < 4):
            for place, w in ((a, 1), (b, 1), (x, -1)):
                self.w[place] += w * share
            return
        l = (1 - self.m) * beyond
        self.w[a] += (1 - along + l * (1 - xalong)) * share
        self.w[b] += (along + l * xalong) * share
        self.w[x] += -l * share
        turn = share * self.m * off * s
        self.turned[a] += -turn
        self.turned[b] += turn


class Around:
    """An array of coding 17 in a patch."""

    def __init__(self, fields, array, patch):
        self.patch, self.array = patch, array
        unit = fields.u8()
        require(unit <= 1, "flags that are not known")
        self.spread_out = None  # the element of each tuple, where several tuples share one
        domain = array.domain
        if domain in (CORNERS, TWINS):
            joined = Joined(fields.section(), patch, patch.twins if domain == TWINS else None)
            self.elements, valence = element_references(patch.corners_, joined.element, joined.count)
            loose = sum(len(nodes) for cells in patch.fans.loose for _, nodes in cells)
            self.spread_out = joined.element + list(range(joined.count, joined.count + loose))
            count = joined.count + loose
            self.places = [patch.numbers[p] for p in self.first_points(joined.element, patch.corners_.point)]
        elif domain == POINTS:
            self.elements, valence = patch.point_references()
            count, self.places = patch.points, patch.numbers
        elif domain == CELLS:
            self.elements = face_references(patch.corners_, len(patch.fans.faces))
            count, self.places = len(self.elements) + sum(map(len, patch.fans.loose)), None
            valence = [0] * len(self.elements)
        else:
            self.elements, valence, count, self.places = [], [], array.tuples, None
        self.elements = self.elements + [alone(max(e - 1, 0)) for e in range(len(self.elements), count)]
        self.valence = valence + [0] * (count - len(valence))
        if unit:
            steps = fields.count(67108864)
            replaced = around.exceptions(fields.section(), array.dtype)
            codes = self.numbers(fields, 4, 2)[1]
            made = np.array([unit_vector(i, j, steps) for i, j in codes], "f8").reshape(-1, 3).astype(array.dtype)
            for place, value in replaced.items():
                made.view("u" + array.dtype[1]).reshape(-1)[place] = value
        elif array.components <= 4:
            made = self.numbers(fields, array.type, array.components)[0]
        else:
            groups = []
            for first in range(0, array.components, 4):
                groups.append(self.numbers(Fields(fields.section()), array.type, min(4, array.components - first))[0])
            fields.end()
            made = np.concatenate(groups, 1)
        self.values = made[self.spread_out] if self.spread_out is not None else made

    @staticmethod
    def first_points(element, point):
        first = {}
        for c, e in enumerate(element):
            first.setdefault(e, point[c])
        return [first[e] for e in range(len(first))]

    def numbers(self, fields, type_, n):
        placement = fields.u8()
        require(placement == 0 or placement <= 3 and (placement == 1 or n == 2), "a placement that cannot be")
        header = Header(fields, type_, n, placement=placement)
        raw = fields.section()
        weights = Placement(self.places, placement, header.wide) if placement else None
        numbers = Numbers(header, self.elements, raw, fields.rest(), self.valence, weights)
        dtype = self.array.dtype if type_ == self.array.type else "i4"
        return finish(header.maps, numbers.codes, dtype, header.exceptions, header.details, header.details_data), numbers.codes


def decode(stream, array, patch):
    """The tuples of an array in coded order (13.1)."""
    fields = Fields(stream)
    coding = fields.u8()
    if coding == 17:
        return Around(fields, array, patch).values
    if coding == 8:
        import normals
        return by_corner(normals.Normals(fields, array, patch).values, array, patch)
    require(coding in (8, 9, 16, 17), "a coding that does not exist")
    raise Unread(f"coding {coding}")


def by_corner(values, array, patch):
    """Tuples of half-edges go to their corners."""
    if array.domain in (CORNERS, TWINS):
        order = np.arange(len(values))
        order[patch.surface.corner_of] = np.arange(patch.surface.real)
        return values[order]
    return values
