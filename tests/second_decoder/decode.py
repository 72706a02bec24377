"""Decodes a .maille file, as docs/format.md tells."""
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
