# SPDX-License-Identifier: BSD-3-Clause
"""Meshes become clouds: points of the faces by area, with the normals of the faces."""

from __future__ import annotations

import os
import warnings
from typing import Any

import numpy as np

from . import _core
from ._core import PointCloud


def mesh_as_cloud(value: Any, name: str, spacing: float) -> PointCloud | None:
    """The cloud of a mesh file, a trimesh.Trimesh or an Open3D TriangleMesh; None: no mesh.

    Warns (UserWarning) of faces that were dropped or turned.
    """
    if isinstance(value, str | os.PathLike):
        path = os.fspath(value)
        if not isinstance(path, str) or not _core.is_mesh(path):
            return None
        cloud, notes = _core.sample_mesh_file(path, spacing)
        name = path
    else:
        faces = getattr(value, "faces", None)
        if faces is None:
            faces = getattr(value, "triangles", None)  # Open3D
        if faces is None or not hasattr(value, "vertices"):
            return None
        vertices, triangles = np.asarray(value.vertices), np.asarray(faces)
        _check(vertices, f"{name}.vertices", "fiu")
        _check(triangles, f"{name}.faces", "iu")
        outside = (triangles < 0) | (triangles >= len(vertices))
        if outside.any():
            row = int(np.argwhere(outside)[0][0])
            raise ValueError(
                f"{name}.faces[{row}] is {triangles[row].tolist()}, but there are {len(vertices)} vertices"
            )
        try:
            cloud, notes = _core.sample_mesh(vertices, triangles, spacing)
        except _core.InvalidArgument as error:
            raise _core.InvalidArgument(f"{name}: {error}") from None
    if notes:
        warnings.warn(f"{name}: {notes}", UserWarning, stacklevel=4)
    return cloud


def _check(array: Any, name: str, kinds: str) -> None:
    if array.dtype.kind not in kinds or array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(
            f"{name}: expected shape (N, 3) of {'whole ' if kinds == 'iu' else ''}numbers, got {array.dtype} of shape {array.shape}"
        )
