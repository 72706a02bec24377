"""Meshes of any size, some thousand cells at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, Optional

from . import _core
from ._arrays import NDArray
from ._codec import MEMORY, input_of


class StreamArray(NamedTuple):
    """An array that portions have."""

    name: str
    domain: str
    dtype: Any
    components: int


@dataclass(frozen=True, eq=False)
class Portion:
    """Some thousand cells, and the points that come up with them. All arrays are read-only.

    Points have numbers in the whole mesh (``points``, ``connectivity``), and slots: small numbers
    (``point_slots``, ``slots``) below ``slot_count``, free again behind the portion in which the point ends. Who
    wants positions of points of earlier portions keeps a table by slot, which stays small: docs/python.md shows it.
    """

    blocks: tuple[tuple[int, str, int], ...]
    """That begin here: number of the first cell, name, VTK's number of the type (255: mixed)."""
    first_cell: int
    types: NDArray
    """(cells,): VTK's numbers."""
    offsets: NDArray
    """(cells + 1,): where cells begin in the connectivity."""
    connectivity: NDArray
    """Numbers of points in the mesh."""
    slots: NDArray
    """The same as slots."""
    face_sizes: NDArray
    """Polyhedra: as of :class:`Block`; else empty."""
    cell_faces: NDArray
    cell_data: dict[str, NDArray]
    points: NDArray
    """Numbers of the points that come up here."""
    point_slots: NDArray
    """Their slots."""
    positions: NDArray
    """(points, 3)."""
    point_data: dict[str, NDArray]
    """Their values."""
    ended_slots: NDArray
    """Of points that no later portion uses."""
    slot_count: int
    """So far."""

    def __len__(self) -> int:
        """The number of cells."""
        return len(self.types)


class Stream:
    """The portions of a file of mode stream, in their order: ``for portion in maille.stream(path)``."""

    def __init__(self, core: _core.StreamReader) -> None:
        self._core = core
        description = core.description()
        self.positions = StreamArray(*description["positions"])
        """What is known of the positions."""
        self.arrays = tuple(StreamArray(*each) for each in description["arrays"])
        """The arrays on points and cells."""
        self.metadata: list[tuple[str, str]] = description["metadata"]

    def __iter__(self) -> Iterator[Portion]:
        return self

    def __next__(self) -> Portion:
        portion = self._core.next()
        if portion is None:
            raise StopIteration
        portion["blocks"] = tuple(portion["blocks"])
        return Portion(**portion)


def stream(source: Any, *, step: int = 0, any_order: bool = False, memory: Optional[int] = None) -> Stream:
    """Decodes a file of mode stream in portions, in memory that does not grow with the mesh.

    :param source: as of :func:`read`.
    :param step: of time.
    :param any_order: take files whose order stands apart, too, in the order in which cells are in the file.
    :param memory: bytes that may be held at once.
    :raises maille.Error: the file is damaged (what came before is whole), or of another mode.

    >>> import maille
    >>> mesh = maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], {"tetra": [[0, 1, 2, 3]]})
    >>> for portion in maille.stream(maille.encode(mesh)):
    ...     print(len(portion), portion.connectivity)
    1 [0 1 2 3]
    """
    return Stream(_core.StreamReader(input_of(source), step, any_order, MEMORY if memory is None else memory))
