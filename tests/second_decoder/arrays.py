"""Sections 13.1 and 13.2 of docs/format.md: arrays, coded by what is around their elements."""

import numpy as np

import normals
from around import BEFORE, BEYOND, FOCUS, LAST, LATE0, LATE1, LATE2, NEXT, Element, Header, Numbers, exceptions, last_of_wide, put_exceptions
from codes import clamp, octahedral
from container import Fields, Unread, require
from description import CELLS, CORNERS, POINTS, TWINS
from entropy import CodedSequence, bits


class Corners:
    """The corners of the faces, counted over all faces, and the edges across (13.2)."""

    def __init__(self, faces):
        self.point = [p for face in faces for p in face]
        self.face = [f for f, face in enumerate(faces) for _ in face]
        self.begin = np.cumsum([0] + [len(face) for face in faces]).tolist()
        self.next, self.previous = ([b + (i + s) % len(f) for b, f in zip(self.begin, faces) for i in range(len(f))] for s in (1, -1))
        self.across, waiting = [None] * len(self.point), {}
        for c, (a, n) in enumerate(zip(self.point, self.next)):
            b = self.point[n]
            there = waiting.setdefault(b, [])
            o = next((o for o in there[:-65:-1] if self.point[self.next[o]] == a), None)
            if o is None:
                waiting.setdefault(a, []).append(c)
            else:
                there.remove(o)
                self.across[c], self.across[o] = o, c

    def size(self, c):
        return self.begin[self.face[c] + 1] - self.begin[self.face[c]]


def element_references(corners, element, count):
    """The references of points or of joined corners, and valences; `element` by corner."""
    own = [[] for _ in range(count)]
    for c, e in enumerate(element):
        own[e].append(c)
    return [references_of(corners, element, e, own[e]) for e in range(count)], [len(cs) % 256 for cs in own]


def references_of(corners, element, e, own):
    nxt, prv, across = corners.next, corners.previous, corners.across

    def known(*cs):
        return all(element[c] < e for c in cs)

    found = []  # (a, b, x, place)
    for c in own:
        n, p, o = nxt[c], prv[c], across[nxt[c]]
        if not known(n, p):
            continue
        i, j = element[n], element[p]
        if corners.size(c) > 3:
            found += [(i, j, element[nxt[n]], 11)] if known(nxt[n]) else []
        elif o is not None and element[o] == j and element[nxt[o]] == i and known(prv[o]):
            found.append((i, j, element[prv[o]], 10))
    for c in own:
        n, p = nxt[c], prv[c]
        if corners.size(c) == 3 or known(n) == known(p):
            continue
        if known(n, nxt[n]):
            o, i = across[n], element[n]
            x, shared = (nxt[nxt[o]], nxt[o]) if o is not None else (None, None)
        elif known(p, prv[p]):
            o, i = across[prv[p]], element[p]
            x, shared = (prv[o], o) if o is not None else (None, None)
        else:
            continue
        if o is not None and element[shared] == i and known(x):
            found.append((i, i, element[x], 12))
    if found:
        return by_parallelograms(found[:3])
    for c in own:
        i, j = element[nxt[c]], element[prv[c]]
        if max(i, j) < e:
            return Element(min(i, j), max(i, j), place=1, swapped=j < i)
    near = (element[x] for c in own for x in (nxt[c], prv[c]))
    return Element(next((r for r in near if r < e), max(e - 1, 0)))


def by_parallelograms(found):
    a, b, before, place = found[0]
    focus, last = min(a, b), max(a, b)
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
                beyond, place = found[k][2], 0 if found[k][3] == 10 else 2
                break
    return Element(focus, last, before, next_, beyond, late and late[:3], place, focus == b and a != b)


def face_references(corners, count):
    made = []
    for f in range(count):
        across = (corners.across[c] for c in range(corners.begin[f], corners.begin[f + 1]))
        beside = sorted({corners.face[o] for o in across if o is not None and corners.face[o] < f}, reverse=True)[:3]
        if len(beside) < 2:
            made.append(Element(beside[0] if beside else max(f - 1, 0)))
        else:
            made.append(Element(beside[1], beside[0], None, beside[-1], beside[-1], place=1))
    return made


class Joined:
    """Corners that are one element (13.2): `element` by corner."""

    def __init__(self, section, patch, twins):
        corners, q = patch.corners, CodedSequence(section)
        self.parent = list(range(len(corners.point)))
        points, _ = patch.point_references()
        joints = self.joints(corners, twins)
        left, cut, apart = ([0] * patch.points for _ in range(3))
        for _, _, _, p, _ in joints:
            left[p] += 1
        many = [n > 254 for n in left]
        cut_models, joint_models = bits(), bits()
        for p in range(patch.points):
            if left[p]:
                context = tuple(cut[i] if i < p else 0 for i in (points[p].refs[r] for r in (LAST, FOCUS, BEFORE)))
                cut[p] = q.bit(cut_models[context])
        before, last_edge = 0, None
        for c, o, edge, p, far in joints:
            before, last_edge = 0 if edge != last_edge else before, edge
            left[p] -= not many[p]
            joined = 1
            if cut[p]:
                joined = q.bit(joint_models[before, cut[far], min(2, apart[p]), min(3, left[p])])
                apart[p] += not joined
            if joined:
                self.join(c, o)
            before = 1 + joined
        q.end()
        first, number = {}, {}
        for c, twin in enumerate(twins or []):
            self.join(first.setdefault(twin, c), c)
        self.element = [number.setdefault(self.find(c), len(number)) for c in range(len(corners.point))]
        self.count = len(number)

    @staticmethod
    def joints(corners, twins):
        """(corner, corner on the other side, edge, their point, the other end)"""
        found = []
        for c, o in enumerate(corners.across):
            if o is not None and c < o:
                for x, y, far in ((c, corners.next[o], corners.next[c]), (corners.next[c], o, c)):
                    if twins is None or twins[x] != twins[y]:
                        found.append((x, y, c, corners.point[x], corners.point[far]))
        return found

    def find(self, c):
        while self.parent[c] != c:
            self.parent[c] = c = self.parent[self.parent[c]]
        return c

    def join(self, a, b):
        a, b = self.find(a), self.find(b)
        self.parent[max(a, b)] = min(a, b)


