"""Types: of the package itself, of its stub, and as users' checkers see them."""

import subprocess
import sys
from pathlib import Path

import pytest

import maille

pytest.importorskip("mypy")
here = Path(__file__).parent


def run(*words):
    done = subprocess.run([sys.executable, "-m", *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True)
    return done.returncode, done.stdout


def test_stubtest_is_clean(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, text = run("mypy.stubtest", "maille", "--mypy-config-file", here / "mypy.ini", "--allowlist",
                     here / "stubtest-allowed.txt", "--ignore-unused-allowlist")
    assert code == 0, text


def test_the_package_is_typed_strictly(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, text = run("mypy", "--config-file", here / "mypy.ini", Path(maille.__file__).parent)
    assert code == 0, text


def test_users_get_types(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "user.py").write_text('''import maille
mesh = maille.read("x.maille", arrays=["T"])
reveal_type(mesh)
reveal_type(mesh.point_count)
with maille.open("x.maille") as file:
    reveal_type(file.box([0, 0, 0], [1, 1, 1]))
maille.write("x.maille", mesh, erorr=1)
''')
    code, text = run("mypy", "--config-file", here / "mypy.ini", "user.py")
    assert '"maille._mesh.Mesh"' in text and '"builtins.int"' in text and "erorr" in text and code == 1, text
