# SPDX-License-Identifier: BSD-3-Clause
"""Clouds from and to files."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._core import PointCloud
from ._mesh import mesh_as_cloud

Path = str | os.PathLike[str]


def read_point_cloud(path: Path, *, spacing: float = 0.0) -> PointCloud:
    """Read a PLY or PCD file, told apart by content, a scan (.bin) of KITTI or nuScenes, or a mesh.

    Coordinates of a map keep the precision of the file. Warns (UserWarning) where the file itself
    holds them in float32, which is too coarse. Files with faces (STL, OBJ, PLY) become points of the faces, uniform by area, with the normals of the
    faces, which point outwards where the mesh is closed. Warns of faces that were dropped or turned.
    LAS and LAZ files hold float64: give their paths to `prepare` or `register`.

    Parameters
    ----------
    path : str or PathLike
    spacing : float
        Mean distance of the samples of a mesh, in its unit; between 20,000 and 2,000,000 are made.
        0: 20,000. `prepare` and `register` take half of their voxel size.

    Raises
    ------
    IoError
        An OSError, naming the file (and the line, in text) and the reason.
    """
    cloud = mesh_as_cloud(path, "path", spacing)
    if cloud is not None:
        return cloud
    return _core.read_point_cloud(os.fspath(path))


def read_cameras(path: Path) -> dict[int, npt.NDArray[np.float64]]:
    """Read the sensor positions of a folder's fragments, its cameras.txt.

    Returns
    -------
    dict of int to (V, 3) float64
        By fragment number: positions in the fragment's frame, in metres, as `prepare` takes
        ``viewpoints``.

    Raises
    ------
    IoError
        Naming file and line.
    """
    return _core.read_cameras(os.fspath(path))


def write_point_cloud(path: Path, points: Any, normals: Any = None) -> None:
    """Write a binary PLY with points and, where given, normals: all of it, or nothing.

    Points are float32, or double where float32 is too coarse, as for a map.

    Parameters
    ----------
    path : str or PathLike
        Ending in .ply, or in nothing.
    points : (N, 3) array or PointCloud
    normals : (N, 3) array, optional

    Examples
    --------
    >>> import gpureg, tempfile, os
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = os.path.join(folder, "two.ply")
    ...     gpureg.write_point_cloud(file, [[0, 0, 0], [1, 2, 3]])
    ...     gpureg.read_point_cloud(file).points
    array([[0., 0., 0.],
           [1., 2., 3.]], dtype=float32)
    """
    extension = os.path.splitext(os.fspath(path))[1]
    if extension.lower() not in ("", ".ply"):
        raise ValueError(
            f"path: {os.fspath(path)!r} ends in '{extension}', but what is written is PLY: let it end in '.ply'"
        )
    if not isinstance(points, PointCloud):
        points = PointCloud(points, normals)
    _core.write_point_cloud(os.fspath(path), points)
