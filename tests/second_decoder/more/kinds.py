"""Sections 16.2 and 16.6 of docs/format.md: all kinds of cells of mode stream but those given by faces."""
from cells import HEXAHEDRON, SHAPES, TETRAHEDRON, Cells, Shape, along, turned

PYRAMID, WEDGE, QUAD, TRIANGLE = "0321 014 124 234 304", "012 354 0341 1452 2530", "01 12 23 30", "01 12 20"
EDGES = "01 12 23 30 45 56 67 74 04 15 26 37"
ALL = [SHAPES[0], SHAPES[1], Shape(13, 3, WEDGE), Shape(14, 3, PYRAMID), Shape(9, 2, QUAD), Shape(5, 2, TRIANGLE)]
ALL += [Shape(3, 1, "0 1"), Shape(1, 0, ""), Shape(11, 3, HEXAHEDRON, order=[0, 1, 3, 2, 4, 5, 7, 6])]
ALL += [Shape(8, 2, QUAD, order=[0, 1, 3, 2]), Shape(21, 1, "0 1", "01"), Shape(22, 2, TRIANGLE, TRIANGLE)]
ALL += [Shape(23, 2, QUAD, QUAD), Shape(24, 3, TETRAHEDRON, "01 12 20 03 13 23"), Shape(25, 3, HEXAHEDRON, EDGES)]
ALL += [Shape(26, 3, WEDGE, "01 12 20 34 45 53 03 14 25"), Shape(27, 3, PYRAMID, "01 12 23 30 04 14 24 34")]
ALL += [Shape(29, 3, HEXAHEDRON, f"{EDGES} {HEXAHEDRON} 01234567")]
SHAPES |= dict(enumerate(ALL))
LOOSE_CELL = 19

class AllCells(Cells):
    last_loose = 0

    def of_kind(self, kind):
        if kind == LOOSE_CELL:
            self.loose_cell()
        else:
            super().of_kind(kind)

    def loose_cell(self):
        type_, points = self.sequence.raw(8), []
        for _ in range(self.sequence.difference("Count")):
            new = self.ask(10, 131072, 0, 0)
            points.append(self.new_point(63) if new else self.old_point(self.last_loose))
            self.last_loose = points[-1].number
        self.made.append((type_, [p.number for p in points]))
        self.came.append((None, [], [], 31, None))
        for p in points:
            if self.ask(14, 2097152, 0, 0) and p.alive:
                self.end_point(p)

    def type_of(self, kind): return 7 if self.blocks[-1][0] == 7 and kind in (4, 5) else super().type_of(kind)
    def anchor(self, kind): return super().anchor(kind) if SHAPES[kind].dimension else None

    # --- nodes behind the corners

    def nodes_behind(self, cell, new):
        cell.nodes = [self.node(cell, i, on, any(k in new for k in on)) for i, on in self.nodes_of(cell)]

    @staticmethod
    def nodes_of(cell): return enumerate(cell.shape.nodes, cell.shape.corners)

    def node(self, cell, i, lies_on, some_new):
        on, candidate = [cell.corners[k] for k in lies_on], None
        for other in on[0].cells[:64] if not some_new else []:
            beside = [q for q, ks in zip(other.nodes, other.shape.nodes) if {other.corners[k] for k in ks} == set(on)]
            candidate = candidate or next((q for q in beside[::-1] if q.alive), None)
        local = bool(candidate) | len(lies_on) << 1 | cell.kind << 5
        if candidate and self.ask(15, local, i, 0):
            return candidate
        if self.ask(10, local + 65536, i, some_new):
            near, situation = [p.slot for p in on], 24 + (len(on) > 2) + (len(on) > 4)
            place = [[(slot, 1 / len(near)) for slot in near]], near[:3], situation, [p.number for p in on]
            return self.new_point(33 + i, place)
        return self.old_point(cell.corners[0].number)

    def points_that_end(self, cell, ends, new, before):
        ending, nodes = super().points_that_end(cell, ends, new, before), cell.corners + cell.nodes
        for i, lies_on in self.nodes_of(cell):
            local = i | all(nodes[k] in ending for k in lies_on) << 5 | cell.kind << 11 | 1 << 20
            if nodes[i] not in nodes[:i] and self.ask_end(i, local, new, before):
                ending.append(nodes[i])
        return ending

    # --- polygons on solids

    def edges(self, kind, known, glued, own, anchor):
        if SHAPES[kind].dimension == 3:
            super().edges(kind, known, glued, own, anchor)
        elif SHAPES[kind].dimension == 2:
            self.on_solid(SHAPES[kind], known, own, anchor)

    def on_solid(self, shape, known, own, anchor):
        """Polygons on an open face of a solid."""
        a, b = (known[k] for k in shape.faces[own])
        n, first, apart = shape.corners, shape.faces[own][0], set(anchor.corners)
        faces = [(cell, cell.points(f)) for cell in a.cells if cell.shape.dimension == 3 for f in cell.open_faces()]
        found = [face for face in faces if len(face[1]) == n and {a, b} <= set(face[1]) and not set(face[1]) <= apart]
        for i, (cell, points) in enumerate(found[:9]):
            if self.ask(13, min(i, 3), cell.signature, 0):
                for k, p in zip(turned(range(n), first, 1), along(points, a, b)):
                    known[k] = p
                return
