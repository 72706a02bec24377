"""Files of which parts are read."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Optional, Union

import numpy as np

from . import _core
from ._arrays import NDArray, triple
from ._codec import CACHE, MEMORY, _names, input_of, read, step_number
from ._errors import Error, ErrorCode
from ._mesh import Mesh
from ._options import MODES, progress_function

_mode_names = {number: name for name, number in MODES.items()}


@dataclass(frozen=True)
class ArrayInfo:
    """What a file says of an array."""

    name: str
    domain: str
    """"point", "cell", "corner" or "mesh"."""
    type: str
    """"i8" to "f64"."""
    components: int
    role: str
    count: int
    """Tuples."""
    coded_bytes: int
    lossless: bool
    bound: float
    """The largest error promised; 0 when lossless."""
    maximum_error: float
    """Mode stream: the largest there is."""
    ranges: tuple[tuple[float, float], ...]
    """Mode stream: least and largest value of each component."""


@dataclass(frozen=True)
class StepInfo:
    """A step of time behind the mesh."""

    time: float
    arrays: tuple[str, ...]
    maximum_errors: tuple[float, ...]
    coded_bytes: int


class Level(NamedTuple):
    """A level of detail; 0 is the mesh itself."""

    faces: int
    charts: int
    bound: float
    """No point of the mesh is farther from this level, in units of the mesh."""


@dataclass(frozen=True)
class Info:
    """What a .maille file says of itself."""

    format: str
    mode: str
    effort: int
    order_kept: bool
    file_bytes: int
    points: int
    cells: int
    corners: int
    parts: int
    blocks: tuple[tuple[str, int], ...]
    """Name and type, and number of cells."""
    types: tuple[tuple[str, int], ...]
    """Cells by type, also of mixed blocks."""
    levels: tuple[Level, ...]
    """Mode random."""
    time: Optional[float]
    """Mode stream: of the mesh's own values, where the file tells."""
    positions: ArrayInfo
    arrays: tuple[ArrayInfo, ...]
    steps: tuple[StepInfo, ...]
    """The first one is step 1."""
    metadata: tuple[tuple[str, str], ...]
    provenance: str
    problems: tuple[str, ...]
    """What is missing or damaged, as far as it shows without reading everything."""


def _array_info(core: dict[str, Any]) -> ArrayInfo:
    values: dict[str, Any] = {**core, "ranges": tuple(core["ranges"])}
    return ArrayInfo(**values)


def _info(core: dict[str, Any]) -> Info:
    levels = tuple(Level(*each) for each in
                   zip(core["faces_of_level"], core["charts_of_level"], core["bound_of_level"]))
    steps = tuple(StepInfo(each["time"], tuple(each["arrays"]), tuple(each["maximum_errors"]), each["coded_bytes"])
                  for each in core["steps"])
    return Info(core["format"], _mode_names[core["mode"]], core["effort"], core["order_kept"], core["file_bytes"],
                core["points"], core["cells"], core["corners"], core["parts"], tuple(core["blocks"]),
                tuple(core["types"]), levels, core["time"], _array_info(core["positions"]),
                tuple(_array_info(each) for each in core["arrays"]), steps, tuple(core["metadata"]),
                core["provenance"], tuple(core["problems"]))


def info(source: Any) -> Info:
    """What a .maille file says of itself, without decoding values. `source`: as of :func:`read`.

    >>> import maille
    >>> data = maille.encode(maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], {"triangle": [[0, 1, 2]]}))
    >>> about = maille.info(data)
    >>> about.mode, about.points, about.cells
    ('single', 3, 1)
    """
    return _info(_core.inspect(input_of(source)))


class Hit(NamedTuple):
    """A point of a surface."""

    position: tuple[float, float, float]
    distance: float
    """From the point that was asked for; of a ray in lengths of its direction."""
    face: int
    """In its chart."""
    chart: tuple[int, int]


class Fetched(NamedTuple):
    """What came from a web server so far."""

    requests: int
    round_trips: int
    """Requests one after the other; those sent at once count as one."""
    bytes: int


