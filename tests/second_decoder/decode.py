"""Decodes a .maille file, as docs/format.md tells.

The core is what lies beside this file and does not compare (check.py, compare.py, meshes.py and __main__.py do):
container    sections 2 to 7                    single, charts          11 and 15.1, 17
entropy      10.2 to 10.5, ask of 16.6          fans, around            12.1 to 12.3 and 12.5
maps         10.6, digits of 16.1               arrays                  13.1, 13.2
description  11.1                               surface, normals        12.4, 13.3 to 13.5 and 13.7
stream       16.1                               face_normals            13.6
cells        16.2 to 16.6                       values                  16.7
more/ adds what its __init__.py lists, once it is imported. Nothing reads 14 (efforts 7 to 9), 16.8 and 16.9."""
import numpy as np
import charts
import entropy
import single
import stream
from container import Container

def decode(path):
    with open(path, "rb") as file:
        container = Container(file.read())
    entropy.OPENED.clear()
    with np.errstate(all="ignore"):
        mesh = {0: single, 1: stream, 2: charts}[container.mode].decode(container)
    assert all(sequence.ended() for sequence in entropy.OPENED), "a sequence was not read to its end"
    return mesh
