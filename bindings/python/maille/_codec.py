"""Whole meshes: reading, writing, bytes in memory."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from typing import IO, Any, Optional, Union

from . import _core
from ._errors import Error, MailleWarning
from ._mesh import Mesh
from ._options import Bound, Progress, encoding, progress_function

MEMORY = _core.default_mesh_bytes()
"""Of a decoded mesh, where nothing is said: half of the machine's memory."""

CACHE = 64 << 20
"""Of what comes from a web server, where nothing is said."""


def is_url(source: Any) -> bool:
    return isinstance(source, str) and source.startswith(("http://", "https://"))


def input_of(source: Any, cache_bytes: int = CACHE) -> _core.Input:
    """What is read from: a path, an address, bytes, or a file that is open."""
    if isinstance(source, _core.Input):
        return source
    if is_url(source):
        return _core.Input.of_url(source, cache_bytes)
    if isinstance(source, (str, os.PathLike)):
        path = os.fspath(source)
        os.stat(path)  # raises FileNotFoundError and its like
        return _core.Input.of_path(os.fsdecode(path))
    if hasattr(source, "read") and hasattr(source, "seek"):
        return _core.Input.of_file(source, str(getattr(source, "name", "<file>")))
    try:
        return _core.Input.of_buffer(source)
    except TypeError:
        raise TypeError("a path, an address, bytes or an open file is wanted, not "
                        f"{type(source).__name__}") from None


def _warn(notes: Iterable[str], where: str) -> None:
    for note in notes:
        warnings.warn(f"{where}: {note}", MailleWarning, stacklevel=3)


def _names(arrays: Optional[Iterable[str]]) -> Optional[list[str]]:
    if isinstance(arrays, str):
        raise TypeError("arrays: a list of names is wanted; of one array [name]")
    return None if arrays is None else [str(name) for name in arrays]


def _check_names(mesh: Mesh, wanted: Optional[list[str]], where: str) -> None:
    known = {array.name for array in mesh.arrays}
    for name in wanted or []:
        if name not in known:
            raise Error(f"{where}: has no array '{name}'")


def step_number(opened: _core.Input, step: Optional[int], time: Optional[float]) -> int:
    """Of a step that is given by its number, also from the end, or by its time."""
    if time is None and (step is None or step >= 0):
        return step or 0
    if time is not None and step is not None:
        raise ValueError("step and time: give only one of them")
    about = _core.inspect(opened)
    times: list[float] = [each["time"] for each in about["steps"]]
    if time is None:
        number = len(times) + 1 + (step or 0)
        if number < 0:
            raise IndexError(f"{opened.name}: has {len(times)} steps behind the mesh's own values")
        return number
    wanted = float(time)
    if wanted in times:
        return times.index(wanted) + 1
    if about["time"] == wanted:
        return 0
    nearest = sorted(times, key=lambda each: abs(each - wanted))[:2]
    raise Error(f"{opened.name}: has no step at time {time}; " +
                (f"the nearest are {', '.join(map(str, nearest))}" if nearest else "it has none at all"))


def _read_foreign(path: str, arrays: Optional[list[str]], step: Optional[int], time: Optional[float],
                  format: str, memory: int, progress: Optional[Progress]) -> Mesh:
    if time is not None or (step is not None and step < 0):
        times = _core.foreign_times(path)
        if time is not None and float(time) not in times:
            raise Error(f"{path}: has no step at time {time}")
        step = times.index(float(time)) if time is not None else len(times) + (step or 0)
    core, notes = _core.read_foreign(path, format, step, memory, progress)
    _warn(notes, path)
    mesh = Mesh._of(core)
    if arrays is not None:
        _check_names(mesh, arrays, path)
        mesh = mesh.with_arrays([array for array in mesh.arrays if array.name in arrays])
    return mesh


