# SPDX-License-Identifier: BSD-3-Clause
"""Errors of trajectories."""

from __future__ import annotations

import os
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from . import _core
from ._arrays import float64
from ._core import TrajectoryEvaluation

Format = Literal["auto", "tum", "kitti", "poses"]
Arrays = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]


def read_trajectory(path: str | os.PathLike[str], format: Format = "auto") -> Arrays:
    """Read a trajectory of TUM's format, of KITTI's, or poses.txt.

    Returns
    -------
    times : (N,) float64
        Ascending; of KITTI's files, whose lines have none, the place of the line.
    poses : (N, 4, 4) float64
        ``world_from_body``.

    Raises
    ------
    IoError
        Naming file and line.
    """
    return _core.read_trajectory(os.fspath(path), format)


def evaluate_trajectory(
    estimate: Any,
    truth: Any,
    *,
    format: Format = "auto",
    max_difference: float = 0.01,
    align: bool = True,
    delta: float = 1,
    delta_unit: Literal["frames", "metres"] = "frames",
) -> TrajectoryEvaluation:
    """Absolute and relative errors of a trajectory: ATE and RPE (Sturm et al. 2012).

    Parameters
    ----------
    estimate, truth : path, or (times, poses)
        Files as for `read_trajectory`, or (N,) times and (N, 4, 4) ``world_from_body``.
    format : 'auto', 'tum', 'kitti' or 'poses'
        Of the files.
    max_difference : float
        Largest difference of the times of two poses that belong together.
    align : bool
        Before, move the estimate by the rigid motion, without scale, that fits the positions best.
    delta : float
    delta_unit : 'frames' or 'metres'
        Steps of the relative error: every pose and the one ``delta`` later, or consecutive steps
        of at least that length along the truth.

    Raises
    ------
    ValueError
        Naming the argument; also if too few poses match.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> poses = np.tile(np.eye(4), (4, 1, 1))
    >>> poses[:, :3, 3] = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]]
    >>> moved = poses.copy()
    >>> moved[:, :3, 3] += [5, 0, 0]
    >>> times = np.arange(4.0)
    >>> round(gpureg.evaluate_trajectory((times, moved), (times, poses)).absolute_translation.rmse, 9)
    0.0
    """
    first, second = _arrays(estimate, format, "estimate"), _arrays(truth, format, "truth")
    return _core.evaluate_trajectory(*first, *second, max_difference, align, delta, delta_unit)


def _arrays(trajectory: Any, format: Format, name: str) -> Arrays:
    if isinstance(trajectory, str | os.PathLike):
        return read_trajectory(trajectory, format)
    if not isinstance(trajectory, tuple) or len(trajectory) != 2:
        raise TypeError(f"{name}: expected a path or (times, poses), got {trajectory!r}")
    times = float64(trajectory[0], name)
    poses = float64(trajectory[1], name)
    if times.ndim != 1 or poses.shape != (len(times), 4, 4):
        raise ValueError(
            f"{name}: expected shapes (N,) and (N, 4, 4), got {times.shape} and {poses.shape}"
        )
    order = np.argsort(times, kind="stable")
    times, poses = times[order], np.ascontiguousarray(poses[order])
    if not (np.isfinite(times).all() and np.isfinite(poses).all()):
        raise ValueError(f"{name}: holds a number that is not finite")
    if (np.diff(times) == 0).any():
        raise ValueError(f"{name}: a time is there twice")
    return times, poses


__all__ = ["evaluate_trajectory", "read_trajectory"]
