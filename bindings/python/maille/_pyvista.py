"""PyVista from 0.48 on finds these by their entry points (pyproject.toml): ``pyvista.read("x.maille")`` and
``mesh.save("x.maille")`` need no import of maille."""

from __future__ import annotations

from typing import Any

from ._codec import read as read_mesh
from ._codec import write as write_mesh
from ._file import open as open_file
from ._vtk import from_vtk, to_vtk


def read(path: str, *, level: Any = None, **options: Any) -> Any:
    """A dataset of PyVista. `options`: those of :func:`maille.read`; `level`: of detail, of files of mode random."""
    import pyvista

    if level is None:
        mesh = read_mesh(path, **options)
    else:
        with open_file(path) as file:
            mesh = file.extract(level=level, **options)
    return pyvista.wrap(to_vtk(mesh))


def write(dataset: Any, path: str, **options: Any) -> None:
    """`options`: those of :func:`maille.write`."""
    if not (dataset.IsA("vtkPolyData") or dataset.IsA("vtkUnstructuredGrid")):
        dataset = dataset.cast_to_unstructured_grid()
    write_mesh(path, from_vtk(dataset), **options)