def read(source: Any, *, arrays: Optional[Iterable[str]] = None, step: Optional[int] = None,
         time: Optional[float] = None, format: Optional[str] = None, memory: int = MEMORY,
         progress: Any = None) -> Mesh:
    """Reads a mesh.

    :param source: a path or address (``https://...``) of a .maille file, its bytes, or an open binary file; or a
        path of a file of another format (PLY, OBJ, STL, VTU, Gmsh, Exodus, OpenFOAM and so on: :func:`formats`).
    :param arrays: names of the arrays that are wanted; all, where nothing is said. Points and cells always come.
    :param step: the step of time: 0 is what the mesh was compressed with, 1 the first that was appended, -1 the
        last. Of files of other formats that have steps, their steps from 0 on.
    :param time: the same by its time.
    :param format: of a file whose name does not tell.
    :param memory: bytes that the decoded mesh may take; MemoryError beyond.
    :param progress: ``f(stage, fraction)``, which may return False to stop (KeyboardInterrupt), or a bar of tqdm.
        Called in this thread, some times a second.
    :raises OSError: the file is not there, cannot be read, or the server failed.
    :raises maille.Error: it is damaged, of another version, or has no such array or step.

    Other threads of Python run meanwhile, and Ctrl-C is answered.

    >>> import maille, tempfile, os
    >>> path = os.path.join(tempfile.mkdtemp(), "square.maille")
    >>> square = maille.Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], {"quad": [[0, 1, 2, 3]]})
    >>> maille.write(path, square).file_bytes == os.path.getsize(path)
    True
    >>> maille.read(path)
    <maille.Mesh: 4 points, 1 cells (1 x quad)>
    """
    names = _names(arrays)
    told = progress_function(progress)
    if isinstance(source, (str, os.PathLike)) and not is_url(source):
        path = os.fsdecode(os.fspath(source))
        if (format or "maille") != "maille" or os.path.isdir(path):
            return _read_foreign(path, names, step, time, format or "", memory, told)
    opened = input_of(source)
    if not _core.is_maille(opened):
        if isinstance(source, (str, os.PathLike)) and not is_url(source) and not path.endswith(".maille"):
            os.stat(path)
            return _read_foreign(path, names, step, time, "", memory, told)
    mesh = Mesh._of(_core.decode(opened, names, step_number(opened, step, time), memory, told))
    _check_names(mesh, names, opened.name)
    return mesh


def decode(buffer: Any, *, arrays: Optional[Iterable[str]] = None, step: Optional[int] = None,
           time: Optional[float] = None, memory: int = MEMORY, progress: Any = None) -> Mesh:
    """Decompresses the bytes of a .maille file: bytes, bytearray, memoryview, mmap, an array of numpy. They are
    not copied; leave them alone meanwhile. Arguments and errors: as of :func:`read`.

    >>> import maille
    >>> mesh = maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], {"triangle": [[0, 1, 2]]}, cell_data={"id": [7]})
    >>> maille.decode(maille.encode(mesh)).cell_data["id"]
    array([7])
    """
    return read(_core.Input.of_buffer(buffer), arrays=arrays, step=step, time=time, memory=memory,
                progress=progress)


def salvage(source: Any, *, memory: int = MEMORY, progress: Any = None) -> tuple[Mesh, Optional[str]]:
    """What is left of a damaged file: of mode stream the cells before the first damage, of single the parts, of
    random the charts that are whole; and what is damaged and lost, or None where the mesh is whole."""
    core, damage = _core.salvage(input_of(source), memory, progress_function(progress))
    return Mesh._of(core), damage


@dataclass(frozen=True)
class ArrayReport:
    """What became of an array: its bytes in memory and in the file, and how far its values are from the original."""

    name: str
    domain: str
    type: str
    components: int
    elements: int
    raw_bytes: int
    coded_bytes: int
    lossless: bool
    bound: float
    """The largest error promised; 0 when lossless."""
    maximum_error: float
    """The largest there is."""


@dataclass(frozen=True)
class Report:
    """What was written."""

    points: int
    cells: int
    file_bytes: int
    connectivity: ArrayReport
    positions: ArrayReport
    arrays: tuple[ArrayReport, ...]


def _report(core: dict[str, Any]) -> Report:
    return Report(core["points"], core["cells"], core["file_bytes"], ArrayReport(**core["connectivity"]),
                  ArrayReport(**core["positions"]), tuple(ArrayReport(**each) for each in core["arrays"]))


