"""Whole files: written, read, and as the command has them."""

import io
import mmap
import os
import subprocess
import sys
import warnings

import numpy as np
import pytest
from conftest import all_kinds, grid, same, sphere

import maille


@pytest.mark.parametrize("mode", ["single", "stream", "random"])
def test_nothing_is_lost(tmp_path, mode):
    for mesh in (sphere(12, point_data={"h": np.arange(266, dtype=np.float32)}), grid(5), all_kinds()):
        path = tmp_path / "mesh.maille"
        try:
            maille.write(path, mesh, mode=mode)
        except maille.Error as error:
            assert error.code == maille.ErrorCode.UNSUPPORTED and mesh.cells[0].dimension == 3 and mode != "stream"
            continue
        assert mesh.differences(maille.read(path)) == []
        assert maille.info(path).mode == mode


def test_values_come_back_bit_for_bit():
    bits = np.array([0, 1 << 63, 0x7FF0000000000001, 0xFFF8000000000123, 0x0000000000000001], "u8")
    points = np.vstack([np.eye(3), np.zeros((2, 3))])
    mesh = maille.Mesh(points, {"triangle": [[0, 1, 2]], "line": [[3, 4]]}, point_data={"x": bits.view(float)})
    back = maille.decode(maille.encode(mesh, order="keep"))
    assert (back.point_data["x"].view("u8") == bits).all()


def test_sources_of_all_kinds(tmp_path):
    path = tmp_path / "grid.maille"
    mesh = grid(4)
    maille.write(path, mesh)
    data = path.read_bytes()
    with open(path, "rb") as file, open(path, "rb") as mapped:
        for source in (path, str(path), data, bytearray(data), memoryview(data), file,
                       io.BytesIO(data), np.frombuffer(data, "u1"), mmap.mmap(mapped.fileno(), 0, prot=mmap.PROT_READ)):
            assert same(maille.read(source), mesh)
            assert maille.open(source).info.points == mesh.point_count


def test_a_file_object_is_written(tmp_path):
    mesh = sphere(6)
    file = io.BytesIO()
    report = maille.write(file, mesh, bits=10)
    assert file.getvalue() == maille.encode(mesh, bits=10) and report.file_bytes == len(file.getvalue())


def test_what_is_no_source_is_named():
    with pytest.raises(TypeError, match="a path, an address, bytes or an open file is wanted, not int"):
        maille.read(5)
    with pytest.raises(ValueError, match="not contiguous"):
        maille.decode(memoryview(bytes(100))[::2])
    with pytest.raises(TypeError, match="maille.Mesh is wanted, not list"):
        maille.encode([1])


