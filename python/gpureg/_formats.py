# SPDX-License-Identifier: BSD-3-Clause
"""Formats that libraries of Python read: LAS, LAZ, E57."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._e57 import read_e57
from ._las import read_las

#: Points, and the viewpoint where the format tells it.
Scan = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64] | None]


def read_foreign(path: Any, part: int = 0) -> Scan | None:
    """A scan of a LAS, LAZ or E57 file; None: another format, or no file.

    The file's first bytes decide, or its name. `part`: the scan, from 1, where the path does not
    name it; 0: the only one.
    """
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        return None
    file, named = _core.scan_path(os.fspath(path))
    part = part or named
    extension = os.path.splitext(file)[1].lower()
    start = _first_bytes(file)
    if start == b"ASTM-E57" or extension == ".e57":
        points, seen = read_e57(file, part)
        return points, np.zeros((1, 3)) if seen else None
    if start[:4] == b"LASF" or extension in (".las", ".laz"):
        if part > 1:
            raise _core.IoError(f"{file}: it holds one scan, there is no scan {part}")
        return read_las(file), None
    return None


def _first_bytes(file: str) -> bytes:
    try:
        if not os.path.isfile(file):
            return b""
        with open(file, "rb") as content:
            return content.read(8)
    except OSError:
        return b""
