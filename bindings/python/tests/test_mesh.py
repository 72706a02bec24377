"""Meshes from arrays of numpy, and their views."""

import gc
import pickle
import sys

import numpy as np
import pytest
from conftest import all_kinds, grid, sphere

import maille


def triangle(**more):
    return maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], {"triangle": [[0, 1, 2]]}, **more)


@pytest.mark.parametrize("type", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8", ">f4", ">i8"])
def test_arrays_keep_their_type_and_values(type):
    values = np.array([[1, 2], [3, 4], [5, 6]], type)
    mesh = triangle(point_data={"a": values})
    assert mesh.point_data["a"].dtype == np.dtype(type).newbyteorder("=")
    assert (mesh.point_data["a"] == values).all()


def test_positions_keep_their_type():
    for type in ("f4", "f8", "i4"):
        assert maille.Mesh(np.zeros((4, 3), type)).points.dtype == type
    assert maille.Mesh([[1, 2, 3]]).points.dtype == float


@pytest.mark.parametrize("values", [
    np.arange(12.0).reshape(3, 4)[:, ::2], np.asfortranarray(np.arange(6.0).reshape(3, 2)),
    np.arange(6.0).reshape(3, 2)[::-1], np.broadcast_to(7.0, (3, 2)), [[1, 2], [3, 4], [5, 6]]])
def test_what_is_not_contiguous_is_copied(values):
    assert (triangle(point_data={"a": values}).point_data["a"] == np.asarray(values)).all()


def test_views_stay_valid_when_the_mesh_is_gone():
    mesh = maille.decode(maille.encode(grid()))
    points, field, cells = mesh.points, mesh.point_data["T"], mesh.cells[0].connectivity
    copies = points.copy(), field.copy(), cells.copy()
    del mesh
    gc.collect()
    blocks = [np.full((1000, 3), 7.0) for _ in range(50)]  # would take the memory if it were free
    assert all((a == b).all() for a, b in zip(copies, (points, field, cells)))
    del blocks


def test_views_are_read_only():
    mesh = grid()
    for view in (mesh.points, mesh.point_data["T"], mesh.cells[0].connectivity):
        with pytest.raises(ValueError, match="read-only"):
            view[0] = 0
        with pytest.raises(ValueError):
            view.setflags(write=True)


def test_views_copy_nothing():
    mesh = maille.decode(maille.encode(grid()))
    first = maille.Mesh._of(mesh._core)
    assert first.points.__array_interface__["data"] == mesh.points.__array_interface__["data"]
    assert mesh.point_data["v"].base is not None


def test_input_is_not_copied():
    points, triangles = np.eye(3), np.array([[0, 1, 2]], "u4")
    field, signed = np.arange(3, dtype="i2"), np.array([[0, 1, 2]], "i4")
    mesh = maille.Mesh(points, {"triangle": triangles}, point_data={"a": field})
    assert np.shares_memory(mesh.points, points) and np.shares_memory(mesh.point_data["a"], field)
    assert np.shares_memory(mesh.cells[0].connectivity, triangles)
    assert np.shares_memory(maille.Mesh(points, {"triangle": signed}).cells[0].connectivity, signed)
    again = maille.Mesh(mesh.points, mesh.cells, point_data=mesh.point_data)
    assert np.shares_memory(again.points, points)
    del mesh, points, field, triangles
    gc.collect()
    assert again.points.tolist() == np.eye(3).tolist() and again.point_data["a"].tolist() == [0, 1, 2]


def test_arrays_that_are_written_to_meanwhile_do_no_harm():
    triangles = np.array([[0, 1, 2]], "u4")
    mesh = maille.Mesh(np.eye(3), {"triangle": triangles})
    triangles[0, 0] = 4000000000
    for use in (mesh.triangles, lambda: maille.encode(mesh), lambda: mesh.differences(mesh),
                lambda: mesh.slice([0, 0, 0], [0, 0, 1]), lambda: mesh.probe([[0, 0, 0]])):
        with pytest.raises(maille.Error, match="4000000000"):
            use()


def test_arrays_that_are_not_aligned_are_copied():
    values = np.frombuffer(b"x" + np.arange(3.0).tobytes(), dtype=float, offset=1)
    assert triangle(point_data={"a": values}).point_data["a"].tolist() == [0, 1, 2]


def test_all_kinds_of_cells_come_back():
    mesh = all_kinds()
    assert [block.type for block in mesh.cells] == ["tetrahedron", "polygon", "mixed", "polyhedron"]
    assert [block.name for block in mesh.cells] == ["corner", "", "both", "cell"]
    assert [len(block) for block in mesh.cells] == [1, 2, 2, 1]
    assert mesh.cells[1].cell(1).tolist() == [4, 5, 7, 6]
    assert mesh.cells[1].cell(-2).tolist() == [0, 1, 3]
    assert mesh.cells[3].face_sizes.tolist() == [4] * 6
    back = maille.decode(maille.encode(mesh, mode="stream"))
    assert mesh.differences(back, same_order=True) == []
    assert back.metadata == [("unit", "mm")]


@pytest.mark.parametrize("cells", [
    [("triangle", [[0, 1, 2]])], {"triangle": [[0, 1, 2]]}, np.array([[0, 1, 2]]), {5: [[0, 1, 2]]},
    {"VTK_TRIANGLE": [[0, 1, 2]]}, [maille.Block("triangle", np.array([[0, 1, 2]]))],
    maille.Block("triangle", np.array([[0, 1, 2]], "u4")), [["triangle", [[0, 1, 2]], ""]]])
def test_cells_may_be_given_in_many_ways(cells):
    assert maille.Mesh(np.eye(3), cells).differences(maille.Mesh(np.eye(3), {"triangle": [[0, 1, 2]]})) == []


def test_polyhedra_may_be_lists_of_faces():
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    mesh = maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], {"polyhedron": [faces]})
    assert mesh.cells[0].connectivity.tolist() == sum(faces, [])
    assert len(mesh.triangles()) == 4


