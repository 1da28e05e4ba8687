# SPDX-License-Identifier: BSD-3-Clause
"""E57 files, through pye57: the optional extra ``gpureg[formats]``."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._core import IoError


def read_e57(path: str, part: int = 0) -> tuple[npt.NDArray[np.float64], bool]:
    """(N, 3) coordinates of a scan in its own frame, in metres, and whether the origin of that frame
    is the scanner: of scans with a pose, and of those that are grids or have ranges and angles.
    Points without a return are left out.

    Parameters
    ----------
    part : int
        The scan, from 1; 0: the only one.

    Raises
    ------
    ImportError
        Without pye57: ``pip install gpureg[formats]``.
    IoError
        Naming the file and the reason; of a file with several scans, these.
    """
    index = _chosen(path, part)
    try:
        import pye57
    except ImportError:
        raise ImportError(f"{path}: E57 files need pye57: pip install 'gpureg[formats]'") from None
    try:
        return _read(pye57, path, index)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # libE57 has a type of its own, numpy others
        raise IoError(f"{path}: {type(error).__name__}: {error}") from error


def _chosen(path: str, part: int) -> int:
    names = [scan.name for scan in _core.scans_in(path)]
    listed = ", ".join(f"{k + 1} {name!r}" for k, name in enumerate(names[:8]))
    listed += f", ... {len(names)}" if len(names) > 8 else ""
    if not names:
        raise IoError(f"{path}: it holds no scan")
    if part > len(names):
        raise IoError(f"{path}: there is no scan {part}, it holds {len(names)}: {listed}")
    if part == 0 and len(names) > 1:
        raise IoError(
            f"{path}: it holds {len(names)} scans: {listed}; name one of them, as '{path}#2'"
        )
    return max(part - 1, 0)


def _read(pye57: Any, path: str, index: int) -> tuple[npt.NDArray[np.float64], bool]:
    with pye57.E57(path) as file:
        header = file.get_header(index)
        # A coordinate takes a bit at least: the header of a damaged file may announce any number.
        if 3 * header.point_count > 8 * os.path.getsize(path):
            raise ValueError(f"truncated: {header.point_count} points announced")
        data = file.read_scan(index, transform=False, ignore_missing_fields=True)
        fields = header.point_fields
        seen = "rowIndex" in fields or "columnIndex" in fields or "sphericalRange" in fields
        if header.has_pose():
            moved = np.abs(header.translation).max() > 0 or np.abs(header.rotation[1:]).max() > 0
            seen = seen or bool(moved)
    if "cartesianX" in data:
        points = np.stack([data[f"cartesian{axis}"] for axis in "XYZ"], axis=1)
    else:
        distance, azimuth, elevation = (
            data[f"spherical{name}"] for name in ("Range", "Azimuth", "Elevation")
        )
        flat = distance * np.cos(elevation)
        points = np.stack(
            [flat * np.cos(azimuth), flat * np.sin(azimuth), distance * np.sin(elevation)], axis=1
        )
    points = np.asarray(points[(points != 0).any(axis=1)], np.float64)
    return points, seen and _may_see_origin(points)


def _may_see_origin(points: npt.NDArray[np.float64]) -> bool:
    """False where it is farther from the points than they extend: they were moved since."""
    finite = points[np.isfinite(points).all(axis=1)]
    if not len(finite):
        return False
    low, high = finite.min(axis=0), finite.max(axis=0)
    outside = np.maximum(np.maximum(low, -high), 0)
    return bool(np.linalg.norm(outside) <= np.linalg.norm(high - low))