class Placement:
    """13.2: positions give the weights."""

    def __init__(self, places, placement):
        self.at, self.m = places, {1: 0.0, 2: 1.0, 3: 0.5}[placement]

    def __call__(self, e, element, wide):
        """w0 to w6 and that of last, and the turned ones of focus, next, late 0 and 1, if there are such."""
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
        last = last_of_wide(w[:LAST]) if wide else w[LAST]
        return [*w[:LAST], last], self.turned[[FOCUS, NEXT, LATE0, LATE1]].astype("f4") if self.m else None

    @staticmethod
    def along(A, B, T):
        """Where T is along A to B, and its square distance from there, both measured by that of A and B."""
        d = normals.dot(B - A, B - A)
        along = normals.dot(T - A, B - A) / d
        t = (T - A) - (B - A) * along
        return along, normals.dot(t, t), d

    def between(self, e, refs):
        along, t, d = self.along(*(self.at[i] for i in (refs[FOCUS], refs[LAST], e)))
        off = np.sqrt(t / d)
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
            beyond = np.sqrt(normals.dot(T - A, T - A) / normals.dot(X - A, X - A))
            beyond = beyond if beyond < 4 else 1
            self.w[a] += (1 + beyond) * share
            self.w[x] += -beyond * share
            return
        (along, t, d), (xalong, away, _) = self.along(A, B, T), self.along(A, B, X)
        off, beyond = np.sqrt(t / d), np.sqrt(t / away)
        if not (abs(along - 0.5) < 4 and off < 4 and beyond < 4 and abs(xalong - 0.5) < 4):
            for place, w in zip(abx, (1, 1, -1)):
                self.w[place] += w * share
            return
        l = (1 - self.m) * beyond
        self.w[a] += (1 - along + l * (1 - xalong)) * share
        self.w[b] += (along + l * xalong) * share
        self.w[x] += -l * share
        turn = share * self.m * off * s
        self.turned[a] += -turn
        self.turned[b] += turn


def around(fields, array, patch):
    """Coding 17."""
    unit, domain, spread_out = fields.u8(), array.domain, None
    require(unit <= 1, "flags that are not known")
    elements, valence, count, places = [], [], array.tuples, None
    if domain in (CORNERS, TWINS):
        joined = Joined(fields.section(), patch, patch.twins if domain == TWINS else None)
        elements, valence = element_references(patch.corners, joined.element, joined.count)
        count = joined.count + sum(len(nodes) for cells in patch.fans.loose for _, nodes in cells)
        spread_out = joined.element + list(range(joined.count, count))  # the element of each tuple
        point = dict(zip(reversed(joined.element), reversed(patch.corners.point)))  # that of the first corner
        places = [patch.numbers[point[e]] for e in range(joined.count)]
    elif domain == POINTS:
        elements, valence = patch.point_references()
        count, places = patch.points, patch.numbers
    elif domain == CELLS:
        elements = face_references(patch.corners, len(patch.fans.faces))
        count = len(elements) + sum(map(len, patch.fans.loose))
    elements = elements + [Element(max(e - 1, 0)) for e in range(len(elements), count)]
    valence = valence + [0] * (count - len(valence))

    def numbers(fields, type_, n):
        placement = fields.u8()
        require(placement == 0 or placement <= 3 and (placement == 1 or n == 2), "a placement that cannot be")
        header, raw = Header(fields, type_, n), fields.section()
        return header, Numbers(header, elements, raw, fields.rest(), valence, Placement(places, placement) if placement else None).codes

    if unit:
        steps, replaced = fields.count(67108864), exceptions(fields.section(), array.dtype)
        made = np.array([octahedral(i, j, steps) for i, j in numbers(fields, 4, 2)[1]], "f8").reshape(-1, 3).astype(array.dtype)
        put_exceptions(made, replaced)
    else:
        groups, n = [], array.components
        for first in range(0, n, 4):
            header, codes = numbers(Fields(fields.section()) if n > 4 else fields, array.type, min(4, n - first))
            groups.append(header.stored(codes, array.dtype))
        fields.end()
        made = np.concatenate(groups, 1)
    return made[spread_out] if spread_out is not None else made


def decode(stream, array, patch):
    """The tuples of an array in coded order (13.1)."""
    fields = Fields(stream)
    coding = fields.u8()
    require(coding in (8, 9, 16, 17), "a coding that does not exist")
    if coding == 17:
        return around(fields, array, patch)
    if coding != 8:
        raise Unread(f"coding {coding}")
    values = normals.Normals(fields, array, patch).values
    if array.domain in (CORNERS, TWINS):  # tuples of half-edges go to their corners
        order = np.arange(len(values))
        order[patch.surface.corner_of] = np.arange(patch.surface.real)
        return values[order]
    return values
