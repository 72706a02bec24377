"""What the documentation shows runs: doctests, the recipes of docs/python.md, README.md, the example."""

import doctest
import importlib
import os
import re
import subprocess
import sys

import pytest
from conftest import ROOT, grid, sphere

import maille

MODULES = ["maille"] + [f"maille._{name}" for name in ("codec", "errors", "file", "mesh", "meshio", "stream", "vtk")]


@pytest.mark.parametrize("name", MODULES)
def test_doctests(name):
    if name == "maille._meshio":
        pytest.importorskip("meshio")
    results = doctest.testmod(importlib.import_module(name))
    assert results.failed == 0 and (results.attempted > 0 or name == "maille._vtk")


def test_everything_public_is_documented():
    for name in maille.__all__:
        each = getattr(maille, name)
        if name == "CELL_TYPES":
            continue
        assert each.__doc__, name
        if isinstance(each, type):
            for member, what in vars(each).items():
                if not member.startswith("_") and (callable(what) or isinstance(what, property)):
                    assert what.__doc__, f"{name}.{member}"


def blocks(path):
    """Title of the section, and the code below it."""
    title, found = "", []
    for part in re.split(r"(^#+ .*$)", path.read_text(), flags=re.M):
        if part.startswith("#"):
            title = part.lstrip("# ")
        found += [(title, code) for code in re.findall(r"^```python\n(.*?)^```", part, flags=re.M | re.S)]
    return found


# Packages that Debian 12 has not: their recipes are compiled, not run.
ELSEWHERE = ("pyvista", "trimesh", "open3d")
RECIPES = blocks(ROOT / "docs" / "python.md")


@pytest.fixture
def files(tmp_path, monkeypatch):
    """The files that the recipes speak of."""
    monkeypatch.chdir(tmp_path)
    maille.write("scan.maille", sphere(40), mode="random")
    maille.write("scan.ply", sphere(40))
    maille.write("part.maille", sphere(20))
    flow = grid(8)
    maille.write("flow.maille", flow, pieces=200)
    maille.write("flow.vtu", flow)
    maille.write("long.maille", flow)
    maille.write("run.maille", flow)
    for step in (1, 2):
        maille.append("run.maille", grid(8, cell_data={"p": flow.cell_data["p"] * step}), time=step / 10)
    os.mkdir("results")
    for name in "ab":
        maille.write(f"results/{name}.vtu", flow)


@pytest.mark.parametrize("title, code", RECIPES, ids=[title for title, _ in RECIPES])
def test_recipes(title, code, files):
    compile(code, title, "exec")
    wanted = set(re.findall(r"^\s*(?:import|from) (\w+)", code, flags=re.M))
    if wanted & set(ELSEWHERE):
        pytest.skip(f"{', '.join(wanted & set(ELSEWHERE))}: not in Debian 12")
    for name in wanted - {"maille"}:
        pytest.importorskip(name)
    if "https://" in code:
        pytest.skip("needs a web server; test_parts.py has one")
    with open("recipe.py", "w") as file:  # on its own, as pools of processes want it
        file.write(code)
    done = subprocess.run([sys.executable, "recipe.py"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          env={**os.environ, "MPLBACKEND": "agg"})
    assert done.returncode == 0, done.stderr


def test_there_are_ten_recipes():
    assert len(RECIPES) >= 10


def test_the_readme_runs(files):
    ours = [code for _, code in blocks(ROOT / "README.md") if "maillevtk" not in code]  # that is for make test-vtk
    assert ours
    for code in ours:
        exec(code, {})


def test_the_example_runs(tmp_path):
    pytest.importorskip("matplotlib")
    done = subprocess.run([sys.executable, ROOT / "examples" / "python" / "tour.py", tmp_path], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, env={**os.environ, "MPLBACKEND": "agg"})
    assert done.returncode == 0, done.stderr
    pictures = sorted(path.name for path in tmp_path.glob("*.png"))
    assert pictures == ["bounds.png", "levels.png", "slice.png", "surface.png", "times.png"]
    assert all((tmp_path / name).stat().st_size > 5000 for name in pictures)
