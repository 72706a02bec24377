#!/usr/bin/python3
"""check.py COMMAND TESTS_FOLDER DATA_FOLDER [FIRST COUNT]: this decoder and the command's must agree on golden, real
and random files, or on random files of COUNT seeds alone."""

import os
import subprocess
import sys
import tempfile
import time
from collections import Counter

try:
    import numpy as np
except ImportError:
    print("skipped: the second decoder needs numpy (python3-numpy; scripts/setup installs it)")
    sys.exit(77)

import compare
import meshes
from container import Unread
from decode import decode
from description import NODES

REAL = {  # options of `maille compress`
    "tri/blobby.off": ["-1"],
    "tri/mech-holes-shark.off": ["-5"],
    "poly/fertility_quad.off": ["-1", "-5 --error 0.01"],
    "poly/office_chair.obj": ["-1", "-5"],
    "poly/viewpoint_cow_poly.obj": ["-2"],
    "poly/Torso.vtp": ["-1"],
    "textured/spot.obj": ["-1", "-5 --keep-order"],
    "tri/featuretype.STL": ["-1"],
    "mixed/AngularSector.vtk": ["-1"],
    "tet/post.vtk": ["-1 --mode stream"],
    "hex/can.vtu": ["-1 --mode stream"],
}
CUBES = "mixed/simple-cube-multi-element-order1.e"
REAL[CUBES] = ["-1 --mode single", "-5 --mode single", "-1 --mode stream --any-order"]
VOLUMES = ["-1", "-5", "-1 --any-order", "-5 --any-order", "-5 --pieces 20", "-1 --rel-error 0.001"]
VOLUMES += ["-5 --any-order --rel-error 0.001", "-2 --pieces 40 --any-order", "-1 --bits 12", "-9", "-3"]

# Seeds that found faults of this decoder or of the text: zeros of refined numbers by component, sums of what is around
# normals, their numbers before they are rounded; when the cells of questions become more (16.6).
FOUND, FOUND_VOLUMES = [3057, 4220, 4268], [8011]


class Checks:
    def __init__(self, command, folder):
        self.command, self.folder = command, folder
        self.done, self.wrong, self.unread = 0, [], Counter()

    def file(self, name, path, *options):
        """Whether it was read."""
        try:
            found = compare.differences(decode(path), compare.decompressed(self.command, path, self.folder, *options))
        except Unread as what:
            self.unread[str(what)] += 1
            return False
        except Exception as error:
            found = [repr(error)]
        self.done += 1
        if found:
            self.wrong.append(name)
            print(f"{name}: the second decoder differs: {', '.join(found)}", flush=True)
        return True

    def mesh(self, name, path, options):
        out = os.path.join(self.folder, "mesh.maille")
        run = [self.command, "compress", "-qf", "--no-provenance", *options.split(), path, out]
        subprocess.run(run, check=True, stderr=subprocess.DEVNULL)
        self.file(f"{name} {options}", out)


def golden(checks, folder):
    """Those that the core does not read are given back."""
    left = []
    for mode in ("single", "stream", "random"):
        for name in sorted(os.listdir(os.path.join(folder, mode))):
            file = f"{mode}/{name}", os.path.join(folder, mode, name)
            if name.endswith(".maille") and not checks.file(*file):
                left.append(file)
    print(f"the core alone: {checks.done} golden files", flush=True)
    checks.unread.clear()
    return left


def real(checks, folder):
    for name, all_options in REAL.items():
        path = os.path.join(folder, name)
        if not os.path.exists(path):
            print(f"skipped: {name} is not there (scripts/data)")
            continue
        for options in all_options:
            checks.mesh(name, path, options)


def random(checks, first, count):
    path = os.path.join(checks.folder, "random.vtu")
    for seed in range(first, first + count):
        rng = np.random.default_rng(seed)
        meshes.surface(rng, path)
        loss = ["", "", " --keep-order", " --rel-error 0.001", " --bits 10 --keep-order"][seed % 5]
        mode = "random" if seed % 4 == 3 else "single"
        checks.mesh(f"random {seed}", path, f"-{[1, 2, 3, 5, 6][seed % 7 % 5]} --mode {mode}{loss}")


def volumes(checks, first, count):
    path = os.path.join(checks.folder, "random.vtu")
    for seed in range(first, first + count):
        meshes.volume(np.random.default_rng(seed), path)
        checks.mesh(f"volume {seed}", path, f"--mode stream {VOLUMES[seed % len(VOLUMES)]}")


def all_types(checks):
    path = os.path.join(checks.folder, "types.vtu")
    meshes.all_types(np.random.default_rng(1), path, {type_: n for type_, n in NODES.items() if n})
    for options in ("-1", "-5", "-5 --any-order", "-2 --any-order"):
        checks.mesh("types", path, f"--mode stream {options}")


def quadratic(checks):
    """Nodes behind corners of cells by patterns, with mixed decisions (16.6): once the text did not say enough of them."""
    path = os.path.join(checks.folder, "quadratic.vtu")
    for seed, options in enumerate(("-1", "-5", "-5 --any-order", "-9")):
        meshes.quadratic(np.random.default_rng(seed), path)
        checks.mesh("quadratic", path, f"--mode stream {options}")


def levels(checks):
    """Coarser levels of mode random: the triangles of their charts."""
    path, out = os.path.join(checks.folder, "levels.vtu"), os.path.join(checks.folder, "levels.maille")
    meshes.terrain(np.random.default_rng(1), path, 60)
    subprocess.run([checks.command, "compress", "-qf", "--mode", "random", "-2", path, out], check=True)
    own = compare.triangles_of_level(decode(out), 1)
    subprocess.run([checks.command, "extract", "-qf", "--level", "1", out, path], check=True)
    checks.done += 1
    if own != compare.triangles_of(compare.read_vtu(path)):
        checks.wrong.append("levels")
        print("the second decoder differs: level 1 of a file of mode random", flush=True)


def lines_of_decoder():
    """Of the core and of more/, without what compares them."""
    own, others = os.path.dirname(os.path.abspath(__file__)), {"check.py", "compare.py", "meshes.py", "__main__.py"}
    for folder in (own, os.path.join(own, "more")):
        files = [name for name in os.listdir(folder) if name.endswith(".py") and name not in others]
        yield sum(len(open(os.path.join(folder, name)).readlines()) for name in files)


def main():
    command, tests, data = sys.argv[1:4]
    first, count = (int(x) for x in sys.argv[4:6]) if len(sys.argv) > 5 else (0, 150)
    begin = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        checks = Checks(command, folder)
        left = golden(checks, os.path.join(tests, "golden")) if len(sys.argv) <= 5 else []
        import more  # noqa: F401: adds what goes beyond the core
        for file in left:
            checks.file(*file)
        if len(sys.argv) <= 5:
            real(checks, data)
            levels(checks)
            all_types(checks)
            quadratic(checks)
            for seed in FOUND:
                random(checks, seed, 1)
            for seed in FOUND_VOLUMES:
                volumes(checks, seed, 1)
        random(checks, first, count)
        volumes(checks, first, count // 5)
    for what, n in checks.unread.items():
        print(f"not read by it: {n} files with {what}")
    took = f"{time.process_time() - begin:.0f} s"
    lines = "{} + {}".format(*lines_of_decoder())
    print(f"second decoder, of {lines} lines: {checks.done} files, {len(checks.wrong)} differ; {took}")
    sys.exit(1 if checks.wrong else 0)


if __name__ == "__main__":
    main()
