"""Sections 11.2 and 12.4 of docs/format.md: half-edges of decoded faces."""

from container import require


class Surface:
    """Half-edges: those of faces, then those of border triangles. `corner_of` is the mesh's corner of a half-edge."""

    def __init__(self, faces, points):
        for face in faces:
            require(len(set(face)) == len(face), "a face has a point twice")
        self.begin, at = [], 0
        for face in faces:
            self.begin.append(at)
            at += len(face)
        self.faces, self.real = [list(face) for face in faces], at
        self.face = [f for f, face in enumerate(faces) for _ in face]
        self.flipped = [False] * len(faces)
        self.opposite = self.glue_all() or self.glue_by_walk()
        self.turn_over()
        self.set_neighbours()
        self.close_borders()
        self.number_vertices(points)

    # --- gluing

    def edges(self):
        made = {}
        for f, face in enumerate(self.faces):
            for k, p in enumerate(face):
                q = face[(k + 1) % len(face)]
                made.setdefault((min(p, q), max(p, q)), []).append((self.begin[f] + k, p < q))
        return made

    def glue_all(self):
        opposite = [None] * self.real
        for sides in self.edges().values():
            if len(sides) == 1:
                continue
            if len(sides) > 2 or sides[0][1] == sides[1][1]:
                return None
            (h, _), (o, _) = sides
            opposite[h], opposite[o] = o, h
        return opposite

    def glue_by_walk(self):
        opposite, edges = [None] * self.real, {}
        for sides in self.edges().values():
            for h, up in sides:
                edges[h] = up, sides
        reached = {}  # when each face was
        for first in range(len(self.faces)):
            if first in reached:
                continue
            reached[first] = len(reached)
            queue = [(first, 0)]
            for f, start in queue:
                n = len(self.faces[f])
                for k in range(n):
                    h = self.begin[f] + (start + (-k if self.flipped[f] else k)) % n
                    if opposite[h] is not None:
                        continue
                    up, sides = edges[h]
                    up ^= self.flipped[f]
                    free = [(o, u) for o, u in sides if opposite[o] is None and self.face[o] != f]
                    known = [o for o, u in free if self.face[o] in reached and (u ^ self.flipped[self.face[o]]) != up]
                    if known:
                        o = min(known, key=lambda o: reached[self.face[o]])
                    else:
                        new = [(u == up, o) for o, u in free if self.face[o] not in reached]
                        if not new:
                            continue
                        flip, o = min(new)
                        g = self.face[o]
                        self.flipped[g] = flip
                        reached[g] = len(reached)
                        queue.append((g, o - self.begin[g]))
                    opposite[h], opposite[o] = o, h
        return opposite

    def turn_over(self):
        """Flipped faces have all corners but the first the other way round, and their half-edges stand there."""
        place = list(range(self.real))  # where the half-edge on an edge is afterwards
        self.corner_of = list(range(self.real))
        for f, face in enumerate(self.faces):
            if self.flipped[f]:
                n, b = len(face), self.begin[f]
                self.faces[f] = [face[0]] + face[:0:-1]
                for k in range(n):
                    self.corner_of[b + k] = b + (n - k) % n
                    place[b + (n - k - 1) % n] = b + k
        opposite = [None] * self.real
        for h, o in enumerate(self.opposite):
            opposite[place[h]] = None if o is None else place[o]
        self.opposite = opposite

    def set_neighbours(self):
        self.next, self.previous, self.point = [], [], []
        for b, face in zip(self.begin, self.faces):
            n = len(face)
            self.next += [b + (k + 1) % n for k in range(n)]
            self.previous += [b + (k - 1) % n for k in range(n)]
            self.point += face

    def close_borders(self):
        """Triangles (end, begin, dummy) for the half-edges of each loop."""
        done = set()
        for first in range(self.real):
            if self.opposite[first] is not None or first in done:
                continue
            loop, h = [], first
            while h not in done:
                done.add(h)
                loop.append(h)
                h = self.next[h]
                while self.opposite[h] is not None:
                    h = self.next[self.opposite[h]]
            at = len(self.next)
            for k, b in enumerate(loop):
                t = at + 3 * k
                self.next += [t + 1, t + 2, t]
                self.previous += [t + 2, t, t + 1]
                self.point += [self.point[self.next[b]], self.point[b], None]
                # end to begin lies on b; begin to dummy on dummy to end of the triangle before
                self.opposite += [b, at + 3 * ((k - 1) % len(loop)) + 2, at + 3 * ((k + 1) % len(loop)) + 1]
                self.face += [len(self.faces)] * 3
            for k, b in enumerate(loop):
                self.opposite[b] = at + 3 * k

    def number_vertices(self, points):
        fans, seen = [], [False] * len(self.next)
        for h in range(self.real):
            if not seen[h]:
                fans.append((self.point[h], h))
                for g in self.turn_around(h):
                    seen[g] = True
        self.corner, self.origin = [], [None] * len(self.next)
        self.vertices_of = [[] for _ in range(points)]
        for V, (p, h) in enumerate(sorted(fans)):
            self.corner.append(h)
            self.vertices_of[p].append(V)
            for g in self.turn_around(h):
                self.origin[g] = V

    def turn(self, h):
        return self.opposite[self.previous[h]]

    def turn_around(self, h):
        g = h
        while True:
            yield g
            g = self.turn(g)
            if g == h:
                return

    def around(self, V):
        return list(self.turn_around(self.corner[V]))

    def ring(self, V):
        return [h for h in self.around(V) if h < self.real]

    def corners(self, f):
        """Half-edges of a face, from the one at the vertex with the lowest number on."""
        b, n = self.begin[f], len(self.faces[f])
        first = min(range(n), key=lambda k: self.origin[b + k])
        return [b + (first + k) % n for k in range(n)]

    def size(self, h):
        return len(self.faces[self.face[h]]) if h < self.real else 3
