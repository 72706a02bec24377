"""A loader for trimesh: ``trimesh.load("x.maille")``."""

from __future__ import annotations

from typing import Any

from ._codec import read


def load_maille(file_obj: Any, file_type: Any = None, resolver: Any = None, **options: Any) -> dict[str, Any]:
    """What trimesh makes a mesh of: points, and the surface as triangles."""
    mesh = read(file_obj)
    loaded: dict[str, Any] = {"vertices": mesh.points, "faces": mesh.triangles(), "process": False}
    normals = [array.values for array in mesh.arrays if array.role == "normal" and array.domain == "point"]
    if normals:
        loaded["vertex_normals"] = normals[0]
    attributes = {name: values for name, values in mesh.point_data.items()}
    if attributes:
        loaded["vertex_attributes"] = attributes
    return loaded


def register() -> None:
    import trimesh.exchange.load as load

    load.mesh_loaders["maille"] = load_maille
