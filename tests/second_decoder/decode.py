"""Decodes a .maille file, as docs/format.md tells."""

import charts
import single
import stream
from container import Container


def decode(path):
    with open(path, "rb") as file:
        container = Container(file.read())
    return {0: single, 1: stream, 2: charts}[container.mode].decode(container)
