# SPDX-License-Identifier: BSD-3-Clause
"""LAS and LAZ files, through laspy: the optional extra ``gpureg[las]``."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from ._core import IoError


def is_las(path: Any) -> bool:
    return os.fspath(path)[-4:].lower() in (".las", ".laz")


def read_las(path: str | os.PathLike[str]) -> npt.NDArray[np.float64]:
    """(N, 3) coordinates in the file's unit, with its scale and offset applied.

    float64, as map coordinates need it: `prepare` and `register` lose nothing of them.

    Raises
    ------
    ImportError
        Without laspy: ``pip install gpureg[las]``.
    IoError
        Naming the file and the reason.
    """
    name = os.fspath(path)
    try:
        import laspy
    except ImportError:
        raise ImportError(
            f"{name}: LAS and LAZ files need laspy: pip install 'gpureg[las]'"
        ) from None
    try:
        file = laspy.read(name)
    except (OSError, ValueError, laspy.errors.LaspyException) as error:
        raise IoError(f"{name}: {error}") from error
    return np.column_stack([np.asarray(axis, np.float64) for axis in (file.x, file.y, file.z)])
