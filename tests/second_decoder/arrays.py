"""Sections 13.1 and 13.2 of docs/format.md: arrays, coded by what is around their elements."""
from collections import Counter
import numpy as np
import face_normals
import normals
from around import BEFORE, BEYOND, FOCUS, LAST, LATE0, LATE1, LATE2, NEXT
from around import Element, Header, Numbers, exceptions, last_of_wide, put_exceptions, with_rest
from container import Fields, Unread, clamp
from description import CELLS, CORNERS, POINTS, TWINS
from entropy import CodedSequence
from maps import dot, octahedral
from surface import Faces

class Corners(Faces):
    """The edges across of corners (13.2)."""

    def __init__(self, faces):
        super().__init__(faces)
        self.across, waiting = [None] * len(self.point), {}
        for c, (a, n) in enumerate(zip(self.point, self.next)):
            there = waiting.setdefault(self.point[n], [])
            o = next((o for o in there[:-65:-1] if self.point[self.next[o]] == a), None)
            if o is None:
                waiting.setdefault(a, []).append(c)
            else:
                there.remove(o)
                self.across[c], self.across[o] = o, c

def element_references(corners, element, count):
    """The references of points or of joined corners, and valences; `element` by corner."""
    own = [[] for _ in range(count)]
    for c, e in enumerate(element):
        own[e].append(c)
    return [references_of(corners, element, e, own[e]) for e in range(count)], [len(cs) % 256 for cs in own]

def references_of(corners, element, e, own):
    nxt, prv, across = corners.next, corners.previous, corners.across

    def known(*cs): return all(element[c] < e for c in cs)

    found = []  # (a, b, x, place)
    for n, p, size in ((nxt[c], prv[c], corners.size(c)) for c in own):
        o, i, j = across[n], element[n], element[p]
        if known(n, p) and size > 3 and known(nxt[n]):
            found.append((i, j, element[nxt[n]], 11))
        elif known(n, p) and size == 3 and o is not None and (element[o], element[nxt[o]]) == (j, i) and known(prv[o]):
            found.append((i, j, element[prv[o]], 10))
    for n, p in ((nxt[c], prv[c]) for c in own if corners.size(c) > 3 and known(nxt[c]) != known(prv[c])):
        o = across[n] if known(n, nxt[n]) else across[prv[p]] if known(p, prv[p]) else None
        if o is not None:
            i, shared, x = (element[n], nxt[o], nxt[nxt[o]]) if known(n) else (element[p], o, prv[o])
            found += [(i, i, element[x], 12)] if element[shared] == i and known(x) else []
    if found:
        return by_parallelograms(found[:3])
    pairs = [(element[nxt[c]], element[prv[c]]) for c in own]
    for i, j in pairs:
        if max(i, j) < e:
            return Element(min(i, j), max(i, j), place=1, swapped=j < i)
    return Element(next((r for pair in pairs for r in pair if r < e), max(e - 1, 0)))

def by_parallelograms(found):
    a, b, before, place = found[0]
    focus, last, next_, beyond = min(a, b), max(a, b), None, None
    late = found[1] if len(found) > 1 else None
    for k in (1, 2) if len(found) == 3 else ():
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
        alone = Element(beside[0] if beside else max(f - 1, 0))
        made.append(Element(beside[1], beside[0], None, beside[-1], beside[-1], place=1) if beside[1:] else alone)
    return made

