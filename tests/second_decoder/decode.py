"""Decodes a .maille file, as docs/format.md tells: modes single at efforts 1 to 6, random, and stream with hexahedra and
tetrahedra. This folder reads these without more/, which adds what its __init__.py lists when it is imported."""
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