class PieceInfo(NamedTuple):
    """What is known of a piece without reading it."""

    cells: int
    points: int
    """0 where it is not known."""
    bytes: int
    low: Optional[tuple[float, float, float]]
    """Lowest corner of the box around it; None where nothing has a place."""
    high: Optional[tuple[float, float, float]]
    ranges: dict[str, list[tuple[float, float]]]
    """Least and largest value of each component of the arrays; of volumes."""


Where = Union[tuple[str, float, float], tuple[str, float, float, Optional[int]]]


def _conditions(where: Iterable[Any]) -> list[tuple[str, float, float, Optional[int]]]:
    conditions = []
    for each in where:
        if isinstance(each, str) or len(each) not in (3, 4):
            raise TypeError("where: (name, least, largest) or (name, least, largest, component) are wanted")
        name, low, high, *rest = each
        component: Any = rest[0] if rest else None
        conditions.append((str(name), float(low), float(high), component))
    return conditions


def _plane(point_and_normal: Any, name: str) -> tuple[tuple[float, float, float], float]:
    origin, normal = (np.asarray(triple(each, name)) for each in point_and_normal)
    length = float(np.linalg.norm(normal))
    if not math.isfinite(length) or length == 0:
        raise ValueError(f"{name}: a point and a normal are wanted, and this normal has no length")
    unit = normal / length
    return triple(unit, name), -float(unit @ origin)


def _region(box: Any, sphere: Any, planes: Iterable[Any]) -> tuple[Any, ...]:
    corners = None if box is None else (triple(box[0], "box"), triple(box[1], "box"))
    if corners and any(low > high for low, high in zip(*corners)):
        raise ValueError("box: the lowest corner comes first, then the highest")
    ball = None if sphere is None else (triple(sphere[0], "sphere"), float(sphere[1]))
    return (corners, ball, [_plane(each, "planes") for each in planes])


