"""What the tests share: the command that they compare with, meshes, and the folder of real ones."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import maille

ROOT = Path(__file__).resolve().parents[3]
DATA = Path(os.environ.get("MAILLE_TEST_DATA", ROOT / "build" / "data"))


@pytest.fixture(scope="session")
def tool():
    """Runs the command; gives what it printed."""
    path = Path(os.environ.get("MAILLE_TOOL", ROOT / "build" / "release" / "tool" / "maille"))
    if not path.exists():
        pytest.skip(f"{path} is not there: build the target maille_tool")

    def run(*arguments):
        done = subprocess.run([path, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    run.path = path
    return run


def grid(n=6, fields=True, **more):
    """Bent hexahedra, n in each direction, with fields."""
    axis = np.arange(n + 1, dtype=np.float32)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    points = np.column_stack([(x + 0.1 * np.sin(y)).ravel(), (y + 0.2 * np.cos(z)).ravel(), z.ravel()])
    first = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)[:-1, :-1, :-1].ravel()
    row, layer = n + 1, (n + 1) ** 2
    around = np.array([0, 1, 1 + row, row])
    corners = np.concatenate([around, around + layer])
    data = {}
    if fields:
        data = {"point_data": {"T": np.sin(points[:, 0]).astype(np.float64), "v": points * 2},
                "cell_data": {"p": np.arange(len(first), dtype=np.float32) ** 2, "id": np.arange(len(first))}}
    data.update(more)
    return maille.Mesh(points.astype(np.float32), {"hexahedron": first[:, None] + corners}, **data)


def sphere(n=24, **more):
    """A triangulated sphere with two poles."""
    up, around = np.meshgrid(np.linspace(0, np.pi, n + 1)[1:-1], np.arange(2 * n) * np.pi / n, indexing="ij")
    ring = np.column_stack([np.sin(up).ravel() * np.cos(around).ravel(), np.sin(up).ravel() * np.sin(around).ravel(),
                            np.cos(up).ravel()])
    points = np.vstack([ring, [[0, 0, 1], [0, 0, -1]]])
    width, north, south = 2 * n, len(ring), len(ring) + 1
    triangles = []
    for i in range(width):
        j = (i + 1) % width
        triangles.append([north, i, j])
        for k in range(n - 2):
            a, b, c, d = k * width + i, k * width + j, (k + 1) * width + i, (k + 1) * width + j
            triangles += [[a, c, b], [b, c, d]]
        triangles.append([south, (n - 2) * width + j, (n - 2) * width + i])
    return maille.Mesh(points, {"triangle": np.array(triangles)}, **more)


def all_kinds():
    """One mesh with blocks of every shape: fixed, polygons, mixed, polyhedra; with names."""
    points = np.array([[x, y, z] for z in (0, 1, 2) for y in (0, 1) for x in (0, 1)], dtype=float)
    cube = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]]
    polyhedron = maille.Block(
        "polyhedron", np.array([point for face in cube for point in face]), np.array([0, 24]),
        face_sizes=np.array([4] * 6), cell_faces=np.array([0, 6]), name="cell")
    mixed = maille.Block("mixed", np.array([4, 5, 7, 6, 8, 9, 11, 10, 0, 1, 3]), np.array([0, 8, 11]),
                         types=np.array([12, 5]), name="both")
    return maille.Mesh(points, [("tetra", [[0, 1, 2, 4]], "corner"), ("polygon", [[0, 1, 3], [4, 5, 7, 6]]), mixed,
                                polyhedron],
                       cell_data={"a": np.arange(6, dtype=np.int16)}, metadata=[("unit", "mm")])


def same(a, b):
    """Are all values of two meshes equal, in the same order?"""
    assert a.differences(b, same_order=True) == []
    return True
