"""Meshes of VTK, and so of PyVista."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from ._arrays import NDArray
from ._errors import MailleWarning
from ._mesh import POLYHEDRON, Block, Mesh, _names, _nodes, type_number

_POLYDATA = ({"vertex"}, {"line", "poly_line"}, {"triangle", "quad", "polygon"})
"""What vtkPolyData keeps in one order."""

_ROLES = {"normal": "Normals", "texture_coordinate": "TCoords"}


def _note(text: str) -> None:
    warnings.warn(text, MailleWarning, stacklevel=3)


def _offsets(block: Block) -> NDArray:
    """Where cells begin, and the end."""
    if block.offsets is None or not len(block.offsets):
        width = block.connectivity.shape[1] if block.connectivity.ndim == 2 else 1
        return np.arange(len(block) + 1, dtype=np.int64) * width
    return block.offsets.astype(np.int64)


def _types(block: Block) -> NDArray:
    if block.types is not None:
        return block.types
    return np.full(len(block), type_number(block.type), np.uint8)


def _with_points_once(connectivity: NDArray, offsets: NDArray, polyhedra: NDArray) -> tuple[NDArray, NDArray]:
    """Of polyhedra the points of their faces, each once, in the order in which they come first."""
    sizes = np.diff(offsets)
    cells = np.repeat(np.arange(len(sizes)), sizes)
    keys = cells.astype(np.uint64) << np.uint64(32) | connectivity.astype(np.uint64)
    first = np.zeros(len(keys), bool)
    first[np.unique(keys, return_index=True)[1]] = True
    first |= ~np.repeat(polyhedra, sizes)
    kept = np.bincount(cells[first], minlength=len(sizes))
    return connectivity[first], np.concatenate([[0], np.cumsum(kept)])


def _face_stream(block: Block, polyhedra: NDArray) -> tuple[NDArray, NDArray]:
    """Faces as vtkUnstructuredGrid has them: of each polyhedron the number of faces, and of each face the number
    of points and the points; and where each cell has its own, -1 for other cells."""
    assert block.face_sizes is not None and block.cell_faces is not None
    offsets, sizes = _offsets(block), block.face_sizes.astype(np.int64)
    cell_faces = block.cell_faces.astype(np.int64)
    of_polyhedra = np.repeat(polyhedra, np.diff(offsets))
    corners = block.connectivity[of_polyhedra].astype(np.int64)
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]) if len(sizes) else np.zeros(0, np.int64)
    counts = np.diff(cell_faces)[polyhedra]
    with_sizes = np.insert(corners, starts, sizes)
    face_places = starts + np.arange(len(sizes))
    cell_places = face_places[cell_faces[:-1][polyhedra]]
    stream = np.insert(with_sizes, cell_places, counts)
    locations = np.full(len(block), -1, np.int64)
    locations[polyhedra] = cell_places + np.arange(len(cell_places))
    return stream, locations


def _ids(values: Any) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray

    return numpy_to_vtkIdTypeArray(np.ascontiguousarray(values, np.int64), deep=True)


def _grid(mesh: Mesh) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid

    grid = vtkUnstructuredGrid()
    all_types, all_points, all_offsets, faces, locations = [], [], [np.zeros(1, np.int64)], [], []
    points_before = stream_before = 0
    for block in mesh.cells:
        kinds, offsets = _types(block), _offsets(block)
        connectivity = block.connectivity.reshape(-1)
        polyhedra = kinds == POLYHEDRON
        if polyhedra.any():
            stream, places = _face_stream(block, polyhedra)
            connectivity, offsets = _with_points_once(connectivity, offsets, polyhedra)
            faces.append(stream)
            locations.append(np.where(places >= 0, places + stream_before, -1))
            stream_before += len(stream)
        else:
            locations.append(np.full(len(block), -1, np.int64))
        all_types.append(kinds)
        all_points.append(connectivity)
        all_offsets.append(offsets[1:] + points_before)
        points_before += len(connectivity)
    cells = vtkCellArray()
    cells.SetData(_ids(np.concatenate(all_offsets)), _ids(np.concatenate(all_points) if all_points else []))
    types = numpy_to_vtk(np.concatenate(all_types) if all_types else np.zeros(0, np.uint8), deep=True)
    if faces:
        grid.SetCells(types, cells, _ids(np.concatenate(locations)), _ids(np.concatenate(faces)))
    else:
        grid.SetCells(types, cells)
    return grid


def _polydata(mesh: Mesh, dimension: int) -> Any:
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    all_points, all_offsets, before = [np.zeros(0, np.uint32)], [np.zeros(1, np.int64)], 0
    for block in mesh.cells:
        all_points.append(block.connectivity.reshape(-1))
        all_offsets.append(_offsets(block)[1:] + before)
        before += len(all_points[-1])
    cells = vtkCellArray()
    cells.SetData(_ids(np.concatenate(all_offsets)), _ids(np.concatenate(all_points)))
    data = vtkPolyData()
    (data.SetVerts, data.SetLines, data.SetPolys)[dimension](cells)
    return data


def to_vtk(mesh: Mesh) -> Any:
    """A ``vtkPolyData``, where all cells are faces (or all lines, or all points), else a ``vtkUnstructuredGrid``,
    with the arrays of points, cells and the mesh as a whole. ``pyvista.wrap()`` makes PyVista's of it. VTK has no
    place for names of blocks; for values of corners neither, which is a :class:`MailleWarning`."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints

    kinds = {_names[int(kind)] for block in mesh.cells for kind in np.unique(_types(block))}
    dimension = next((i for i, known in enumerate(_POLYDATA) if kinds <= known), None)
    data = _grid(mesh) if dimension is None or not kinds else _polydata(mesh, dimension)
    points = vtkPoints()
    positions = mesh.points if mesh.points.dtype.kind == "f" else mesh.points.astype(float)
    points.SetData(numpy_to_vtk(positions, deep=True))
    data.SetPoints(points)
    places = {"point": data.GetPointData(), "cell": data.GetCellData(), "mesh": data.GetFieldData()}
    for array in mesh.arrays:
        if array.domain not in places:
            _note(f"VTK has no values on corners: '{array.name}' left out")
            continue
        values = numpy_to_vtk(array.values, deep=True)
        values.SetName(array.name)
        place = places[array.domain]
        role = _ROLES.get(array.role) if array.domain == "point" else None
        if role and getattr(place, "Get" + role)() is None:
            getattr(place, "Set" + role)(values)
        else:
            place.AddArray(values)
    return data


