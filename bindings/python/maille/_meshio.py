"""Meshes of meshio."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from ._codec import read, write
from ._errors import MailleWarning
from ._mesh import _names, MESHIO_NAMES, Block, Mesh, type_number

_theirs = {ours: theirs for theirs, ours in MESHIO_NAMES.items()}


def _note(text: str) -> None:
    warnings.warn(text, MailleWarning, stacklevel=3)


def _polyhedra(block: Block, cells: Any) -> list[Any]:
    """As meshio has them: of each cell the faces, each an array of points."""
    assert block.offsets is not None and block.face_sizes is not None and block.cell_faces is not None
    found = []
    for i in cells:
        sizes = block.face_sizes[int(block.cell_faces[i]):int(block.cell_faces[i + 1])]
        corners = block.connectivity[int(block.offsets[i]):int(block.offsets[i + 1])]
        found.append(np.split(corners, np.cumsum(sizes)[:-1].astype(np.int64)))
    return found


def _runs(block: Block) -> list[tuple[str, Any, Any]]:
    """Type, cells and their numbers in the block: of one type and one number of points each, in their order."""
    if block.offsets is None:
        return [(_theirs.get(block.type, block.type), block.connectivity, np.arange(len(block)))]
    sizes = np.diff(block.offsets.astype(np.int64))
    kinds = block.types if block.types is not None else np.full(len(sizes), type_number(block.type), np.uint8)
    # Of a polyhedron meshio counts the points.
    points = sizes.copy()
    for i in np.flatnonzero(kinds == type_number("polyhedron")):
        points[i] = len(np.unique(block.cell(int(i))))
    keys = kinds.astype(np.int64) << 32 | points
    borders = np.flatnonzero(np.diff(keys)) + 1
    runs: list[tuple[str, Any, Any]] = []
    for cells in np.split(np.arange(len(sizes)), borders):
        if not len(cells):
            continue
        first = int(cells[0])
        kind = _names[int(kinds[first])]
        if kind == "polyhedron":
            runs.append((f"polyhedron{points[first]}", _polyhedra(block, cells), cells))
            continue
        begin, end = int(block.offsets[first]), int(block.offsets[cells[-1] + 1])
        rows = block.connectivity[begin:end].reshape(len(cells), -1)
        if kind.startswith("lagrange"):
            kind = "VTK_" + kind.upper().replace("_QUAD", "_QUADRILATERAL")
        same = kind == "polygon" and rows.shape[1] in (3, 4)
        kind = {3: "triangle", 4: "quad"}[rows.shape[1]] if same else _theirs.get(kind, kind)
        runs.append((kind, rows, cells))
    return runs


def to_meshio(mesh: Mesh) -> Any:
    """A ``meshio.Mesh``: points, cells of all types (split by type and number of points), point and cell data,
    arrays of the mesh as field data, names of blocks as cell sets. What has no place there is a
    :class:`MailleWarning`.

    >>> import maille
    >>> mesh = maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], {"triangle": [[0, 1, 2]]}, cell_data={"a": [1.0]})
    >>> maille.to_meshio(mesh).cells_dict["triangle"].tolist()
    [[0, 1, 2]]
    """
    import meshio
    from meshio import _mesh as known

    cells: list[tuple[str, Any]] = []
    places = []
    sets: dict[str, list[Any]] = {}
    first = 0
    for block in mesh.cells:
        for kind, rows, numbers in _runs(block):
            if not kind.startswith("polyhedron") and kind not in known.topological_dimension:
                _note(f"meshio has no cells of type {kind}: {len(numbers)} left out")
                continue
            if block.name:
                sets.setdefault(block.name, []).append((len(cells), np.arange(len(numbers))))
            cells.append((kind, rows))
            places.append(first + numbers)
        first += len(block)
    if mesh.corner_data:
        _note(f"meshio has no values on corners: {', '.join(mesh.corner_data)} left out")
    cell_data = {name: [values[place] for place in places] for name, values in mesh.cell_data.items()}
    cell_sets = {}
    for name, members in sets.items():
        of_set = [np.zeros(0, np.int64)] * len(cells)
        for i, numbers in members:
            of_set[i] = numbers
        cell_sets[name] = of_set
    return meshio.Mesh(mesh.points, cells, point_data=dict(mesh.point_data), cell_data=cell_data,
                       field_data=dict(mesh.field_data), cell_sets=cell_sets)


def _name_of(mesh: Any, block: int, cells: int) -> str:
    """Of the set that has all cells of a block and none of others of this name."""
    for name, members in (getattr(mesh, "cell_sets", None) or {}).items():
        if block < len(members) and members[block] is not None and len(members[block]) == cells:
            return str(name)
    return ""


def from_meshio(mesh: Any) -> Mesh:
    """A mesh of ``meshio.Mesh``, with all its cells, point, cell and field data; cell sets that are whole blocks
    become their names. Points of the plane get a third coordinate, 0."""
    points = np.asarray(mesh.points)
    if points.ndim == 2 and points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points), points.dtype)])
    blocks: list[Any] = []
    for i, each in enumerate(mesh.cells):
        kind, rows = each.type, each.data
        name = _name_of(mesh, i, len(rows))
        kind = "polyhedron" if kind.startswith("polyhedron") else kind
        kind = "polygon" if kind.startswith("polygon") else kind
        kind = kind.replace("VTK_", "").replace("QUADRILATERAL", "QUAD").lower()
        blocks.append((kind, rows, name))
    cell_data = {}
    for name, parts in (mesh.cell_data or {}).items():
        cell_data[str(name)] = np.concatenate([np.asarray(part) for part in parts]) if len(parts) else np.zeros(0)
    field_data = {}
    for name, value in (mesh.field_data or {}).items():
        array = np.asarray(value)
        if array.dtype.kind in "iuf" and array.ndim <= 2:
            field_data[str(name)] = array
        else:
            _note(f"field_data {name!r} is no array of numbers and is left out")
    return Mesh(points, blocks, point_data=mesh.point_data, cell_data=cell_data, field_data=field_data)


def _read(path: Any) -> Any:
    return to_meshio(read(path))


def _write(path: Any, mesh: Any, **options: Any) -> None:
    write(path, from_meshio(mesh), **options)


def register() -> None:
    """``meshio.read("x.maille")`` and ``meshio.write("x.maille", mesh, error=...)`` from now on."""
    import meshio

    meshio.register_format("maille", [".maille"], _read, {"maille": _write})