@pytest.mark.parametrize("arguments, kind, sentence", [
    (dict(points=np.zeros((3, 2))), ValueError, r"points: an array of shape \(n, 3\) is wanted, not \(3, 2\); add"),
    (dict(points=np.zeros(3)), ValueError, r"points: .* not \(3,\)"),
    (dict(points=np.zeros((3, 3), complex)), TypeError, "points: numbers of int8 .* not complex128"),
    (dict(points=np.zeros((3, 3), "f2")), TypeError, "not float16; use .astype"),
    (dict(cells={"triangle": [[0, 1, 3]]}), maille.Error, "point 3, but there are 3 points"),
    (dict(cells={"triangle": [[0, 1, -1]]}), ValueError, "there is -1; numbers are counted from 0"),
    (dict(cells={"triangle": [[0, 1, 2**33]]}), ValueError, "8589934592"),
    (dict(cells={"triangle": [[0.0, 1.0, 2.0]]}), TypeError, "integers are wanted, not float64"),
    (dict(cells={"triangle": [[0, 1]]}), ValueError, r"cells \(triangle\): .*\(n, 3\) is wanted, not \(1, 2\)"),
    (dict(cells=np.zeros((1, 4), int)), ValueError, "quads or tetrahedra"),
    (dict(cells={"triangel": [[0, 1, 2]]}), ValueError, "no type 'triangel'"),
    (dict(cells=[5]), TypeError, "pairs of a type and an array"),
    (dict(point_data={"T": [1.0, 2.0]}), ValueError, r"point_data\['T'\]: 3 values are wanted, one for each point"),
    (dict(cell_data={"T": [1.0, 2.0]}), ValueError, r"cell_data\['T'\]: 1 values are wanted, one for each cell"),
    (dict(corner_data={"T": [1.0]}), ValueError, "3 values are wanted, one for each corner"),
    (dict(point_data={"T": np.zeros((3, 3, 3))}), ValueError, r"reshape\(3, 9\)"),
    (dict(point_data={"T": [True, False, True]}), TypeError, "bool; use .astype"),
    (dict(point_data={"T": ["a", "b", "c"]}), TypeError, "not <U1"),
    (dict(point_data=[1]), TypeError, "a mapping of names and arrays is wanted, not list"),
    (dict(point_data={1: [1, 2, 3]}), TypeError, "names are strings, not 1"),
    (dict(point_data={"T": maille.Array(np.zeros(3), role="heat")}), ValueError, "no role 'heat'; there are: none"),
])
def test_what_is_wrong_is_named_with_what_is_wanted(arguments, kind, sentence):
    arguments = {"points": np.eye(3), "cells": {"triangle": [[0, 1, 2]]}, **arguments}
    points = arguments.pop("points")
    with pytest.raises(kind, match=sentence):
        maille.Mesh(points, arguments.pop("cells"), **arguments)