class Joined:
    """Corners that are one element (13.2): `element` by corner."""

    def __init__(self, section, patch, twins):
        corners, q = patch.corners, CodedSequence(section)
        self.group, joints = [[c] for c in range(len(corners.point))], self.joints(corners, twins)
        left, cut, apart = Counter(p for _, _, _, p, _ in joints), Counter(), Counter()
        many = {p for p in left if left[p] > 254}
        for p, element in enumerate(patch.references[0]):
            if left[p]:
                cut[p] = q.bit("cut", *(cut[element.refs[r]] for r in (LAST, FOCUS, BEFORE)))
        before, last_edge = 0, None
        for c, o, edge, p, far in joints:
            before, last_edge = 0 if edge != last_edge else before, edge
            left[p] -= p not in many
            joined = q.bit("joined", before, cut[far], min(2, apart[p]), min(3, left[p])) if cut[p] else 1
            apart[p] += not joined
            if joined:
                self.join(c, o)
            before = 1 + joined
        first, number = {}, {}
        for c, twin in enumerate(twins or []):
            self.join(first.setdefault(twin, c), c)
        self.element = [number.setdefault(id(group), len(number)) for group in self.group]
        self.count = len(number)

    @staticmethod
    def joints(corners, twins):
        """(corner, corner on the other side, edge, their point, the other end)"""
        found, nxt = [], corners.next
        for c, o in enumerate(corners.across):
            for x, y, far in ((c, nxt[o], nxt[c]), (nxt[c], o, c)) if o is not None and c < o else ():
                if twins is None or twins[x] != twins[y]:
                    found.append((x, y, c, corners.point[x], corners.point[far]))
        return found

    def join(self, a, b):
        a, b = sorted((self.group[a], self.group[b]), key=len)
        for c in a if a is not b else ():
            self.group[c] = b
            b.append(c)

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
            late = element.late * [((LATE0, LATE1, LATE2), -1 if element.swapped else 1)]
            for abx, s in [((FOCUS, LAST, BEFORE), 1)] + element.closing * [((FOCUS, NEXT, BEYOND), -1)] + late:
                self.add(e, element.refs, abx, 1 / element.parallelograms, s)
        w = self.w.astype("f4")
        last = last_of_wide(w[:LAST]) if wide else w[LAST]
        return [*w[:LAST], last], self.turned[[FOCUS, NEXT, LATE0, LATE1]].astype("f4") if self.m else None

    @staticmethod
    def along(A, B, T):
        """Where T is along A to B, and its square distance from there, both measured by that of A and B."""
        d = dot(B - A, B - A)
        along = dot(T - A, B - A) / d
        t = (T - A) - (B - A) * along
        return along, dot(t, t), d

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
            beyond = np.sqrt(dot(T - A, T - A) / dot(X - A, X - A))
            beyond = beyond if beyond < 4 else 1
            self.w[a] += (1 + beyond) * share
            self.w[x] += -beyond * share
            return
        (along, t, d), (xalong, away, _) = self.along(A, B, T), self.along(A, B, X)
        off, beyond = np.sqrt(t / d), np.sqrt(t / away)
        if not (abs(along - 0.5) < 4 and off < 4 and beyond < 4 and abs(xalong - 0.5) < 4):
            weights, turn = (1, 1, -1), 0
        else:
            l, turn = (1 - self.m) * beyond, share * self.m * off * s
            weights = 1 - along + l * (1 - xalong), along + l * xalong, -l
        for place, w in zip(abx, weights):
            self.w[place] += w * share
        self.turned[a] += -turn
        self.turned[b] += turn

def around(fields, array, patch):
    """Coding 17."""
    unit, domain, of_tuple = fields.u8(), array.domain, slice(None)
    elements, valence, count, places = [], [], array.tuples, None
    if domain in (CORNERS, TWINS):
        joined = Joined(fields.section(), patch, patch.twins if domain == TWINS else None)
        elements, valence = element_references(patch.corners, joined.element, joined.count)
        count = joined.count + sum(len(nodes) for _, nodes in patch.loose)
        of_tuple = joined.element + list(range(joined.count, count))
        point = dict(zip(reversed(joined.element), reversed(patch.corners.point)))  # that of the first corner
        places = [patch.numbers[point[e]] for e in range(joined.count)]
    elif domain == POINTS:
        elements, valence = patch.references
        count, places = patch.points, patch.numbers
    elif domain == CELLS:
        elements = face_references(patch.corners, len(patch.fans.faces))
        count = len(elements) + len(patch.loose)
    elements, valence = with_rest(elements, count), valence + [0] * (count - len(valence))

    def numbers(fields, type_, n):
        placement, header = fields.u8(), Header(fields, type_, n)
        placed, raw = Placement(places, placement) if placement else None, fields.section()
        return header, Numbers(header, elements, raw, fields.rest(), valence, placed).codes

    if unit:
        steps, replaced = fields.count(), exceptions(fields.section(), array.dtype)
        vectors = [octahedral(i, j, steps) for i, j in numbers(fields, 4, 2)[1]]
        made = np.array(vectors, "f8").reshape(-1, 3).astype(array.dtype)
        put_exceptions(made, replaced)
    else:
        groups, n = [], array.components
        for first in range(0, n, 4):
            header, codes = numbers(Fields(fields.section()) if n > 4 else fields, array.type, min(4, n - first))
            groups.append(header.stored(codes, array.dtype))
        made = np.concatenate(groups, 1)
    return made[of_tuple]

def decode(stream, array, patch):
    """The tuples of an array in coded order (13.1)."""
    fields = Fields(stream)
    coding = fields.u8()
    if coding == 17:
        return around(fields, array, patch)
    if coding == 9:
        return face_normals.FaceNormals(fields, array, patch).values
    if coding != 8:
        raise Unread(f"coding {coding}")
    values = normals.Normals(fields, array, patch).values
    if array.domain in (CORNERS, TWINS):  # tuples of half-edges go to their corners
        values[patch.surface.corner_of] = values[: patch.surface.real].copy()
    return values
