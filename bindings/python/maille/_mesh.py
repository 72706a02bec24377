"""Meshes in memory."""

from __future__ import annotations

import types
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Optional, Union

import numpy as np

from . import _core
from ._arrays import MOST_POINTS, NDArray, integers, positions, triple, tuples

_names: dict[int, str] = {}
_numbers: dict[str, int] = {}
_nodes: dict[int, int] = {}
_dimensions: dict[int, int] = {}
for _name, _number, _node_count, _dimension in _core.cell_types():
    _names[_number], _numbers[_name] = _name, _number
    _nodes[_number], _dimensions[_number] = _node_count, _dimension

# What meshio calls them.
MESHIO_NAMES = {
    "tetra": "tetrahedron", "line3": "quadratic_edge", "line4": "cubic_line", "triangle6": "quadratic_triangle",
    "triangle7": "biquadratic_triangle", "quad8": "quadratic_quad", "quad9": "biquadratic_quad",
    "tetra10": "quadratic_tetrahedron", "hexahedron20": "quadratic_hexahedron",
    "hexahedron24": "biquadratic_quadratic_hexahedron", "hexahedron27": "triquadratic_hexahedron",
    "wedge15": "quadratic_wedge", "wedge18": "biquadratic_quadratic_wedge", "pyramid13": "quadratic_pyramid",
}
_numbers.update({theirs: _numbers[ours] for theirs, ours in MESHIO_NAMES.items()})
CELL_TYPES = {name: _numbers[name] for name in _names.values()}
"""Names of cell types and VTK's numbers of them."""

POLYHEDRON = _numbers["polyhedron"]


def type_number(given: Union[str, int]) -> int:
    """VTK's number of a cell type, by its name here, in VTK or in meshio."""
    if isinstance(given, str):
        name = given.lower()
        name = name[4:] if name.startswith("vtk_") else name
        if name in _numbers:
            return _numbers[name]
        raise ValueError(f"cells: there is no type '{given}'; there are: {', '.join(_names.values())}")
    number = int(given)
    if number not in _names:
        raise ValueError(f"cells: there is no type {number}; VTK's numbers are meant")
    return number


@dataclass(frozen=True, eq=False)
class Block:
    """A run of cells of one type, or, of type "mixed", of any.

    ``connectivity`` has the numbers of points: (n, k) of types whose cells have k points, as "triangle" or
    "hexahedron"; else (corners,), and ``offsets`` has the n + 1 places in it where cells begin, first 0.
    ``types`` (n,) are VTK's numbers where the block is mixed. Polyhedra have their faces one after the other
    in ``connectivity``; ``face_sizes`` has the corners of each face, and ``cell_faces`` the n + 1 places in it
    where cells begin. Order of nodes: VTK's. All are read-only where the library made them.
    """

    type: str
    connectivity: NDArray
    offsets: Optional[NDArray] = None
    types: Optional[NDArray] = None
    face_sizes: Optional[NDArray] = None
    cell_faces: Optional[NDArray] = None
    name: str = ""

    def __len__(self) -> int:
        """The number of cells."""
        if _nodes[type_number(self.type)]:
            return len(self.connectivity)
        return max(len(self.offsets) - 1, 0) if self.offsets is not None else 0

    @property
    def dimension(self) -> int:
        """0 of points, 1 of lines, 2 of faces, 3 of solids, -1 of mixed blocks."""
        return _dimensions[type_number(self.type)]

    def cell(self, i: int) -> NDArray:
        """Numbers of the points of one cell; of a polyhedron those of its faces, one after the other."""
        if self.offsets is None:
            row: NDArray = self.connectivity[i]
            return row
        if not -len(self) <= i < len(self):
            raise IndexError(f"cell {i} of {len(self)}")
        i %= len(self)
        return self.connectivity[int(self.offsets[i]):int(self.offsets[i + 1])]

    def __repr__(self) -> str:
        name = f", name={self.name!r}" if self.name else ""
        return f"<maille.Block: {len(self)} x {self.type}{name}>"


