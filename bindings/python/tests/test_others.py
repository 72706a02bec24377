"""meshio, VTK, PyVista and trimesh: with the package itself where Debian has it, else with what it would call."""

import subprocess
import sys
import types
import warnings

import numpy as np
import pytest
from conftest import all_kinds, grid, sphere

import maille


def mixed():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1],
                       [0.5, 0.5, 2]])
    return maille.Mesh(points, [("hexahedron", [[0, 1, 2, 3, 4, 5, 6, 7]], "base"),
                                ("pyramid", [[4, 5, 6, 7, 8]], "roof"), ("triangle", [[0, 1, 2], [0, 2, 3]], "floor")],
                       point_data={"T": np.arange(9.0)}, cell_data={"id": np.arange(4), "v": np.ones((4, 3), "f4")},
                       field_data={"time": [1.5]})


def test_meshio_round_trip(tmp_path):
    meshio = pytest.importorskip("meshio")
    for mesh in (mixed(), grid(4), sphere(6)):
        back = maille.from_meshio(maille.to_meshio(mesh))
        assert mesh.differences(back, same_order=True) == []
        meshio.write(tmp_path / "x.maille", maille.to_meshio(mesh))
        theirs = meshio.read(tmp_path / "x.maille")
        assert (theirs.points == mesh.points).all() or mesh is not None and mesh.differences(
            maille.from_meshio(theirs)) == []
    assert [block.name for block in maille.from_meshio(maille.to_meshio(mixed())).cells] == ["base", "roof", "floor"]


def test_meshio_takes_options(tmp_path):
    meshio = pytest.importorskip("meshio")
    meshio.write(tmp_path / "x.maille", maille.to_meshio(grid(6)), error=0.01, mode="stream")
    assert not maille.info(tmp_path / "x.maille").positions.lossless


def test_meshio_has_polyhedra_and_polygons():
    pytest.importorskip("meshio")
    cube = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]]
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    mesh = maille.Mesh(points, {"polyhedron": [cube]}, cell_data={"a": [1.0]})
    theirs = maille.to_meshio(mesh)
    assert theirs.cells[0].type == "polyhedron8"
    assert mesh.differences(maille.from_meshio(theirs), same_order=True) == []
    many = maille.Mesh(np.random.default_rng(0).random((7, 3)), {"polygon": [[0, 1, 2], [1, 2, 3], [0, 1, 2, 3],
                                                                             [2, 3, 4, 5, 6]]})
    assert [(block.type, len(block.data)) for block in maille.to_meshio(many).cells] == \
        [("triangle", 2), ("quad", 1), ("polygon", 1)]
    with pytest.warns(maille.MailleWarning, match="corners"):
        maille.to_meshio(maille.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])], corner_data={"uv": np.zeros((3, 2))}))


@pytest.mark.parametrize("order", ["import maille, meshio", "import meshio, maille"])
def test_meshio_learns_in_either_order(order):
    pytest.importorskip("meshio")
    code = order + "; from meshio import _helpers; assert 'maille' in _helpers.reader_map, 1"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_plane_of_meshio_gets_a_third_coordinate():
    meshio = pytest.importorskip("meshio")
    flat = meshio.Mesh(np.array([[0.0, 0], [1, 0], [0, 1]]), [("triangle", np.array([[0, 1, 2]]))])
    assert maille.from_meshio(flat).points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_vtk_round_trip():
    pytest.importorskip("vtkmodules")
    for mesh in (mixed(), grid(4), sphere(6), all_kinds()):
        data = maille.to_vtk(mesh)
        assert data.GetNumberOfCells() == mesh.cell_count
        back = maille.from_vtk(data)
        assert (back.points == mesh.points).all()
        assert {name: values.tolist() for name, values in back.cell_data.items()} == \
            {name: values.tolist() for name, values in mesh.cell_data.items()}
        assert (back.triangles() == mesh.triangles()).all()
        again = maille.from_vtk(maille.to_vtk(back))
        assert back.differences(again, same_order=True) == []
    assert maille.to_vtk(sphere(6)).IsA("vtkPolyData") and maille.to_vtk(grid(2)).IsA("vtkUnstructuredGrid")


