#!/usr/bin/env python3
"""A tour of maille in Python, with a picture at each stop: python3 tour.py [FOLDER]

A flow around a bend is made up, compressed within bounds, read in parts and over time; a surface is looked at from near
and far. Needs numpy and matplotlib.
"""

import sys
from pathlib import Path

import matplotlib
import numpy as np

import maille

matplotlib.use("agg")
import matplotlib.pyplot as plt  # noqa: E402  (behind the choice of what draws)

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "tour")
folder.mkdir(exist_ok=True)


def bend(around=60, across=16):
    """Hexahedra of a quarter of a pipe's bend: points (n, 3), corners (m, 8)."""
    angle, radius, height = np.meshgrid(np.linspace(0, np.pi / 2, around + 1), np.linspace(1, 2, across + 1),
                                        np.linspace(-0.5, 0.5, across + 1), indexing="ij")
    points = np.column_stack([(radius * np.cos(angle)).ravel(), (radius * np.sin(angle)).ravel(), height.ravel()])
    number = np.arange(len(points)).reshape(angle.shape)
    i, j, k = (part.ravel() for part in np.mgrid[:around, :across, :across])
    face = [(0, 0), (1, 0), (1, 1), (0, 1)]
    return points, np.column_stack([number[i + a, j + b, k + c] for c in (0, 1) for a, b in face])


def fields(points, cells, t):
    """Velocity and temperature on points, pressure on cells."""
    radius = np.hypot(points[:, 0], points[:, 1])
    profile = (1 - 4 * points[:, 2] ** 2) * (1 - (2 * radius - 3) ** 2)
    swirl = 0.2 * np.sin(9 * radius + 5 * t)
    velocity = np.column_stack([-points[:, 1], points[:, 0], swirl]) / radius[:, None] * profile[:, None]
    temperature = 300 + 50 * np.exp(-8 * ((radius - 1.5 - 0.2 * np.sin(4 * t)) ** 2 + points[:, 2] ** 2))
    pressure = (radius[cells].mean(axis=1) ** 2).astype(np.float32)
    return {"point_data": {"velocity": velocity, "T": temperature}, "cell_data": {"p": pressure}}


def panel(title, picture, name):
    """One picture, seen from above."""
    figure, axes = plt.subplots(figsize=(6, 5))
    axes.set_title(title)
    axes.set_aspect("equal")
    picture(axes)
    figure.savefig(folder / name, dpi=80)
    plt.close(figure)


# 1. From arrays of numpy to a file, within bounds that are never exceeded.
points, cells = bend()
mesh = maille.Mesh(points, {"hexahedron": cells}, **fields(points, cells, 0))
path = folder / "bend.maille"
exact = len(maille.encode(mesh))
report = maille.write(path, mesh, error={"T": 0.01, "velocity": 1e-3}, pieces=2000)
print(f"{mesh}\nbit for bit {exact} bytes; T within 0.01, velocity within 0.001: {report.file_bytes} bytes")
for array in report.arrays:
    print(f"  {array.name}: {array.coded_bytes} of {array.raw_bytes} bytes, largest error {array.maximum_error:.2g}")

# 2. What is within: the boundary as triangles, coloured by a field.
mesh = maille.read(path)
triangles = mesh.triangles()
top = triangles[mesh.points[triangles][:, :, 2].min(axis=1) > 0.49]
panel("temperature on the upper side", name="surface.png",
      picture=lambda axes: axes.tripcolor(mesh.points[:, 0], mesh.points[:, 1], top, mesh.point_data["T"],
                                          shading="gouraud"))

# 3. A part of the file: only the pieces that a plane passes, or where it is hot, are decoded.
with maille.open(path) as file:
    cut = file.extract(plane=([0, 0, 0.02], [0, 0, 1])).slice([0, 0, 0.02], [0, 0, 1])
    hot = file.where("T", low=340)
    print(f"{file.pieces} pieces; {hot.cell_count} of {mesh.cell_count} cells are hotter than 340")
panel("speed in the middle", name="slice.png",
      picture=lambda axes: axes.tripcolor(cut.points[:, 0], cut.points[:, 1], cut.triangles(),
                                          np.linalg.norm(cut.point_data["velocity"], axis=1), shading="gouraud"))

# 4. What a bound costs.
bounds = 10.0 ** np.arange(-6, 1)
exactly = maille.Mesh(points, {"hexahedron": cells}, point_data={"T": fields(points, cells, 0)["point_data"]["T"]})
sizes = [len(maille.encode(exactly, error={"T": bound})) for bound in bounds]
panel("bytes by the error allowed for T", name="bounds.png",
      picture=lambda axes: (axes.set_aspect("auto"), axes.semilogx(bounds, sizes, "o-"), axes.set_xlabel("error"),
                            axes.set_ylabel("bytes")))

# 5. Steps of time behind the mesh, each read alone.
series = folder / "series.maille"
maille.write(series, maille.Mesh(points, {"hexahedron": cells}, **fields(points, cells, 0)), error={"T": 0.01})
for t in np.arange(1, 9) / 8:
    later = maille.Mesh(points, {"hexahedron": cells}, **fields(points, cells, t))
    maille.append(series, later, time=t, error={"T": 0.01})
with maille.open(series, arrays=["T"]) as file:
    place = int(np.argmin(np.linalg.norm(points - [1.2, 1.2, 0], axis=1)))
    times = (0.0, *file.times)
    values = [file.read(step=step).point_data["T"][place] for step in range(len(times))]
panel("T at a point over time", name="times.png",
      picture=lambda axes: (axes.set_aspect("auto"), axes.plot(times, values, "o-"), axes.set_xlabel("time")))

# 6. A surface with levels of detail, seen from near and far.
n = 300
u, v = (part.ravel() for part in np.meshgrid(np.linspace(0, 2 * np.pi, n), np.linspace(0, 2 * np.pi, n)))
bumps = 1 + 0.1 * np.sin(20 * u) * np.sin(16 * v)
torus = np.column_stack([(3 + bumps * np.cos(v)) * np.cos(u), (3 + bumps * np.cos(v)) * np.sin(u), bumps * np.sin(v)])
corner = np.arange(n * n).reshape(n, n)
quads = np.column_stack([each.ravel() for each in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])])
scan = folder / "torus.maille"
maille.write(scan, maille.Mesh(torus.astype(np.float32), {"quad": quads}), mode="random", effort=2)
with maille.open(scan) as file:
    views = [file.extract(level=level) for level in range(len(file.levels))]
    nearest = file.nearest([5, 0, 0])
print(f"levels of {[view.cell_count for view in views]} faces; "
      f"nearest to (5, 0, 0): {np.round(nearest.position, 3)}")
coarse = views[-1]
panel(f"the coarsest level: {coarse.cell_count} triangles", name="levels.png",
      picture=lambda axes: axes.triplot(coarse.points[:, 0], coarse.points[:, 1], coarse.triangles(), linewidth=0.3))