def test_a_block_that_lies_is_refused():
    for block in (maille.Block("polygon", np.arange(3), np.array([0, 4])),
                  maille.Block("polygon", np.arange(3), np.array([0, 2, 1, 3])),
                  maille.Block("mixed", np.arange(3), np.array([0, 3]), types=np.array([5, 5])),
                  maille.Block("polyhedron", np.arange(3), np.array([0, 3]), face_sizes=np.array([4]),
                               cell_faces=np.array([0, 1]))):
        with pytest.raises(maille.Error) as raised:
            maille.Mesh(np.eye(3), [block])
        assert raised.value.code == maille.ErrorCode.MALFORMED_INPUT


def test_triangles_are_the_surface():
    assert len(grid(3).triangles()) == 6 * 9 * 2
    assert sorted(set(grid(3).triangle_cells().tolist())) == [i for i in range(27) if i != 13]
    ball = sphere(8)
    assert (ball.triangles() == ball.cells[0].connectivity).all()
    # Outwards: the volume within has a sign.
    a, b, c = (grid(2).points[grid(2).triangles()[:, k]].astype(float) for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(8, rel=0.2)


def test_slices_and_probes():
    mesh = grid(4, point_data={"x": grid(4).points[:, 0].copy()})
    cut = mesh.slice([2, 2, 2], [0, 0, 5])
    assert np.allclose(cut.points[:, 2], 2) and cut.cell_count >= 16
    cells, values = mesh.probe([[2, 2, 2.5], [99, 0, 0]])
    assert cells[1] == -1 and np.isnan(values["x"][1])
    assert values["x"][0] == pytest.approx(2, abs=0.1)
    with pytest.raises(ValueError, match="no length"):
        mesh.slice([0, 0, 0], [0, 0, 0])


@pytest.mark.parametrize("protocol", [2, 4, 5])
def test_meshes_pickle(protocol):
    for mesh in (all_kinds(), grid(), sphere(4), triangle(field_data={"n": [1, 2]})):
        back = pickle.loads(pickle.dumps(mesh, protocol))
        assert mesh.differences(back, same_order=True) == []
        assert [block.name for block in back.cells] == [block.name for block in mesh.cells]
        assert [(each.name, each.role) for each in back.arrays] == [(each.name, each.role) for each in mesh.arrays]


def test_pickles_go_out_of_band():
    buffers = []
    mesh = grid(8)
    data = pickle.dumps(mesh, 5, buffer_callback=buffers.append)
    assert len(data) < 4000 and len(buffers) >= 5
    assert mesh.differences(pickle.loads(data, buffers=buffers)) == []


def test_roles_and_labels_come_back():
    mesh = triangle(point_data={"n": maille.Array(np.eye(3, dtype="f4"), role="normal")},
                    cell_data={"part": maille.Array(np.array([1], "u1"), role="label", labels=["wing", "tail"])})
    back = maille.decode(maille.encode(mesh))
    normal, part = back.arrays
    assert (normal.role, normal.domain) == ("normal", "point")
    assert (part.role, part.labels, part.name) == ("label", ("wing", "tail"), "part")


def test_memory_is_given_back():
    def used():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * 4096

    data = maille.encode(sphere(100), effort=1)
    for _ in range(3):
        maille.decode(data).points.sum()
    before = used()
    for _ in range(100):
        mesh = maille.decode(data)
        views = [mesh.points, mesh.cells[0].connectivity, mesh.triangles()]
        del mesh, views
    assert used() - before < 30 << 20


def test_references_are_counted():
    values = np.arange(3.0)
    before = sys.getrefcount(values)
    mesh = triangle(point_data={"a": values})
    del mesh
    gc.collect()
    assert sys.getrefcount(values) == before