class File:
    """A .maille file of which parts are read: :func:`maille.open` makes one.

    Several threads may use it; it reads for one at a time. It pickles, if it was opened by a path, an address or
    bytes: what comes out opens the file anew.
    """

    def __init__(self, source: Any, *, arrays: Optional[Iterable[str]] = None, step: Optional[int] = None,
                 time: Optional[float] = None, memory: int = MEMORY, cache_bytes: int = CACHE) -> None:
        self._source, self._arrays, self._memory, self._cache = source, _names(arrays), memory, cache_bytes
        self._input: Optional[_core.Input] = input_of(source, cache_bytes)
        self._info: Optional[Info] = None
        self._surface: Optional[_core.SurfaceFile] = None
        self._volume: Optional[_core.VolumeFile] = None
        self._mode = self.info.mode
        self._step = step_number(self._input, step, time)
        self._charts: Optional[list[tuple[int, int]]] = None

    def _opened(self) -> _core.Input:
        if self._input is None:
            raise ValueError("the file is closed")
        return self._input

    @property
    def info(self) -> Info:
        """What the file says of itself."""
        if self._info is None:
            self._info = _info(_core.inspect(self._opened()))
        return self._info

    @property
    def mode(self) -> str:
        """"single", "stream" or "random"."""
        return self._mode

    @property
    def levels(self) -> tuple[Level, ...]:
        """Levels of detail of mode random, the mesh itself first; none of other modes."""
        return self.info.levels

    @property
    def times(self) -> tuple[float, ...]:
        """Of the steps behind the mesh: ``times[0]`` is that of step 1."""
        return tuple(step.time for step in self.info.steps)

    @property
    def fetched(self) -> Optional[Fetched]:
        """Of an address: what came from the server so far; else None."""
        statistics = self._opened().statistics()
        return None if statistics is None else Fetched(*statistics)

    def read(self, *, arrays: Optional[Iterable[str]] = None, step: Optional[int] = None,
             time: Optional[float] = None, progress: Any = None) -> Mesh:
        """The whole mesh; where nothing is said with the arrays and at the step that the file was opened for."""
        if step is None and time is None:
            step = self._step
        return read(self._opened(), arrays=self._arrays if arrays is None else arrays, step=step, time=time,
                    memory=self._memory, progress=progress)

    def _of_surface(self) -> _core.SurfaceFile:
        if self._surface is None:
            self._surface = _core.SurfaceFile(self._opened(), self._arrays, self._memory)
        self._opened()
        return self._surface

    def _of_volume(self) -> _core.VolumeFile:
        if self._volume is None:
            self._volume = _core.VolumeFile(self._opened(), self._arrays, self._step, self._memory)
        self._opened()
        return self._volume

    def _wrong_mode(self, what: str) -> Error:
        has = {"single": "mode single, which is read whole", "stream": "mode stream, a volume",
               "random": "mode random, a surface"}[self._mode]
        return Error(f"{self._opened().name}: {what}; this file is of {has}", ErrorCode.UNSUPPORTED)

    def extract(self, *, box: Any = None, sphere: Any = None, planes: Sequence[Any] = (), plane: Any = None,
                where: Iterable[Where] = (), cells: Optional[tuple[int, int]] = None,
                pieces: Optional[Iterable[int]] = None, error: Optional[float] = None, level: Optional[int] = None,
                triangles: Optional[int] = None, eye: Any = None, pixels: float = 1.0, height: int = 1080,
                angle: float = 60.0, whole: bool = False, salvage: bool = False, progress: Any = None) -> Mesh:
        """A part of the mesh: what meets all of what is given. Only what is needed is read, from disk or server.

        :param box: (lowest corner, highest corner).
        :param sphere: (centre, radius).
        :param planes: half-spaces, (point, normal) each: what lies on the normal's side.
        :param pieces: volumes: only these pieces; surfaces: only these charts of the finest level.
        :param salvage: leave out what is damaged, instead of raising.

        Volumes (mode stream; cells that meet it, bit for bit; :attr:`Mesh.cell_numbers` are theirs in the whole):

        :param plane: (point, normal): cells that it passes.
        :param where: (name, least, largest) each, or (name, least, largest, component): cells that have, or have a
            point that has, such a value; of several components without one: the length.
        :param cells: (first, behind the last), by their numbers in the file that was compressed.

        Surfaces (mode random; without any of these the mesh itself, bit for bit):

        :param error: nowhere farther from the mesh, in its units.
        :param level: of detail, 0 the finest.
        :param triangles: at most so many.
        :param eye: as it is seen from there, with errors of at most `pixels` pixels in a picture of `height` pixels
            and a vertical `angle` in degrees.
        :param whole: do not cut off what is outside of the region at the edge of charts.
        """
        region = _region(box, sphere, planes)
        told = progress_function(progress)
        if self._mode == "stream":
            for name, value in (("error", error), ("level", level), ("triangles", triangles), ("eye", eye)):
                if value is not None:
                    raise self._wrong_mode(f"{name}: only files of mode random have levels of detail")
            return self._volume_part(region, plane, where, cells, pieces, salvage, told)
        if self._mode != "random":
            raise self._wrong_mode("parts are read from modes stream and random")
        if plane is not None or cells is not None or list(where):
            raise self._wrong_mode("plane, where and cells are for volumes")
        view = None
        if eye is not None:
            view = (triple(eye, "eye"), height / (2 * math.tan(math.radians(angle) / 2)), float(pixels))
        return self._surface_part(region, (error, None, level, view), triangles, pieces, whole, salvage, told)

    def _volume_part(self, region: Any, plane: Any, where: Iterable[Where], cells: Any, pieces: Any, salvage: bool,
                     told: Any) -> Mesh:
        wanted = None if pieces is None else [int(piece) for piece in pieces]
        core, cell_numbers, point_numbers, _, _, problems = self._of_volume().extract(
            region, None if plane is None else _plane(plane, "plane"), _conditions(where), cells, wanted, told)
        if problems and not salvage:
            raise Error("; ".join(problems), ErrorCode.CORRUPT)
        mesh = Mesh._of(core)
        if len(cell_numbers) == mesh.cell_count and len(point_numbers) == mesh.point_count:
            mesh.cell_numbers, mesh.point_numbers = cell_numbers, point_numbers
        return mesh

    def _surface_part(self, region: Any, detail: Any, triangles: Optional[int], pieces: Any, whole: bool,
                      salvage: bool, told: Any) -> Mesh:
        surface = self._of_surface()
        level = detail[2]
        if level is not None and not 0 <= level < len(self.levels):
            raise IndexError(f"level: they are counted from 0 to {len(self.levels) - 1}, so there is no {level}")
        charts, _ = surface.select(region, detail, triangles)
        if pieces is not None:
            finest = self._finest()
            wanted = {finest[self._piece(piece)] for piece in pieces}
            charts = [chart for chart in charts if chart in wanted]
        core = surface.salvage(charts)[0] if salvage else surface.extract(charts, told)
        if not whole and (region[0] or region[1] or region[2]):
            core = _core.clip(core, region)
        return Mesh._of(core)

    def box(self, low: Any, high: Any, **options: Any) -> Mesh:
        """What meets a box with sides along the axes: :meth:`extract` has the options.

        >>> import maille, numpy
        >>> points = numpy.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in range(5)], float)
        >>> cells = [[i, i + 1, i + 6, i + 5, i + 10, i + 11, i + 16, i + 15] for i in range(4)]
        >>> data = maille.encode(maille.Mesh(points, {"hexahedron": cells}, cell_data={"T": [1, 2, 3, 4]}))
        >>> maille.open(data).box([2.2, 0, 0], [2.8, 1, 1]).cell_data["T"]
        array([3])
        """
        return self.extract(box=(low, high), **options)

    def view(self, eye: Any, *, pixels: float = 1.0, **options: Any) -> Mesh:
        """A surface as it is seen from `eye`: near parts fine, far ones coarse, errors below `pixels` pixels."""
        return self.extract(eye=eye, pixels=pixels, **options)

    def where(self, array: str, low: float = -math.inf, high: float = math.inf, *,
              component: Optional[int] = None, **options: Any) -> Mesh:
        """The cells of a volume that have, or have a point that has, a value from `low` to `high`, both included."""
        return self.extract(where=[(array, low, high, component)], **options)

    @property
    def pieces(self) -> int:
        """How many parts can be read one by one: the pieces of a volume, the charts of a surface; 1 of mode single."""
        if self._mode == "stream":
            return self._of_volume().pieces
        return len(self._finest()) if self._mode == "random" else 1

    def _finest(self) -> list[tuple[int, int]]:
        if self._charts is None:
            self._charts = self._of_surface().select((None, None, []), (None, None, None, None), None)[0]
        return self._charts

    def _piece(self, i: int) -> int:
        if not -self.pieces <= i < self.pieces:
            raise IndexError(f"piece {i} of {self.pieces}; they are counted from 0")
        return int(i) % self.pieces

    def piece(self, i: int, **options: Any) -> Mesh:
        """One part as a mesh of its own: every cell is in one of them."""
        if self._mode == "single":
            self._piece(i)
            return self.read()
        return self.extract(pieces=[self._piece(i)], **options)

    def piece_info(self, i: int) -> PieceInfo:
        """What is known of a part without reading it."""
        if self._mode == "random":
            _, faces, size, low, high = self._of_surface().chart_info(self._finest()[self._piece(i)])
            return PieceInfo(faces, 0, size, triple(low, "box"), triple(high, "box"), {})
        if self._mode == "single":
            raise self._wrong_mode("pieces are in modes stream and random")
        cells, points, size, box, fields = self._of_volume().piece_info(self._piece(i))
        ranges = {name: [(low, high) for low, high, _ in components] for name, _, components in fields}
        if box is None:
            return PieceInfo(cells, points, size, None, None, ranges)
        return PieceInfo(cells, points, size, triple(box[0], "box"), triple(box[1], "box"), ranges)

    def coarse(self) -> Mesh:
        """A first picture: the coarsest level of a surface; of a volume in pieces some thousand vertices with mean
        values. Next to nothing is read."""
        if self._mode == "stream":
            return Mesh._of(self._of_volume().coarse())
        return self.extract(level=len(self.levels) - 1)

    def nearest(self, point: Any) -> Optional[Hit]:
        """The point of a surface nearest to this one; None where there are no faces."""
        return self._hit(self._random("nearest()").nearest(triple(point, "point")))

    def hit(self, origin: Any, direction: Any) -> Optional[Hit]:
        """The first point of a surface that a ray meets, or None."""
        return self._hit(self._random("hit()").hit(triple(origin, "origin"), triple(direction, "direction")))

    def nearest_points(self, point: Any, count: int) -> tuple[NDArray, NDArray]:
        """The `count` points of a surface nearest to this one, (count, 3), the nearest first, and how far they are."""
        found = self._random("nearest_points()").nearest_points(triple(point, "point"), int(count))
        return (np.array([position for position, _ in found], float).reshape(-1, 3),
                np.array([distance for _, distance in found], float))

    def component(self, near: Any, *, progress: Any = None) -> Mesh:
        """All of a surface that hangs together with its point nearest to this one."""
        surface = self._random("component()")
        return Mesh._of(surface.component(triple(near, "near"), progress_function(progress)))

    def _random(self, what: str) -> _core.SurfaceFile:
        if self._mode != "random":
            raise self._wrong_mode(f"{what} is for mode random")
        return self._of_surface()

    @staticmethod
    def _hit(found: Any) -> Optional[Hit]:
        if found is None:
            return None
        position, distance, chart, face, _, _ = found
        return Hit(triple(position, "position"), distance, face, (chart[0], chart[1]))

    def close(self) -> None:
        """Lets go of the file. Meshes that were read of it stay."""
        self._input = self._surface = self._volume = None

    def __enter__(self) -> File:
        return self

    def __exit__(self, *exception: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        if self._input is None:
            return "<maille.File: closed>"
        about = self.info
        return f"<maille.File {self._input.name}: mode {about.mode}, {about.points} points, {about.cells} cells>"

    def __reduce__(self) -> tuple[Any, ...]:
        source = self._source
        if not isinstance(source, (str, os.PathLike, bytes)):
            raise TypeError("only files that were opened by a path, an address or bytes can be pickled")
        return _open_again, (source, self._arrays, self._step, self._memory, self._cache)


def _open_again(source: Any, arrays: Optional[list[str]], step: int, memory: int, cache_bytes: int) -> File:
    return File(source, arrays=arrays, step=step, memory=memory, cache_bytes=cache_bytes)


def open(source: Any, *, arrays: Optional[Iterable[str]] = None, step: Optional[int] = None,
         time: Optional[float] = None, memory: int = MEMORY, cache_bytes: int = CACHE) -> File:
    """Opens a .maille file of which parts are to be read: a box, a view, certain values, pieces.

    :param source: a path, an address (``https://...``, of which only what is needed is fetched), bytes, or an open
        binary file (of fsspec, say).
    :param arrays: names of the arrays that are to come; all, where nothing is said.
    :param step: of time, for the parts of volumes; by number or by `time`, as of :func:`read`.
    :param memory: bytes that what is decoded at once may take.
    :param cache_bytes: of what came from a server and is kept.
    :raises OSError, maille.Error: as of :func:`read`.

    >>> import maille
    >>> data = maille.encode(maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], {"triangle": [[0, 1, 2]]}), mode="random")
    >>> with maille.open(data) as file:
    ...     print(file.mode, len(file.levels), file.nearest([0, 0, 5]).position)
    random 1 (0.0, 0.0, 0.0)
    """
    return File(source, arrays=arrays, step=step, time=time, memory=memory, cache_bytes=cache_bytes)