@dataclass(frozen=True, eq=False)
class Array:
    """Values on the points, cells or corners of a mesh, or of the mesh as a whole.

    ``values``: (n,) or (n, components). ``role`` says what they mean, for formats that keep a place for it and
    for how they are rounded: "none", "normal", "colour", "texture_coordinate", "tangent" or "label"; of labels
    the value v stands for ``labels[v]``. ``name`` and ``domain`` ("point", "cell", "corner", "mesh") are set
    by the mesh.
    """

    values: NDArray
    role: str = "none"
    labels: Sequence[str] = ()
    name: str = ""
    domain: str = "point"


Data = Mapping[str, Any]
"""Names, and arrays of numpy (or anything that numpy makes one of), or :class:`Array`."""


def _ragged(rows: Any, where: str) -> tuple[NDArray, NDArray]:
    """Lists of different lengths as values and offsets."""
    parts = [np.asarray(row) for row in rows]
    offsets = np.zeros(len(parts) + 1, np.uint64)
    np.cumsum([len(part) for part in parts], out=offsets[1:])
    values = np.concatenate(parts) if parts else np.zeros(0, np.uint32)
    return integers(values, where, MOST_POINTS, "u4"), offsets


def _polyhedra(cells: Any, name: str) -> Block:
    """Of a list of cells, each a list of faces, each a list of points."""
    sizes = [len(face) for cell in cells for face in cell]
    points = [int(point) for cell in cells for face in cell for point in face]
    cell_faces = np.cumsum([0] + [len(cell) for cell in cells])
    offsets = np.cumsum([0] + [sum(len(face) for face in cell) for cell in cells])
    return Block("polyhedron", np.array(points, np.int64), offsets, None, np.array(sizes, np.int64), cell_faces,
                 name)


def _block(kind: Union[str, int], cells: Any, name: str) -> Block:
    number = type_number(kind)
    where = f"cells ({_names[number]})"
    nodes = _nodes[number]
    if nodes:
        rows = np.asarray(cells)
        if rows.size == 0:
            rows = np.zeros((0, nodes), np.uint32)
        if rows.ndim != 2 or rows.shape[1] != nodes:
            raise ValueError(f"{where}: an array of shape (n, {nodes}) is wanted, not {rows.shape}")
        return Block(_names[number], rows, name=name)
    if number == POLYHEDRON:
        return _polyhedra(cells, name)
    if _names[number] == "mixed":
        raise ValueError("cells: a mixed block is given as maille.Block, with types and offsets")
    if hasattr(cells, "ndim") and cells.ndim == 2:
        offsets = np.arange(len(cells) + 1, dtype=np.uint64) * np.uint64(cells.shape[1])
        return Block(_names[number], cells.reshape(-1), offsets, name=name)
    values, offsets = _ragged(cells, where)
    return Block(_names[number], values, offsets, name=name)


def _blocks(cells: Any) -> list[Block]:
    """Of all the ways in which cells may be given."""
    if isinstance(cells, Block):
        return [cells]
    if isinstance(cells, Mapping):
        return [_block(kind, each, "") for kind, each in cells.items()]
    if hasattr(cells, "ndim"):
        if cells.size == 0:
            return []
        if cells.ndim == 2 and cells.shape[1] == 3:
            return [_block("triangle", cells, "")]
        advice = " (quads or tetrahedra? say which)" if cells.ndim == 2 and cells.shape[1] == 4 else ""
        raise ValueError(f"cells: an array alone are triangles, of shape (n, 3), not {cells.shape}; give "
                         f"{{'quad': array}} and the like for other cells{advice}")
    blocks = []
    for each in cells:
        if isinstance(each, Block):
            blocks.append(each)
        elif hasattr(each, "type") and hasattr(each, "data"):  # as meshio has them
            blocks.append(_block(each.type, each.data, ""))
        elif isinstance(each, (tuple, list)) and len(each) in (2, 3) and isinstance(each[0], (str, int)) \
                and not isinstance(each[1], int):
            blocks.append(_block(each[0], each[1], each[2] if len(each) == 3 else ""))
        else:
            raise TypeError("cells: pairs of a type and an array are wanted, as [('triangle', array)], a "
                            "mapping {'triangle': array}, or maille.Block")
    return blocks