def _check_mesh(mesh: Any) -> None:
    if not isinstance(mesh, Mesh):
        advice = "; maille.from_meshio() makes one" if type(mesh).__module__.startswith("meshio") else ""
        advice = "; maille.from_vtk() makes one" if hasattr(mesh, "GetCells") or hasattr(mesh, "GetPolys") else advice
        raise TypeError(f"a maille.Mesh is wanted, not {type(mesh).__name__}{advice}")


def write(path: Union[str, os.PathLike[str], IO[bytes]], mesh: Mesh, *, error: Bound = None,
          relative_error: Bound = None, pointwise_error: Bound = None, norm_error: Bound = None, psnr: Bound = None,
          bits: Bound = None, mode: Optional[str] = None, effort: Optional[int] = None,
          order: Optional[str] = None, pieces: Union[int, str, None] = None, for_: Optional[str] = None,
          time: Optional[float] = None, provenance: str = "", ascii: bool = False, progress: Any = None) -> Optional[Report]:
    """Writes a mesh: compressed as .maille, or in another format by the extension (:func:`formats`; None is
    returned then, and what the format cannot hold is a :class:`MailleWarning`).

    Nothing is lost where nothing is allowed. Bounds are numbers for the positions or ``{"name": number}``, the
    positions being "position"; no decoded value is farther from the original:

    :param path: the file appears whole or not at all, in the place of one that is there. Or an open binary file.
    :param error: |decoded - original| of every component, in its own unit.
    :param relative_error: as a part of the diagonal of the box (positions) or of the range of the values.
    :param pointwise_error: as a part of each value, below 1: zeros and signs stay (mode stream).
    :param norm_error: of the length of the difference, all components together.
    :param psnr: at least so many decibels.
    :param bits: a lattice of 2**bits values over the longest side of the box, or over the range.
    :param mode: "single" (the smallest file; surfaces without mode), "stream" (volumes without mode) or "random"
        (surfaces with levels of detail, read in parts).
    :param effort: 1 (fast) to 9 (small); 5.
    :param order: "keep" that of points and cells, or "any" that is cheap. Without it streams keep it.
    :param pieces: volumes: cut into pieces of so many cells, which are read alone; "auto": as many as suit most.
        Mode "random": charts of about so many triangles instead of 4096.
    :param for_: "web", "print", "archive", "simulation" or "scan": as `maille compress --for`; what is given
        beside it comes first.
    :param time: mode stream: of the mesh's own values, where steps of time are to follow (:func:`append`).
    :param provenance: a text for :func:`info`.
    :param ascii: text instead of binary, in formats that have both.
    :param progress: as of :func:`read`.
    :raises OSError: it cannot be written.
    :raises TypeError, ValueError, maille.Error: the arguments, named.

    >>> import maille, numpy, tempfile, os
    >>> rng = numpy.random.default_rng(1)
    >>> cloud = maille.Mesh(rng.random((1000, 3)), {"vertex": numpy.arange(1000).reshape(-1, 1)})
    >>> path = os.path.join(tempfile.mkdtemp(), "cloud.maille")
    >>> maille.write(path, cloud, error=0.001).positions.maximum_error <= 0.001
    True
    """
    _check_mesh(mesh)
    given = dict(error=error, relative_error=relative_error, pointwise_error=pointwise_error,
                 norm_error=norm_error, psnr=psnr, bits=bits, mode=mode, effort=effort, order=order, pieces=pieces,
                 for_=for_, time=time)
    told = progress_function(progress)
    if not isinstance(path, (str, os.PathLike)):
        if not hasattr(path, "write"):
            raise TypeError(f"path: a path or an open binary file is wanted, not {type(path).__name__}")
        chosen, options = encoding(mesh, provenance=provenance, **given)  # type: ignore[arg-type]
        data, report = _core.encode(chosen._core, options, told)
        path.write(data)
        return _report(report)
    name = os.fsdecode(os.fspath(path))
    if not name.endswith(".maille"):
        _write_foreign(name, mesh, [each for each, value in given.items() if value is not None], ascii)
        return None
    if ascii:
        raise Error("ascii: .maille files are binary")
    chosen, options = encoding(mesh, provenance=provenance, **given)  # type: ignore[arg-type]
    return _report(_core.encode_to_file(chosen._core, name, options, told))


