"""Sections 11.2 and 12.4 of docs/format.md: half-edges of decoded faces."""

from itertools import accumulate

from container import require


class Surface:
    """Half-edges: those of faces, then those of border triangles. `corner_of` is the mesh's corner of a half-edge."""

    def __init__(self, faces, points):
        require(all(len(set(face)) == len(face) for face in faces), "a face has a point twice")
        self.begin = list(accumulate(map(len, faces), initial=0))
        self.faces, self.real = [list(face) for face in faces], self.begin.pop()
        self.face = [f for f, face in enumerate(faces) for _ in face]
        self.flipped = [False] * len(faces)
        edges = {}  # half-edges with an edge, each with its direction
        for f, face in enumerate(faces):
            for k, p in enumerate(face):
                q = face[(k + 1) % len(face)]
                edges.setdefault((min(p, q), max(p, q)), []).append((self.begin[f] + k, p < q))
        self.opposite = [None] * self.real
        if all(len(sides) == 1 or len(sides) == 2 and sides[0][1] != sides[1][1] for sides in edges.values()):
            for (h, _), (o, _) in (sides for sides in edges.values() if len(sides) == 2):
                self.opposite[h], self.opposite[o] = o, h
        else:
            self.glue_by_walk({h: (up, sides) for sides in edges.values() for h, up in sides})
        self.turn_over()
        self.next = [b + (k + 1) % len(face) for b, face in zip(self.begin, self.faces) for k in range(len(face))]
        self.previous = [b + (k - 1) % len(face) for b, face in zip(self.begin, self.faces) for k in range(len(face))]
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
                    free = [(o, u) for o, u in sides if opposite[o] is None and face[o] != f]
                    known = [(reached[face[o]], o) for o, u in free if face[o] in reached and (u ^ flipped[face[o]]) != up]
                    new = [(u == up, o) for o, u in free if face[o] not in reached]
                    if not known and not new:
                        continue
                    flip, o = min(known or new)
                    if not known:
                        flipped[face[o]], reached[face[o]] = flip, len(reached)
                        queue.append((face[o], o - self.begin[face[o]]))
                    opposite[h], opposite[o] = o, h

    def turn_over(self):
        """Flipped faces have all corners but the first the other way round, and their half-edges stand there."""
        place = list(range(self.real))  # where the half-edge on an edge is afterwards
        self.corner_of = list(range(self.real))
        for f, face in enumerate(self.faces):
            if self.flipped[f]:
                n, b = len(face), self.begin[f]
                self.faces[f] = [face[0]] + face[:0:-1]
                self.corner_of[b : b + n] = [b, *range(b + n - 1, b, -1)]
                place[b : b + n] = range(b + n - 1, b - 1, -1)
        opposite = [None] * self.real
        for h, o in enumerate(self.opposite):
            opposite[place[h]] = None if o is None else place[o]
        self.opposite = opposite

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
        self.corner, self.origin = [h for _, h in sorted(fans)], [None] * len(self.next)
        self.vertices_of = [[] for _ in range(points)]
        for V, h in enumerate(self.corner):
            self.vertices_of[self.point[h]].append(V)
            for g in self.turn_around(h):
                self.origin[g] = V

    def turn(self, h):
        return self.opposite[self.previous[h]]

    def turn_around(self, h):
        around = [h]
        while self.turn(around[-1]) != h:
            around.append(self.turn(around[-1]))
        return around

    def around(self, V):
        return self.turn_around(self.corner[V])

    def ring(self, V):
        return [h for h in self.around(V) if h < self.real]

    def corners(self, f):
        """Half-edges of a face, from the one at the vertex with the lowest number on."""
        b, n = self.begin[f], len(self.faces[f])
        first = min(range(n), key=lambda k: self.origin[b + k])
        return [b + (first + k) % n for k in range(n)]

    def size(self, h):
        return len(self.faces[self.face[h]]) if h < self.real else 3