def _block_tuple(block: Block) -> tuple[Any, ...]:
    """As maille._core takes it."""
    number = type_number(block.type)
    where = f"cells ({block.type})"

    def some(values: Any, what: str, most: int, dtype: str) -> Optional[NDArray]:
        return None if values is None else integers(values, f"{where}, {what}", most, dtype).reshape(-1)

    connectivity = integers(block.connectivity, where, MOST_POINTS, "u4")
    nodes = _nodes[number]
    if nodes and (connectivity.ndim != 2 or connectivity.shape[1] != nodes):
        raise ValueError(f"{where}: an array of shape (n, {nodes}) is wanted, not {connectivity.shape}")
    return (block.name, number, some(block.types, "types", 254, "u1"),
            some(block.offsets, "offsets", 2**63 - 1, "u8"), connectivity.reshape(-1),
            some(block.face_sizes, "face_sizes", 2**32 - 1, "u4"),
            some(block.cell_faces, "cell_faces", 2**63 - 1, "u8"))


def _array_tuples(data: Optional[Data], argument: str, domain: str, count: Optional[int]) -> list[tuple[Any, ...]]:
    """As maille._core takes them."""
    arrays: list[tuple[Any, ...]] = []
    if data is not None and not isinstance(data, Mapping):
        raise TypeError(f"{argument}: a mapping of names and arrays is wanted, not {type(data).__name__}")
    for name, given in (data or {}).items():
        if not isinstance(name, str):
            raise TypeError(f"{argument}: names are strings, not {name!r}")
        array = given if isinstance(given, Array) else Array(given)
        values = tuples(array.values, f"{argument}[{name!r}]", count, domain)
        arrays.append((name, domain, array.role, [str(label) for label in array.labels], values))
    return arrays