def _blocks_of(cells: Any, kinds: NDArray, dataset: Any) -> list[Block]:
    """The cells in their order: one block where they are of one type, else a mixed one."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    offsets = vtk_to_numpy(cells.GetOffsetsArray())
    connectivity = vtk_to_numpy(cells.GetConnectivityArray())
    if not len(kinds):
        return []
    if (kinds == POLYHEDRON).any():
        return [_polyhedral(dataset, kinds, offsets, connectivity)]
    nodes = _nodes.get(int(kinds[0]), 0)
    if (kinds == kinds[0]).all():
        name = _names[int(kinds[0])]
        if nodes:
            return [Block(name, connectivity.reshape(-1, nodes))]
        return [Block(name, connectivity, offsets)]
    if {_names[int(kind)] for kind in np.unique(kinds)} <= {"triangle", "quad", "polygon"}:
        return [Block("polygon", connectivity, offsets)]
    return [Block("mixed", connectivity, offsets, kinds)]


def _polyhedral(dataset: Any, kinds: NDArray, offsets: NDArray, connectivity: NDArray) -> Block:
    """Cells of which some are polyhedra, whose faces stand apart in VTK."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    stream, places = vtk_to_numpy(dataset.GetFaces()), vtk_to_numpy(dataset.GetFaceLocations())
    points: list[NDArray] = []
    sizes: list[int] = []
    cell_faces, ends = [0], [0]
    for i, kind in enumerate(kinds):
        if kind != POLYHEDRON:
            points.append(connectivity[offsets[i]:offsets[i + 1]])
            ends.append(ends[-1] + int(offsets[i + 1] - offsets[i]))
        else:
            place, corners = int(places[i]) + 1, 0
            for _ in range(int(stream[places[i]])):
                size = int(stream[place])
                points.append(stream[place + 1:place + 1 + size])
                sizes.append(size)
                corners += size
                place += 1 + size
            ends.append(ends[-1] + corners)
        cell_faces.append(len(sizes))
    name = "polyhedron" if (kinds == POLYHEDRON).all() else "mixed"
    return Block(name, np.concatenate(points), np.array(ends), None if name == "polyhedron" else kinds,
                 np.array(sizes), np.array(cell_faces))