def test_damage_is_named(tmp_path):
    data = bytearray(maille.encode(grid(8)))
    data[len(data) // 2] ^= 1
    with pytest.raises(maille.Error) as raised:
        maille.decode(data)
    assert raised.value.code == maille.ErrorCode.CORRUPT
    assert maille.verify(bytes(data)) != []
    mesh, damage = maille.salvage(bytes(data))
    assert damage and mesh.cell_count <= 512
    assert maille.salvage(maille.encode(grid(3)))[1] is None
    for end in range(0, len(data), 997):
        with pytest.raises(maille.Error):
            maille.decode(bytes(data[:end]))


def test_errors_of_the_system_are_those_of_python(tmp_path):
    with pytest.raises(FileNotFoundError) as raised:
        maille.read(tmp_path / "nowhere.maille")
    assert raised.value.filename and raised.value.errno == 2
    with pytest.raises(OSError) as raised:
        maille.write(tmp_path / "nowhere" / "x.maille", sphere(4))
    assert raised.value.code == maille.ErrorCode.WRITE_FAILED
    with pytest.raises(MemoryError):
        maille.decode(maille.encode(grid(8)), memory=1000)
    with pytest.raises(OSError) as raised:
        maille.read("http://127.0.0.1:1/x.maille")
    assert raised.value.code == maille.ErrorCode.NETWORK


def test_errors_pickle():
    import pickle

    error = pickle.loads(pickle.dumps(maille.Error("a sentence", 6)))
    assert str(error) == "a sentence" and error.code == maille.ErrorCode.CORRUPT


def test_bounds_are_kept():
    mesh = grid(10)
    for options, name, bound in (
            (dict(error=0.01), None, 0.01), (dict(error={"T": 0.001}), "T", 0.001),
            (dict(relative_error={"v": 0.01}), "v", 0.01 * np.ptp(mesh.point_data["v"])),
            (dict(error={"position": 0.1, "p": 3.0}), "p", 3.0)):
        back = maille.decode(maille.encode(mesh, **options))
        ours = back.points if name is None else {**back.point_data, **back.cell_data}[name]
        theirs = mesh.points if name is None else {**mesh.point_data, **mesh.cell_data}[name]
        assert np.abs(ours.astype(float) - theirs).max() <= bound
        assert (np.asarray(ours) != theirs).any()
    report = maille.write(io.BytesIO(), mesh, error={"T": 0.001}, bits={"v": 8})
    assert {each.name: each.lossless for each in report.arrays} == {"T": False, "v": False, "p": True, "id": True}
    assert report.arrays[0].maximum_error <= 0.001


@pytest.mark.parametrize("options, sentence", [
    (dict(error=0), "above 0"), (dict(error=-1), "above 0"), (dict(error=float("nan")), "above 0"),
    (dict(bits=0.5), "whole number"), (dict(bits=60), "from 1 to 52"), (dict(pointwise_error={"T": 2}), "below 1"),
    (dict(error={"temperature": 1}), "no array 'temperature'; there are: position, T"),
    (dict(error=1, bits=4), "another bound"), (dict(mode="fast"), "no 'fast'; there are: single, stream, random"),
    (dict(effort=0), "from 1"), (dict(effort="high"), "from 1"), (dict(order="some"), "'keep' or 'any'"),
    (dict(for_="fun"), "no 'fun'; there are: web"), (dict(pieces="some"), "pieces: 'auto'"),
    (dict(pieces=5, mode="single"), "pieces: they are for volumes"),
    (dict(provenance=5), "a string is wanted"),
])
def test_options_that_make_no_sense_are_named(options, sentence):
    with pytest.raises((ValueError, TypeError), match=sentence):
        maille.encode(grid(3), **options)


COMMAND = [
    (dict(), []), (dict(error=0.01), ["-e", "0.01"]), (dict(bits=12, effort=7), ["--bits", "12", "-7"]),
    (dict(relative_error=0.001, order="keep"), ["--rel-error", "0.001", "--keep-order"]),
    (dict(mode="single"), ["--mode", "single"]), (dict(for_="web"), ["--for", "web"]),
    (dict(for_="print"), ["--for", "print"]), (dict(for_="archive"), ["--for", "archive"]),
    (dict(for_="web", bits={"position": 11}), ["--for", "web", "--bits", "11"]),
]
VOLUME = COMMAND + [
    (dict(pieces=100), ["--pieces", "100"]), (dict(pieces="auto"), ["--pieces", "auto"]),
    (dict(for_="simulation"), ["--for", "simulation"]), (dict(error={"T": 0.01}), ["-e", "T=0.01"]),
    (dict(order="any"), ["--any-order"]), (dict(psnr={"v": 60}), ["--psnr", "v=60"]),
    (dict(norm_error={"v": 0.1}), ["--norm-error", "v=0.1"]),
    (dict(pointwise_error={"p": 0.01}), ["--pw-rel-error", "p=0.01"]),
]
SURFACE = COMMAND + [(dict(mode="random"), ["--mode", "random"]), (dict(for_="scan"), ["--for", "scan"]),
                     (dict(mode="stream"), ["--mode", "stream"]), (dict(bits={"normals": 9}), ["--bits", "normals=9"])]


@pytest.mark.parametrize("mesh, name, cases", [(grid(8), "x.vtk", VOLUME), (
    sphere(20, point_data={"normal": maille.Array(sphere(20).points.astype("f4"), role="normal")}), "x.ply", SURFACE)])
def test_files_are_those_of_the_command(tmp_path, tool, mesh, name, cases):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", maille.MailleWarning)
        assert maille.write(tmp_path / name, mesh) is None
    mesh = maille.read(tmp_path / name)
    for options, words in cases:
        tool("compress", "-q", "-f", "--no-provenance", *words, tmp_path / name, tmp_path / "theirs.maille")
        assert maille.encode(mesh, **options) == (tmp_path / "theirs.maille").read_bytes(), words
        maille.write(tmp_path / "ours.maille", mesh, **options)
        assert (tmp_path / "ours.maille").read_bytes() == (tmp_path / "theirs.maille").read_bytes(), words


def test_arrays_are_chosen():
    data = maille.encode(grid(4))
    assert list(maille.decode(data, arrays=["v"]).point_data) == ["v"]
    assert maille.decode(data, arrays=[]).arrays == ()
    with pytest.raises(maille.Error, match="no array 'w'"):
        maille.decode(data, arrays=["w"])
    with pytest.raises(TypeError, match="a list of names"):
        maille.decode(data, arrays="v")


def test_steps_of_time(tmp_path, tool):
    path = tmp_path / "flow.maille"
    meshes = [grid(5, point_data={"T": grid(5).point_data["T"] + t}) for t in range(4)]
    maille.write(path, meshes[0], time=-0.5)
    assert maille.info(path).time == -0.5 and same(maille.read(path, time=-0.5), meshes[0])
    for t in (1, 2, 3):
        assert maille.append(path, meshes[t], time=0.5 * t, error={"T": 0.001} if t == 3 else None) == t
    about = maille.info(path)
    assert [step.time for step in about.steps] == [0.5, 1.0, 1.5]
    for t in (0, 1, 2):
        assert same(maille.read(path, step=t), meshes[t])
    assert np.abs(maille.read(path, step=-1).point_data["T"] - meshes[3].point_data["T"]).max() <= 0.001
    assert same(maille.read(path, step=-2), meshes[2]) and same(maille.read(path, step=-4), meshes[0])
    assert same(maille.read(path, time=1.0), meshes[2])
    assert maille.open(path).times == (0.5, 1.0, 1.5)
    with maille.open(path, step=2) as file:
        assert same(file.read(), meshes[2])
        assert (file.box([0, 0, 0], [1, 1, 1]).point_data["T"] > 1).any()
    with pytest.raises(maille.Error, match="no step at time 7; the nearest are 1.5, 1.0"):
        maille.read(path, time=7)
    with pytest.raises(maille.Error):
        maille.read(path, step=9)
    with pytest.raises(IndexError):
        maille.read(path, step=-9)
    with pytest.raises(ValueError, match="only one"):
        maille.read(path, step=1, time=0.5)
    with pytest.raises(maille.Error):
        maille.append(path, grid(4), time=9)
    tool("decompress", "-q", "--step", "2", path, tmp_path / "two.vtu")
    assert same(maille.read(tmp_path / "two.vtu"), meshes[2])


def test_other_formats_are_read_and_written(tmp_path):
    ball = sphere(8)
    for name in ("x.ply", "x.obj", "x.off", "x.stl", "x.vtp", "x.glb"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", maille.MailleWarning)
            maille.write(tmp_path / name, ball)
            back = maille.read(tmp_path / name)
        assert back.cell_count == ball.cell_count and back.point_count == ball.point_count, name
    maille.write(tmp_path / "x.vtu", grid(3))
    assert same(maille.read(tmp_path / "x.vtu"), grid(3))
    (tmp_path / "unnamed").write_bytes((tmp_path / "x.ply").read_bytes())
    assert maille.read(tmp_path / "unnamed", format="ply").cell_count == ball.cell_count
    with pytest.warns(maille.MailleWarning, match="x.stl"):
        maille.write(tmp_path / "x.stl", sphere(8, point_data={"h": np.arange(ball.point_count)}))
    with pytest.raises(maille.Error, match="says no format that can be written: .maille"):
        maille.write(tmp_path / "x.docx", ball)
    with pytest.raises(maille.Error, match="bits: for .maille files alone"):
        maille.write(tmp_path / "x.ply", ball, bits=12)
    assert {"ply", "vtu", "exodus"} <= {each.name for each in maille.formats()}


def test_reading_a_foreign_file_chooses_arrays(tmp_path):
    maille.write(tmp_path / "x.vtu", grid(3))
    assert [each.name for each in maille.read(tmp_path / "x.vtu", arrays=["p"]).arrays] == ["p"]


def test_no_file_is_left_half_written(tmp_path):
    def stop(stage, fraction):
        raise RuntimeError("enough")

    maille.write(tmp_path / "x.maille", sphere(4))
    before = (tmp_path / "x.maille").read_bytes()
    with pytest.raises((RuntimeError, OSError)):
        maille.write(tmp_path / "x.maille", grid(40), effort=9, progress=stop)
    assert maille.verify(tmp_path / "x.maille") == []
    assert os.listdir(tmp_path) == ["x.maille"] and len(before) > 0


def test_importing_takes_no_other_package():
    code = ("import sys, maille; "
            "assert not {'meshio', 'trimesh', 'vtkmodules', 'pyvista', 'matplotlib'} & set(sys.modules), sys.modules")
    subprocess.run([sys.executable, "-c", code], check=True)
