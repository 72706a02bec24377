"""What compressing may lose, and how it goes about: the options of the command under the same names."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Callable, Optional, Union

from . import _core
from ._errors import Error
from ._mesh import Array, Mesh

Bound = Union[float, Mapping[str, float], None]
"""A number for the positions, or a mapping of names of arrays ("position": the positions) and numbers."""

MODES = {"single": 0, "stream": 1, "random": 2}

# As Tolerance::Kind has them (maille/encode.h).
_kinds = {"error": 1, "relative_error": 2, "bits": 3, "norm_error": 4, "psnr": 5, "pointwise_error": 6}

_roles = {
    "normal": "normal", "normals": "normal", "color": "colour", "colors": "colour", "colour": "colour",
    "colours": "colour", "rgb": "colour", "rgba": "colour", "color_0": "colour",
    "texcoord": "texture_coordinate", "texcoords": "texture_coordinate", "texcoord_0": "texture_coordinate",
    "texture_coordinate": "texture_coordinate", "texture_coordinates": "texture_coordinate",
    "uv": "texture_coordinate", "uvs": "texture_coordinate", "tangent": "tangent", "tangents": "tangent",
}


@dataclass(frozen=True)
class _Purpose:
    """The same as `maille compress --for` (tool/purpose.cpp); a test compares the files of both."""

    mode: Optional[str] = None
    effort: Optional[int] = None
    keep_order: bool = False
    pieces: Optional[int] = None
    bits: Mapping[str, float] = field(default_factory=dict)
    error: Optional[float] = None
    dropped: tuple[str, ...] = ()


PURPOSES = {
    "web": _Purpose(effort=2, bits={"position": 14, "normal": 10, "tangent": 10, "texcoord": 12, "color": 8}),
    "print": _Purpose(error=0.0005, dropped=("normal",)),
    "archive": _Purpose(effort=9, keep_order=True),
    "simulation": _Purpose(mode="stream", pieces=_core.cells_of_volume_piece),
    "scan": _Purpose(mode="random", effort=2),
}


def arrays_called(name: str, arrays: tuple[Array, ...]) -> list[str]:
    """The array of this name, or those of a role that is called so. None: there are no such."""
    if any(array.name == name for array in arrays):
        return [name]
    role = _roles.get(name.lower())
    return [array.name for array in arrays if role is not None and array.role == role]


def _means_positions(name: str) -> bool:
    return name in ("position", "positions")


def _check(kind: str, name: str, value: Any) -> float:
    number = float(value)
    where = f"{kind} of '{name}'"
    if kind == "bits":
        if number != math.floor(number) or not 1 <= number <= 52:
            raise ValueError(f"{where}: a whole number from 1 to 52 is wanted, not {value}")
    elif not (number > 0 and math.isfinite(number)):
        raise ValueError(f"{where}: the error allowed is above 0, not {value}; leave it out for lossless")
    if kind == "pointwise_error" and number >= 1:
        raise ValueError(f"{where}: it is below 1, or all would become 0; not {value}")
    return number


class Bounds:
    """The loss asked for: kind and value, for the positions and by name of an array."""

    def __init__(self, arrays: tuple[Array, ...]) -> None:
        self.positions: Optional[tuple[int, float]] = None
        self.arrays: dict[str, tuple[int, float]] = {}
        self._known = arrays

    def add(self, kind: str, given: Bound, *, lenient: bool = False) -> None:
        """`lenient`: names that no array has, and those that have a bound, are passed over."""
        if given is None:
            return
        for name, value in given.items() if isinstance(given, Mapping) else [("position", given)]:
            bound = (_kinds[kind], _check(kind, name, value))
            if _means_positions(name):
                if self.positions is None:
                    self.positions = bound
                elif not lenient:
                    raise ValueError(f"{kind}: there is another bound for the positions; give only one")
                continue
            names = arrays_called(name, self._known)
            if not names and not lenient and name.lower() not in _roles:
                known = ", ".join(["position"] + [array.name for array in self._known])
                raise Error(f"{kind}: there is no array '{name}'; there are: {known}")
            for each in names:
                if each not in self.arrays:
                    self.arrays[each] = bound
                elif not lenient:
                    raise ValueError(f"{kind}: there is another bound for '{each}'; give only one")


def _purpose(name: Optional[str]) -> _Purpose:
    if name is None:
        return _Purpose()
    if name not in PURPOSES:
        raise ValueError(f"for_: there is no '{name}'; there are: {', '.join(PURPOSES)}")
    return PURPOSES[name]


def _mode_number(mesh: Mesh, mode: Optional[str]) -> int:
    if mode is None:
        return mesh._core.usual_mode
    if mode not in MODES:
        raise ValueError(f"mode: there is no '{mode}'; there are: {', '.join(MODES)}")
    return MODES[mode]


def encoding(mesh: Mesh, *, error: Bound = None, relative_error: Bound = None, pointwise_error: Bound = None,
             norm_error: Bound = None, psnr: Bound = None, bits: Bound = None, mode: Optional[str] = None,
             effort: Optional[int] = None, order: Optional[str] = None, pieces: Union[int, str, None] = None,
             for_: Optional[str] = None, provenance: str = "",
             time: Optional[float] = None) -> tuple[Mesh, tuple[Any, ...]]:
    """The mesh that is to be compressed, and how, as maille._core takes it."""
    purpose = _purpose(for_)
    if purpose.dropped:
        dropped = {each for name in purpose.dropped for each in arrays_called(name, mesh.arrays)}
        mesh = mesh.with_arrays([array for array in mesh.arrays if array.name not in dropped])
    bounds = Bounds(mesh.arrays)
    for kind, given in (("error", error), ("relative_error", relative_error), ("pointwise_error", pointwise_error),
                        ("norm_error", norm_error), ("psnr", psnr), ("bits", bits)):
        bounds.add(kind, given, lenient=for_ is not None and isinstance(given, Mapping))
    bounds.add("bits", dict(purpose.bits) or None, lenient=True)
    bounds.add("error", purpose.error, lenient=True)
    number = _mode_number(mesh, mode or purpose.mode)
    stream = number == MODES["stream"]
    if order not in (None, "keep", "any"):
        raise ValueError(f"order: 'keep' or 'any' is wanted, not {order!r}")
    # As the command does: a stream keeps the order of its cells, which is mostly a sweep of a solver.
    keep = order == "keep" or (order is None and (purpose.keep_order or stream))
    if pieces == "auto":  # charts have a usual size where none is given
        pieces = None if number == MODES["random"] else _core.cells_of_volume_piece
    if pieces is None and stream:
        pieces = purpose.pieces
    if pieces is not None and (isinstance(pieces, str) or int(pieces) < 1):
        raise ValueError(f"pieces: 'auto' or a number of cells is wanted, not {pieces!r}")
    if pieces is not None and number == MODES["single"]:
        raise Error("pieces: they are for volumes, mode='stream', and for surfaces with mode='random'")
    level = effort if effort is not None else purpose.effort if purpose.effort is not None else 5
    if not isinstance(level, int) or not 1 <= level <= 9:
        raise ValueError(f"effort: a number from 1 (fast) to 9 (small) is wanted, not {level!r}")
    if not isinstance(provenance, str):
        raise TypeError(f"provenance: a string is wanted, not {type(provenance).__name__}")
    return mesh, (number, level, keep, bounds.positions, bounds.arrays, pieces, provenance,
                  None if time is None else float(time))


Progress = Callable[[str, float], Any]


def progress_function(progress: Any) -> Optional[Progress]:
    """Of a function, or of a bar of tqdm."""
    if progress is None:
        return None
    if hasattr(progress, "update") and hasattr(progress, "set_description"):
        def tell(stage: str, fraction: float) -> None:
            progress.total = 100
            progress.n = round(100 * fraction, 1)
            progress.set_description(stage, refresh=False)
            progress.refresh()
        return tell
    if not callable(progress):
        raise TypeError("progress: a function of a stage and a fraction, or a bar of tqdm, is wanted, not "
                        f"{type(progress).__name__}")
    function: Progress = progress
    return function
