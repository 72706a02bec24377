"""meshio and trimesh learn of .maille when both are imported, in whatever order, and neither is imported for it:
that would take longer than all of maille."""

from __future__ import annotations

import importlib
import importlib.abc
import importlib.machinery
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import Any, Callable, Optional


def _register_meshio() -> None:
    from . import _meshio
    _meshio.register()


def _register_trimesh() -> None:
    from . import _trimesh
    _trimesh.register()


_registrations: dict[str, Callable[[], None]] = {"meshio": _register_meshio, "trimesh": _register_trimesh}


class _Loader(importlib.abc.Loader):
    """Another loader, and a registration behind it."""

    def __init__(self, loader: Any, register: Callable[[], None]) -> None:
        self._loader, self._register = loader, register

    def create_module(self, spec: importlib.machinery.ModuleSpec) -> Optional[ModuleType]:
        module: Optional[ModuleType] = self._loader.create_module(spec)
        return module

    def exec_module(self, module: ModuleType) -> None:
        self._loader.exec_module(module)
        _try(self._register)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._loader, name)


class _Finder(importlib.abc.MetaPathFinder):
    """Finds what the others find, once for each package that is waited for."""

    def find_spec(self, name: str, path: Optional[Sequence[str]],
                  target: Optional[ModuleType] = None) -> Optional[importlib.machinery.ModuleSpec]:
        register = _registrations.get(name)
        if register is None:
            return None
        for finder in sys.meta_path:
            if finder is self or not hasattr(finder, "find_spec"):
                continue
            spec = finder.find_spec(name, path, target)
            if spec is None:
                continue
            if spec.loader is not None and hasattr(spec.loader, "exec_module"):
                spec.loader = _Loader(spec.loader, register)
            return spec
        return None


def _try(register: Callable[[], None]) -> None:
    """A version of the other package that we do not know must not keep anybody from importing it."""
    try:
        register()
    except (AttributeError, ImportError, TypeError):
        pass


def install() -> None:
    for name, register in _registrations.items():
        if name in sys.modules:
            _try(register)
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())
