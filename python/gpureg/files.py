# SPDX-License-Identifier: BSD-3-Clause
"""Clouds from and to files."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._arrays import to_numpy
from ._core import PointCloud, StoredScan
from ._formats import read_foreign
from ._mesh import mesh_as_cloud

Path = str | os.PathLike[str]


def read_point_cloud(path: Path, part: int = 0, *, spacing: float = 0.0) -> PointCloud:
    """Read a cloud or a mesh: PLY, PCD, LAS, LAZ, E57, PTX, rows of numbers in text (XYZ, TXT, CSV, ASC, PTS), OBJ, OFF, STL,
    or a scan (.bin) of KITTI or nuScenes. The content decides, then the extension.

    Coordinates of a map keep the precision of the file. Warns (UserWarning) where the file itself
    holds them in float32, which is too coarse. Files with faces (STL, OBJ, PLY) become points of the faces, uniform by area, with the normals of the
    faces, which point outwards where the mesh is closed. Warns of faces that were dropped or turned.
    The scanner of an E57 or PTX scan is its viewpoint. LAS, LAZ and E57 need ``pip install gpureg[formats]``.

    Parameters
    ----------
    path : str or PathLike
        ``"project.e57#2"`` is the second scan of a file that holds several, here and in every other
        function that takes a path.
    part : int
        That scan, from 1; 0: the only one, or the one that the path names.
    spacing : float
        Mean distance of the samples of a mesh, in its unit; between 20,000 and 2,000,000 are made.
        0: 20,000. `prepare` and `register` take half of their voxel size.

    Raises
    ------
    IoError
        An OSError, naming the file (and the line, in text) and the reason; of a file with several
        scans, these; of a format that is not read, what to do.
    ImportError
        Naming the package that the format needs.
    """
    scan = read_foreign(path, part)
    if scan is not None:
        return PointCloud(scan[0], viewpoints=scan[1])
    cloud = mesh_as_cloud(path, "path", spacing)
    if cloud is not None:
        return cloud
    return _core.read_point_cloud(os.fspath(path), part)


def scans_in(path: Path) -> list[StoredScan]:
    """The scans of a file that holds several (E57, PTX), with names, numbers of points and poses.

    Of any other file, none. The scan of index k is read by ``read_point_cloud(path, k + 1)``. Poses
    are what the file holds: of a project that is registered, those of the scanners.

    Raises
    ------
    IoError
        Where the file cannot be read, or its list of scans is damaged.
    """
    return _core.scans_in(os.fspath(path))


def from_depth_image(
    depth: Any, fx: float, fy: float, cx: float, cy: float, *, depth_scale: float = 1000.0
) -> PointCloud:
    """The cloud of a depth image, in the frame of the camera: x right, y down, z forwards. Its
    viewpoint is the camera.

    Parameters
    ----------
    depth : (H, W) array
        Distances along the axis of the camera; 0, NaN and infinity are no measurement. Images of
        16 bits are read by Pillow: ``numpy.asarray(PIL.Image.open("depth.png"))``.
    fx, fy, cx, cy : float
        Intrinsics in pixels; (cx, cy) is the principal point, and (0, 0) the centre of the first pixel.
    depth_scale : float
        Units of the image in a metre: 1000 of millimetres, 5000 in the data set of TUM, 1 of metres.

    Examples
    --------
    >>> import gpureg, numpy as np
    >>> cloud = gpureg.from_depth_image(np.full((2, 2), 1500), 500, 500, 0.5, 0.5)
    >>> len(cloud), float(cloud.points[0, 2])
    (4, 1.5)
    """
    image = to_numpy(depth, "depth")
    if image.ndim != 2 or image.dtype.kind not in "fiu":
        raise ValueError(
            f"depth: expected an (H, W) array of numbers, got {image.dtype} of shape {image.shape}"
        )
    for name, value in (("fx", fx), ("fy", fy), ("depth_scale", depth_scale)):
        if not value > 0:
            raise ValueError(f"{name} is {value}, expected a positive number")
    z = np.asarray(image, np.float64) / depth_scale
    v, u = np.nonzero(np.isfinite(z) & (z > 0))
    z = z[v, u]
    points = np.stack([(u - cx) / fx * z, (v - cy) / fy * z, z], axis=1)
    return PointCloud(points.astype(np.float32), viewpoints=np.zeros((1, 3), np.float32))


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
    return _core.read_cameras(os.fsencode(path), [], [])


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