def _data_of(attributes: Any, what: str) -> dict[str, Any]:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    found: dict[str, Any] = {}
    for i in range(attributes.GetNumberOfArrays()):
        array = attributes.GetArray(i)
        if array is None:
            _note(f"{what}: '{attributes.GetAbstractArray(i).GetName()}' has no numbers and is left out")
            continue
        values = vtk_to_numpy(array)
        found[array.GetName() or f"array{i}"] = values.astype(np.uint8) if values.dtype == bool else values
    return found


def from_vtk(dataset: Any) -> Mesh:
    """A mesh of a ``vtkPolyData`` or ``vtkUnstructuredGrid``, PyVista's too, with all its arrays of numbers.
    Triangle strips and other datasets: let VTK make one of these two first."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    blocks: list[Block] = []
    if dataset.IsA("vtkUnstructuredGrid"):
        if dataset.GetNumberOfCells():
            kinds = vtk_to_numpy(dataset.GetCellTypesArray())
            blocks = _blocks_of(dataset.GetCells(), kinds, dataset)
    elif dataset.IsA("vtkPolyData"):
        if dataset.GetNumberOfStrips():
            raise TypeError("the vtkPolyData has triangle strips; vtkTriangleFilter makes triangles of them")
        blocks = _polydata_blocks(dataset)
    else:
        raise TypeError(f"a vtkPolyData or vtkUnstructuredGrid is wanted, not {dataset.GetClassName()}; "
                        "cast_to_unstructured_grid() of PyVista makes one")
    where = dataset.GetPoints()
    points = np.zeros((0, 3), np.float32) if where is None else vtk_to_numpy(where.GetData())
    return Mesh(points, blocks, point_data=_data_of(dataset.GetPointData(), "point data"),
                cell_data=_data_of(dataset.GetCellData(), "cell data"),
                field_data=_data_of(dataset.GetFieldData(), "field data"))


def _polydata_blocks(dataset: Any) -> list[Block]:
    """Points, lines and faces, in this order, which is that of the cell data."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    blocks = []
    for cells, alike, nodes, other in ((dataset.GetVerts(), "vertex", 1, "poly_vertex"),
                                       (dataset.GetLines(), "line", 2, "poly_line"),
                                       (dataset.GetPolys(), "triangle", 3, "polygon")):
        if not cells.GetNumberOfCells():
            continue
        offsets = vtk_to_numpy(cells.GetOffsetsArray())
        connectivity = vtk_to_numpy(cells.GetConnectivityArray())
        sizes = np.diff(offsets)
        if (sizes == nodes).all():
            blocks.append(Block(alike, connectivity.reshape(-1, nodes)))
        elif other == "polygon" and (sizes == 4).all():
            blocks.append(Block("quad", connectivity.reshape(-1, 4)))
        else:
            blocks.append(Block(other, connectivity, offsets))
    return blocks
