"""Sections 11.2 and 12.4 of docs/format.md: half-edges of decoded faces."""
from itertools import accumulate

class Faces:
    """Corners of faces, counted over all, and their half-edges."""

    def __init__(self, faces):
        self.faces, self.begin = [list(face) for face in faces], list(accumulate(map(len, faces), initial=0))
        self.point, self.real = [p for face in faces for p in face], self.begin[-1]
        self.face, sizes = [f for f, face in enumerate(faces) for _ in face], list(zip(self.begin, map(len, faces)))
        self.next, self.previous = ([b + (k + s) % n for b, n in sizes for k in range(n)] for s in (1, -1))

    def size(self, h): return len(self.faces[self.face[h]]) if h < self.real else 3

class Surface(Faces):
    """Those of faces, then those of border triangles. `corner_of` is the mesh's corner of a half-edge."""

    def __init__(self, faces, points):
        super().__init__(faces)
        self.flipped = [False] * len(faces)
        edges = {}  # half-edges with an edge, each with its direction
        for f, face in enumerate(faces):
            for k, (p, q) in enumerate(zip(face, face[1:] + face[:1])):
                edges.setdefault((min(p, q), max(p, q)), []).append((self.begin[f] + k, p < q))
        self.opposite = [None] * self.real
        self.glue_by_walk({h: (up, sides) for sides in edges.values() for h, up in sides})
        self.turn_over()
        self.point = [p for face in self.faces for p in face]
        self.close_borders()
        self.number_vertices(points)

    def glue_by_walk(self, edges):
        opposite, face, flipped, reached = self.opposite, self.face, self.flipped, {}  # reached: when each face was
        for first in range(len(self.faces)):
            queue = [] if first in reached else [(first, 0)]
            reached.setdefault(first, len(reached))
            for f, start in queue:
                n = len(self.faces[f])
                for k in range(n):
                    h = self.begin[f] + (start + (-k if flipped[f] else k)) % n
                    if opposite[h] is not None:
                        continue
                    up, sides = edges[h]
                    up ^= flipped[f]
                    free = [(o, face[o], u) for o, u in sides if opposite[o] is None and face[o] != f]
                    known = [(reached[g], o) for o, g, u in free if g in reached and u ^ flipped[g] != up]
                    new = [(u == up, o) for o, g, u in free if g not in reached]
                    if not known and not new:
                        continue
                    flip, o = min(known or new)
                    if not known:
                        flipped[face[o]], reached[face[o]] = flip, len(reached)
                        queue.append((face[o], o - self.begin[face[o]]))
                    opposite[h], opposite[o] = o, h

    def turn_over(self):
        """Flipped faces have all corners but the first the other way round, and their half-edges stand there."""
        self.corner_of, place = list(range(self.real)), list(range(self.real))
        for f in (f for f, flipped in enumerate(self.flipped) if flipped):
            face, b, n = self.faces[f], self.begin[f], len(self.faces[f])
            self.faces[f] = [face[0]] + face[:0:-1]
            self.corner_of[b : b + n] = [b, *range(b + n - 1, b, -1)]
            place[b : b + n] = range(b + n - 1, b - 1, -1)  # where the half-edge on an edge is afterwards
        before, self.opposite = self.opposite, [None] * self.real
        for h, o in enumerate(before):
            self.opposite[place[h]] = None if o is None else place[o]

    def close_borders(self):
        """Triangles (end, begin, dummy) for the half-edges of each loop."""
        for first in range(self.real):
            if self.opposite[first] is not None:
                continue
            loop, h = [], None
            while h != first:
                loop.append(first if h is None else h)
                h = self.next[loop[-1]]
                while self.opposite[h] is not None:
                    h = self.next[self.opposite[h]]
            at, n = len(self.next), len(loop)
            for k, b in enumerate(loop):
                t = at + 3 * k
                self.next += [t + 1, t + 2, t]
                self.previous += [t + 2, t, t + 1]
                self.point += [self.point[self.next[b]], self.point[b], None]
                # end to begin lies on b; begin to dummy on dummy to end of the triangle before
                self.opposite += [b, at + 3 * ((k - 1) % n) + 2, at + 3 * ((k + 1) % n) + 1]
                self.face += [len(self.faces)] * 3
            for k, b in enumerate(loop):
                self.opposite[b] = at + 3 * k

    def number_vertices(self, points):
        fans, seen = [], set()
        for h in range(self.real):
            if h not in seen:
                fans.append((self.point[h], h))
                seen.update(self.turn_around(h))
        self.origin, self.vertices_of = [None] * len(self.next), [[] for _ in range(points)]
        self.around = [self.turn_around(h) for _, h in sorted(fans)]  # by vertex
        for V, around in enumerate(self.around):
            self.vertices_of[self.point[around[0]]].append(V)
            for g in around:
                self.origin[g] = V

    def turn(self, h): return self.opposite[self.previous[h]]

    def turn_around(self, h):
        around = [h]
        while self.turn(around[-1]) != h:
            around.append(self.turn(around[-1]))
        return around

    def ring(self, V): return [h for h in self.around[V] if h < self.real]

    def corners(self, f):
        """Half-edges of a face, from the one at the vertex with the lowest number on."""
        b, n = self.begin[f], len(self.faces[f])
        first = min(range(n), key=lambda k: self.origin[b + k])
        return [b + (first + k) % n for k in range(n)]
