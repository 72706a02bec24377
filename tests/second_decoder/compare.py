"""Compares what this decoder makes of files with what `maille decompress` makes of them, bit for bit."""
import base64
import re
import subprocess
from collections import Counter
import numpy as np
from description import CELLS, POINTS, TWINS

TYPES = {f"{name}{8 * size}": f"{kind}{size}" for name, kind in (("Int", "i"), ("UInt", "u")) for size in (1, 2, 4, 8)}
TYPES |= {"Float32": "f4", "Float64": "f8"}


def read_vtu(path):
    """Arrays of a VTU file as the command writes it, by the element around them and their names."""
    with open(path, "rb") as file:
        data = file.read()
    mark = b'<AppendedData encoding="raw">'
    head, tail = data.split(mark, 1)
    begin = len(head) + len(mark) + tail.index(b"_") + 1
    arrays, around = {}, None
    for tag, text in re.findall(r"(<[^>]*>)([^<]*)", head.decode("utf-8", "surrogateescape")):
        name = tag.split()[0].strip("<>")
        if name in ("FieldData", "Points", "PointData", "CellData", "Cells"):
            around = name
        attributes = dict(re.findall(r'([\w:]+)="([^"]*)"', tag))
        if name != "DataArray" or attributes["type"] not in TYPES:
            continue
        # Short field data stand in the tag, for meshio.
        block = data[begin + int(attributes["offset"]) :] if "offset" in attributes else base64.b64decode(text)
        size = int.from_bytes(block[:8], "little")
        values = np.frombuffer(block[8 : 8 + size], "<" + TYPES[attributes["type"]])
        arrays[around, attributes["Name"]] = values.reshape(-1, int(attributes.get("NumberOfComponents", "1")))
    return arrays


def decompressed(command, path, folder, *options):
    out = folder + "/expected.vtu"
    subprocess.run([command, "decompress", "-qf", path, out, *options], check=True, stderr=subprocess.DEVNULL)
    return read_vtu(out)


def same(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def differences(mesh, vtu):
    """Names of what is not the same."""
    found = []
    cells = mesh.cells()
    own = {"connectivity": [n for _, nodes in cells for n in nodes], "types": [t for t, _ in cells]}
    own["offsets"] = np.cumsum([len(nodes) for _, nodes in cells])
    for name, values in own.items():
        if not np.array_equal(vtu["Cells", name].reshape(-1).astype("i8"), np.array(values, "i8")):
            found.append(name)
    for i, (array, values) in enumerate(zip(mesh.arrays, mesh.values)):
        around = {POINTS: "PointData", TWINS: "PointData", CELLS: "CellData"}.get(array.domain, "FieldData")
        key = (around, array.name) if i else ("Points", "Points")
        if key not in vtu or not same(np.ascontiguousarray(values), vtu[key]):
            found.append(f"array {array.name}" if i else "positions")
    return found


def triangles_of_level(mesh, level):
    """Of mode random: how often each triangle, as three positions, is in the charts of a coarser level."""
    patches = [patch for of, patch in mesh.coarser if of == level]
    triangles = ((patch.values[0], nodes) for patch in patches for block in patch.blocks for _, nodes in block)
    return Counter(tuple(sorted(points[p].tobytes() for p in nodes)) for points, nodes in triangles)


def triangles_of(vtu):
    points = vtu["Points", "Points"]
    faces = vtu["Cells", "connectivity"].reshape(-1, 3)
    return Counter(tuple(sorted(points[p].tobytes() for p in nodes)) for nodes in faces)