def _write_foreign(name: str, mesh: Mesh, given: list[str], ascii: bool) -> None:
    format = _core.format_to_write(name)
    if not format:
        known = sorted({extension for _, extensions, _, writable in _core.formats() if writable
                        for extension in extensions})
        raise Error(f"{name}: the extension says no format that can be written: .maille, {', '.join(known)}")
    if given:
        raise Error(f"{given[0]}: for .maille files alone, and {name} is none")
    _warn(_core.write_foreign(mesh._core, name, format, ascii), name)


def encode(mesh: Mesh, *, error: Bound = None, relative_error: Bound = None, pointwise_error: Bound = None,
           norm_error: Bound = None, psnr: Bound = None, bits: Bound = None, mode: Optional[str] = None,
           effort: Optional[int] = None, order: Optional[str] = None, pieces: Union[int, str, None] = None,
           for_: Optional[str] = None, time: Optional[float] = None, provenance: str = "",
           progress: Any = None) -> bytes:
    """The bytes of the .maille file that :func:`write` writes with the same arguments; equal on every machine."""
    _check_mesh(mesh)
    chosen, options = encoding(mesh, error=error, relative_error=relative_error, pointwise_error=pointwise_error,
                               norm_error=norm_error, psnr=psnr, bits=bits, mode=mode, effort=effort, order=order,
                               pieces=pieces, for_=for_, time=time, provenance=provenance)
    return _core.encode(chosen._core, options, progress_function(progress))[0]


def append(path: Union[str, os.PathLike[str]], mesh: Mesh, *, time: float, error: Bound = None,
           relative_error: Bound = None, pointwise_error: Bound = None, norm_error: Bound = None,
           psnr: Bound = None, bits: Bound = None) -> int:
    """Appends a step of time to a file of mode stream that kept its order: the arrays on points and cells of a
    mesh with the same points and cells in the same order. Until all of it is there, also after a crash, the file
    reads as it was. Gives the number of the step: ``maille.read(path, step=number)``.

    :param time: of the step, in any unit; a finite number.
    :raises maille.Error: another mesh, or a file that takes no steps. Others as of :func:`write`.

    >>> import maille, tempfile, os
    >>> points, cells = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], {"tetra": [[0, 1, 2, 3]]}
    >>> path = os.path.join(tempfile.mkdtemp(), "flow.maille")
    >>> report = maille.write(path, maille.Mesh(points, cells, cell_data={"p": [1.0]}))
    >>> maille.append(path, maille.Mesh(points, cells, cell_data={"p": [1.5]}), time=0.1)
    1
    >>> maille.read(path, time=0.1).cell_data["p"]
    array([1.5])
    """
    _check_mesh(mesh)
    name = os.fsdecode(os.fspath(path))
    os.stat(name)
    chosen, options = encoding(mesh, error=error, relative_error=relative_error, pointwise_error=pointwise_error,
                               norm_error=norm_error, psnr=psnr, bits=bits, mode="stream")
    number: int = _core.append(name, float(time), chosen._core, options)["number"]
    return number


def verify(source: Any) -> list[str]:
    """Checks every checksum of a .maille file; what is damaged, a sentence each. None: all is well.

    >>> import maille
    >>> data = maille.encode(maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], {"triangle": [[0, 1, 2]]}))
    >>> maille.verify(data)
    []
    """
    return _core.verify(input_of(source))


@dataclass(frozen=True)
class Format:
    """A file format besides .maille that :func:`read` reads."""

    name: str
    extensions: tuple[str, ...]
    description: str
    writable: bool


def formats() -> tuple[Format, ...]:
    """The formats besides .maille that :func:`read` reads and, as far as they are writable, :func:`write` writes."""
    return tuple(Format(name, tuple(extensions), description, writable)
                 for name, extensions, description, writable in _core.formats())


def set_threads(count: int = 0) -> None:
    """How many threads decode and encode; 0: as many as the machine has. Results do not depend on it.

    A child that fork() makes of a process that has used threads works in one, as pools of processes want it.
    """
    if count < 0:
        raise ValueError(f"count: at least 0 is wanted, not {count}")
    _core.set_threads(count)