def test_vtk_has_polyhedra():
    pytest.importorskip("vtkmodules")
    data = maille.to_vtk(all_kinds())
    assert data.GetCellType(5) == 42 and data.GetCell(5).GetNumberOfFaces() == 6
    assert data.GetCell(5).GetNumberOfPoints() == 8
    assert maille.from_vtk(data).cells[0].face_sizes.tolist() == [4] * 6


def test_vtk_datasets_of_other_kinds_are_refused():
    model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    with pytest.raises(TypeError, match="not vtkImageData"):
        maille.from_vtk(model.vtkImageData())
    with pytest.raises(TypeError, match="from_vtk"):
        maille.encode(model.vtkPolyData())
    assert maille.from_vtk(model.vtkUnstructuredGrid()).cell_count == 0
    assert maille.from_vtk(model.vtkPolyData()).point_count == 0


def test_roles_are_active_in_vtk():
    pytest.importorskip("vtkmodules")
    mesh = sphere(4)
    mesh = maille.Mesh(mesh.points, mesh.cells, point_data={"n": maille.Array(mesh.points.astype("f4"), role="normal")})
    assert maille.to_vtk(mesh).GetPointData().GetNormals().GetName() == "n"


def test_pyvista_finds_reader_and_writer(tmp_path, monkeypatch):
    """PyVista is not in Debian 12: its part of the contract is played here (entry points, wrap())."""
    pytest.importorskip("vtkmodules")
    from importlib.metadata import entry_points

    found = entry_points()
    groups = {group: [each for each in found.select(group=group) if each.name == ".maille"]
              for group in ("pyvista.readers", "pyvista.writers")}
    if not all(groups.values()):
        pytest.skip("maille is not installed")
    monkeypatch.setitem(sys.modules, "pyvista", types.SimpleNamespace(wrap=lambda data: data))
    read, write = groups["pyvista.readers"][0].load(), groups["pyvista.writers"][0].load()
    write(maille.to_vtk(mixed()), str(tmp_path / "x.maille"), error=0.01)
    assert read(str(tmp_path / "x.maille")).GetNumberOfCells() == 4
    maille.write(tmp_path / "s.maille", sphere(80), mode="random")
    assert read(str(tmp_path / "s.maille"), level=1).GetNumberOfCells() < sphere(80).cell_count
    assert read(str(tmp_path / "x.maille"), arrays=["T"]).GetPointData().GetNumberOfArrays() == 1


def test_trimesh_gets_a_loader(tmp_path, monkeypatch):
    """Nor is trimesh: a package of that name with the dictionary that it has."""
    folder = tmp_path / "trimesh" / "exchange"
    folder.mkdir(parents=True)
    (tmp_path / "trimesh" / "__init__.py").write_text("from .exchange import load\n")
    (folder / "__init__.py").write_text("")
    (folder / "load.py").write_text("mesh_loaders = {}\n")
    maille.write(tmp_path / "x.maille", maille.Mesh(np.eye(4)[:, :3], {"quad": [[0, 1, 2, 3]]},
                                                    point_data={"h": np.arange(4.0)}))
    code = f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
ORDER
loaded = trimesh.exchange.load.mesh_loaders["maille"](open({str(tmp_path / "x.maille")!r}, "rb"), file_type="maille",
                                                      resolver=None)
assert loaded["faces"].tolist() == [[0, 1, 2], [0, 2, 3]] and loaded["vertices"].shape == (4, 3)
assert loaded["vertex_attributes"]["h"].tolist() == [0, 1, 2, 3]
"""
    for order in ("import maille, trimesh", "import trimesh, maille"):
        subprocess.run([sys.executable, "-c", code.replace("ORDER", order)], check=True)


def test_a_package_that_is_other_than_we_know_is_left_alone(tmp_path):
    (tmp_path / "trimesh.py").write_text("")
    (tmp_path / "meshio.py").write_text("def register_format(): pass\n")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import maille, trimesh, meshio"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_warnings_say_where():
    pytest.importorskip("vtkmodules")
    mesh = maille.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])], corner_data={"uv": np.zeros((3, 2))})
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        maille.to_vtk(mesh)
    assert caught[0].filename == __file__ and caught[0].category is maille.MailleWarning