class Mesh:
    """Points, cells, and values on them. It does not change once it is made.

    :param points: (n, 3), of any type from int8 to float64; lists become float64.
    :param cells: ``{"triangle": (n, 3), "tetra": (m, 4)}``, or pairs ``[("triangle", array), ...]``; an array
        (n, 3) alone are triangles. Types are called as here (:data:`maille.CELL_TYPES`), in meshio or in VTK,
        or VTK's numbers. Polygons and other cells of different sizes: lists of lists; polyhedra: lists of
        faces. ``maille.Block`` gives all that a block can have, a name too.
    :param point_data: names and arrays, (points,) or (points, components).
    :param cell_data: the same for the cells, block after block.
    :param corner_data: for the entries of the connectivity, block after block.
    :param field_data: for the mesh as a whole, of any length.
    :param metadata: pairs of strings, or a mapping: comments, units.
    :raises TypeError, ValueError: what is not as it must be is named, with what is wanted.

    Arrays that have the right type and are contiguous are not copied: leave them alone while the mesh is in
    use. Others are. What a mesh gives are read-only views, which keep what they show alive.

    >>> import maille
    >>> mesh = maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], {"triangle": [[0, 1, 2]]},
    ...                    point_data={"T": [20.0, 21.0, 22.5]})
    >>> mesh
    <maille.Mesh: 3 points, 1 cells (1 x triangle); point_data: T>
    >>> mesh.point_data["T"].max()
    22.5
    """

    __slots__ = ("_core", "_seen", "cell_numbers", "point_numbers", "__weakref__")

    cell_numbers: Optional[NDArray]
    """Of a part of a volume (:meth:`File.extract`) whose file kept the order: the number of each cell in the
    whole. None for other meshes."""
    point_numbers: Optional[NDArray]
    """The same for points."""

    def __init__(self, points: Any, cells: Any = (), *, point_data: Optional[Data] = None,
                 cell_data: Optional[Data] = None, corner_data: Optional[Data] = None,
                 field_data: Optional[Data] = None,
                 metadata: Union[Mapping[str, str], Iterable[tuple[str, str]]] = ()) -> None:
        where = positions(points)
        blocks = [_block_tuple(block) for block in _blocks(cells)]
        corners = sum(len(block[4]) for block in blocks)
        counted = sum(len(block[4]) // _nodes[block[1]] if _nodes[block[1]] else
                      max(0 if block[3] is None else len(block[3]) - 1, 0) for block in blocks)
        arrays = (_array_tuples(point_data, "point_data", "point", len(where)) +
                  _array_tuples(cell_data, "cell_data", "cell", counted) +
                  _array_tuples(corner_data, "corner_data", "corner", corners) +
                  _array_tuples(field_data, "field_data", "mesh", None))
        pairs = metadata.items() if isinstance(metadata, Mapping) else metadata
        self._set(_core.Mesh(where, blocks, arrays, [(str(key), str(value)) for key, value in pairs]))

    def _set(self, core: _core.Mesh) -> None:
        self._core = core
        self._seen: dict[str, Any] = {}
        self.cell_numbers = self.point_numbers = None

    @classmethod
    def _of(cls, core: _core.Mesh) -> Mesh:
        mesh = cls.__new__(cls)
        mesh._set(core)
        return mesh

    @property
    def points(self) -> NDArray:
        """Positions, (n, 3)."""
        if "points" not in self._seen:
            self._seen["points"] = self._core.points
        points: NDArray = self._seen["points"]
        return points

    @property
    def cells(self) -> tuple[Block, ...]:
        """The blocks of cells."""
        if "cells" not in self._seen:
            self._seen["cells"] = tuple(
                Block(_names[number], connectivity, offsets, kinds, face_sizes, cell_faces, name)
                for name, number, kinds, offsets, connectivity, face_sizes, cell_faces in self._core.blocks)
        cells: tuple[Block, ...] = self._seen["cells"]
        return cells

    @property
    def arrays(self) -> tuple[Array, ...]:
        """All arrays but the positions, with what is known of them."""
        if "arrays" not in self._seen:
            self._seen["arrays"] = tuple(Array(values, role, tuple(labels), name, domain)
                                         for name, domain, role, labels, values in self._core.arrays)
        arrays: tuple[Array, ...] = self._seen["arrays"]
        return arrays

    def _data(self, domain: str) -> Mapping[str, NDArray]:
        if domain not in self._seen:
            self._seen[domain] = types.MappingProxyType(
                {array.name: array.values for array in self.arrays if array.domain == domain})
        data: Mapping[str, NDArray] = self._seen[domain]
        return data

    @property
    def point_data(self) -> Mapping[str, NDArray]:
        """Values on points, by name: (points,) or (points, components)."""
        return self._data("point")

    @property
    def cell_data(self) -> Mapping[str, NDArray]:
        """Values on cells, by name, block after block: (cells,) or (cells, components)."""
        return self._data("cell")

    @property
    def corner_data(self) -> Mapping[str, NDArray]:
        """Values on the entries of the connectivity, by name."""
        return self._data("corner")

    @property
    def field_data(self) -> Mapping[str, NDArray]:
        """Values of the mesh as a whole, by name."""
        return self._data("mesh")

    @property
    def metadata(self) -> list[tuple[str, str]]:
        """Pairs of strings in the order of the file: comments, units."""
        return self._core.metadata

    @property
    def point_count(self) -> int:
        """Number of points."""
        return self._core.point_count

    @property
    def cell_count(self) -> int:
        """Number of cells, of all blocks."""
        return self._core.cell_count

    @property
    def bounds(self) -> tuple[NDArray, NDArray]:
        """Lowest and highest corner of the box around all points; NaN where there is none."""
        if self.point_count == 0:
            return np.full(3, np.nan), np.full(3, np.nan)
        return np.nanmin(self.points, axis=0), np.nanmax(self.points, axis=0)

    def _surface(self) -> tuple[NDArray, NDArray]:
        if "surface" not in self._seen:
            self._seen["surface"] = self._core.surface()
        surface: tuple[NDArray, NDArray] = self._seen["surface"]
        return surface

    def triangles(self) -> NDArray:
        """The surface as triangles, (n, 3) numbers of points: faces, polygons as fans, and of solids the faces
        that no other solid has. Of curved cells the corners.

        >>> import maille
        >>> maille.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], {"quad": [[0, 1, 2, 3]]}).triangles().tolist()
        [[0, 1, 2], [0, 2, 3]]
        """
        return self._surface()[0]

    def triangle_cells(self) -> NDArray:
        """Of each of :meth:`triangles` the cell that it is of, (n,): ``mesh.cell_data["p"][mesh.triangle_cells()]``
        are the values of triangles."""
        return self._surface()[1]

    def slice(self, origin: Any, normal: Any) -> Mesh:
        """What a plane cuts out of the solids, as polygons, with the arrays of points and cells."""
        unit = np.asarray(triple(normal, "normal"))
        length = float(np.linalg.norm(unit))
        if not np.isfinite(length) or length == 0:
            raise ValueError("normal: a direction is wanted, and this has no length")
        unit = unit / length
        return Mesh._of(self._core.slice(triple(unit, "normal"), -float(unit @ triple(origin, "origin"))))

    def probe(self, places: Any) -> tuple[NDArray, dict[str, NDArray]]:
        """Values at places, (n, 3): by place the cell that has it, -1 for none; and by name values of point
        arrays, interpolated, and of cell arrays, (n,) or (n, components), NaN in no cell."""
        at = np.ascontiguousarray(np.asarray(places, dtype=float))
        if at.ndim != 2 or at.shape[1] != 3:
            raise ValueError(f"places: an array of shape (n, 3) is wanted, not {at.shape}")
        found = self._core.probe(at)
        cells = np.array([cell if inside else -1 for inside, cell, _ in found], np.int64)
        values: dict[str, NDArray] = {}
        for i, (_, _, here) in enumerate(found):
            for name, _, components in here:
                if name not in values:
                    shape = (len(at),) if len(components) == 1 else (len(at), len(components))
                    values[name] = np.full(shape, np.nan)
                values[name][i] = components if len(components) > 1 else components[0]
        return cells, values

    def differences(self, other: Mesh, *, same_order: bool = False) -> list[str]:
        """What is different in another mesh, a sentence each, bit for bit; none: they are equal. Up to the order
        of points, cells and corners, if it is not to be the same.

        >>> import maille
        >>> a = maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], {"triangle": [[0, 1, 2]]})
        >>> b = maille.Mesh([[0, 1, 0], [0, 0, 0], [1, 0, 0]], {"triangle": [[0, 1, 2]]})
        >>> a.differences(b)
        []
        >>> len(a.differences(b, same_order=True)) > 0
        True
        """
        return self._core.differences(other._core, same_order)

    def with_arrays(self, arrays: Iterable[Array]) -> Mesh:
        """The same points and cells with other arrays, each with its name and domain."""
        counts = {"point": self.point_count, "cell": self.cell_count, "mesh": None,
                  "corner": sum(block.connectivity.size for block in self.cells)}
        wanted: list[tuple[Any, ...]] = []
        for each in arrays:
            if each.domain not in counts:
                raise ValueError(f"'{each.name}': an array is on {', '.join(counts)}, not on '{each.domain}'")
            values = tuples(each.values, f"'{each.name}'", counts[each.domain], each.domain)
            wanted.append((each.name, each.domain, each.role, list(each.labels), values))
        return Mesh._of(_core.Mesh(self.points, self._flat_blocks(), wanted, self.metadata))

    def _flat_blocks(self) -> list[tuple[Any, ...]]:
        return [(block.name, type_number(block.type), block.types, block.offsets, block.connectivity.reshape(-1),
                 block.face_sizes, block.cell_faces) for block in self.cells]

    def __repr__(self) -> str:
        kinds = ", ".join(f"{len(block)} x {block.type}" for block in self.cells[:4])
        kinds += ", ..." if len(self.cells) > 4 else ""
        text = f"<maille.Mesh: {self.point_count} points, {self.cell_count} cells"
        text += f" ({kinds})" if kinds else ""
        for what in ("point_data", "cell_data", "corner_data", "field_data"):
            if getattr(self, what):
                text += f"; {what}: {', '.join(getattr(self, what))}"
        return text + ">"

    def __reduce_ex__(self, protocol: Any) -> tuple[Any, ...]:
        # Arrays pickle themselves, from protocol 5 on without a copy for those who can.
        arrays: list[tuple[Any, ...]] = [(each.name, each.domain, each.role, list(each.labels), each.values)
                                         for each in self.arrays]
        return _unpickled, (self.points, self._flat_blocks(), arrays, self.metadata, self.cell_numbers,
                            self.point_numbers)


def _unpickled(points: NDArray, blocks: list[Any], arrays: list[Any], metadata: list[tuple[str, str]],
               cell_numbers: Optional[NDArray], point_numbers: Optional[NDArray]) -> Mesh:
    mesh = Mesh._of(_core.Mesh(points, blocks, arrays, metadata))
    mesh.cell_numbers, mesh.point_numbers = cell_numbers, point_numbers
    return mesh
