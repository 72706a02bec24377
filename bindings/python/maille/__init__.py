"""Compression of large meshes: surfaces and volumes with fields, whole, in parts, and from web servers.

>>> import maille
>>> mesh = maille.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], {"triangle": [[0, 1, 2]]})
>>> maille.decode(maille.encode(mesh)).points.tolist()
[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]

docs/python.md has recipes: numpy, meshio, PyVista, trimesh, Open3D, matplotlib, dask.
"""

from . import _hooks
from ._codec import (ArrayReport, Format, Report, append, decode, encode, formats, read, salvage, set_threads, verify,
                     write)
from ._core import version as __version__
from ._errors import Error, ErrorCode, MailleWarning
from ._file import ArrayInfo, Fetched, File, Hit, Info, Level, PieceInfo, StepInfo, info, open
from ._mesh import CELL_TYPES, Array, Block, Mesh
from ._meshio import from_meshio, to_meshio
from ._stream import Portion, Stream, StreamArray, stream
from ._vtk import from_vtk, to_vtk

__all__ = [
    "CELL_TYPES", "Array", "ArrayInfo", "ArrayReport", "Block", "Error", "ErrorCode", "Fetched", "File", "Format",
    "Hit", "Info", "Level", "MailleWarning", "Mesh", "PieceInfo", "Portion", "Report", "StepInfo", "Stream",
    "StreamArray", "append", "decode", "encode", "formats", "from_meshio", "from_vtk", "info", "open", "read",
    "salvage", "set_threads", "stream", "to_meshio", "to_vtk", "verify", "write",
]

_hooks.install()
