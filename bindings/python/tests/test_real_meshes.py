"""All shared meshes, in all modes: what comes back, against the mesh, the command, and other readers."""

import subprocess
import warnings

import numpy as np
import pytest
from conftest import DATA

import maille

# What the library reads none of.
OTHERS = {".mz3", ".tsv", ".b3dm", ".mtl", ".png", ".jpg", ".txt"}
# Larger ones take a minute in all modes on two cores: they go by their usual mode alone.
LARGE = 2 << 20
FILES = sorted(path for path in DATA.rglob("*") if path.is_file() and path.suffix not in OTHERS) if DATA.is_dir() else []


def read(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", maille.MailleWarning)
        return maille.read(path)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(DATA)))
def test_round_trip(path, tool, tmp_path):
    """The mesh comes back in all modes, its order too, and the file is the command's, byte for byte."""
    mesh = read(path)
    for mode in [None] if path.stat().st_size > LARGE else [None, "single", "stream", "random"]:
        words = ["-q", "-f", "-2", "--keep-order", "--no-provenance", *(["--mode", mode] if mode else [])]
        theirs = subprocess.run([tool.path, "compress", *words, path, tmp_path / "x.maille"], stderr=subprocess.DEVNULL)
        try:
            data = maille.encode(mesh, mode=mode, effort=2, order="keep")
        except maille.Error as error:
            assert mode is not None and error.code == maille.ErrorCode.UNSUPPORTED, (mode, error)
            assert theirs.returncode == error.code, mode
            continue
        assert mesh.differences(maille.decode(data), same_order=True) == [], mode
        if path.suffix != ".e":  # of a series the command takes all steps, read() the last one
            assert data == (tmp_path / "x.maille").read_bytes(), mode


@pytest.mark.parametrize("path", [path for path in FILES if path.stat().st_size < LARGE and
                                  path.suffix not in (".glb", ".gltf")],  # which the command places as its scene does
                         ids=lambda path: str(path.relative_to(DATA)))
def test_arrays_of_the_command(path, tool, tmp_path):
    """Decompressed by the command into a file that keeps all, and read again: the same arrays as decode() gives."""
    (tmp_path / "x.maille").write_bytes(maille.encode(read(path), effort=2))
    mesh = maille.read(tmp_path / "x.maille")
    name = "x.ply" if all(block.dimension == 2 for block in mesh.cells) else "x.vtu"
    tool("decompress", "-q", tmp_path / "x.maille", tmp_path / name)
    theirs = read(tmp_path / name)
    assert (mesh.points == theirs.points).all()
    assert mesh.triangles().tolist() == theirs.triangles().tolist()
    for name, values in mesh.point_data.items():
        if name in theirs.point_data and theirs.point_data[name].dtype == values.dtype:
            assert np.array_equal(values, theirs.point_data[name], equal_nan=values.dtype.kind == "f")


def vtk_reader(path):
    """Of VTK, where it has one for the format that keeps cells and points as they are."""
    xml = pytest.importorskip("vtkmodules.vtkIOXML")
    from vtkmodules import vtkIOLegacy
    reader = {".vtu": xml.vtkXMLUnstructuredGridReader, ".vtp": xml.vtkXMLPolyDataReader,
              ".vtk": vtkIOLegacy.vtkUnstructuredGridReader}[path.suffix]()
    if path.suffix == ".vtk":
        reader.ReadAllScalarsOn()
        reader.ReadAllVectorsOn()
        reader.ReadAllFieldsOn()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def by_name(data):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return {data.GetArrayName(i): vtk_to_numpy(data.GetArray(i)) for i in range(data.GetNumberOfArrays())
            if data.GetArray(i) is not None}


@pytest.mark.parametrize("path", [path for path in FILES if path.suffix in (".vtu", ".vtp", ".vtk")],
                         ids=lambda path: str(path.relative_to(DATA)))
def test_values_are_those_that_vtk_reads(path):
    theirs = vtk_reader(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", maille.MailleWarning)
        mesh = maille.decode(maille.encode(read(path), effort=1, order="keep"))
        ours = maille.to_vtk(mesh)
    assert ours.GetNumberOfPoints() == theirs.GetNumberOfPoints()
    assert ours.GetNumberOfCells() == theirs.GetNumberOfCells()
    from vtkmodules.util.numpy_support import vtk_to_numpy
    assert (vtk_to_numpy(ours.GetPoints().GetData()) == vtk_to_numpy(theirs.GetPoints().GetData())).all()
    if theirs.IsA("vtkUnstructuredGrid") and ours.IsA("vtkUnstructuredGrid"):
        assert (vtk_to_numpy(ours.GetCellTypesArray()) == vtk_to_numpy(theirs.GetCellTypesArray())).all()
        assert (vtk_to_numpy(ours.GetCells().GetConnectivityArray()) ==
                vtk_to_numpy(theirs.GetCells().GetConnectivityArray())).all()
    for of_ours, of_theirs in ((ours.GetPointData(), theirs.GetPointData()), (ours.GetCellData(), theirs.GetCellData())):
        mine = by_name(of_ours)
        for name, values in by_name(of_theirs).items():
            assert np.array_equal(mine[name], values, equal_nan=values.dtype.kind == "f"), name


@pytest.mark.parametrize("path", [path for path in FILES if path.suffix in (".off", ".mesh", ".stl", ".su2", ".ply")
                                  and path.stat().st_size < LARGE], ids=lambda path: str(path.relative_to(DATA)))
def test_values_are_those_that_meshio_reads(path):
    meshio = pytest.importorskip("meshio")
    try:
        theirs = meshio.read(path)
    except SystemExit:
        pytest.skip("meshio reads no such file")
    except Exception as error:  # whatever it is: its readers raise anything
        pytest.skip(f"meshio: {type(error).__name__}")
    mesh = read(path)
    if path.suffix == ".stl":
        return  # meshio welds by rounding
    if path.suffix == ".su2" and mesh.point_count != len(theirs.points):
        pytest.skip("meshio reads one zone of several")
    assert mesh.point_count == len(theirs.points)
    assert np.allclose(mesh.points, np.asarray(theirs.points).reshape(len(theirs.points), -1)[:, :3], rtol=1e-6) \
        or mesh.points.dtype != theirs.points.dtype
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", maille.MailleWarning)
        ours = maille.to_meshio(mesh)
    for kind, cells in theirs.cells_dict.items():
        mine = ours.cells_dict.get(kind, np.zeros(0))
        assert np.array_equal(np.sort(np.asarray(mine), axis=None), np.sort(np.asarray(cells), axis=None))
