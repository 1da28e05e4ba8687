# SPDX-License-Identifier: BSD-3-Clause
"""Loops for a SLAM system that tracks by itself."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Union

import numpy as np

from . import _core
from ._contexts import checked, context_of
from ._core import (
    Context,
    LoopClosureOptions,
    LoopUpdate,
    PoseGraph,
    PreparedCloud,
    RegistrationPrior,
    RegistrationResult,
)
from .preparation import prepare

Path = Union[str, "os.PathLike[str]"]


def _matrix(value: Any) -> np.ndarray | None:
    return None if value is None else np.asarray(value, np.float64)


class LoopCloser:
    """Finds, verifies and, where wanted, optimises the loops of a SLAM system.

    `process` registers pairs of fragments and says which loops changed their state; every other
    method returns at once, also while another thread is in `process`. The same calls give the same
    bits, as long as `process` has no time limit.

    Parameters
    ----------
    voxel_size : float
        Metres; every length follows from it. Not used where options are given.
    options : LoopClosureOptions, optional
        With ``optimize`` False the poses are left to the host, and `LoopUpdate.poses` is empty.
        ``graph.drift`` is the noise of odometry without covariance. `LoopClosureOptions.loopsmart`
        verifies by the constants of the LoopSmart paper, which need odometry that is nearly exact.

    Examples
    --------
    >>> import gpureg, numpy as np
    >>> closer = gpureg.LoopCloser(voxel_size=0.05)
    >>> closer.add(0)
    >>> closer.add(1)
    >>> step = np.eye(4)
    >>> step[0, 3] = 1
    >>> closer.add_odometry(1, 0, step)
    >>> update = closer.process(milliseconds=50)
    >>> [loop.state for loop in update.changed]
    []
    >>> float(update.poses[1][0, 3])
    1.0
    """

    def __init__(
        self,
        *,
        voxel_size: float = 0.05,
        options: LoopClosureOptions | None = None,
        context: Context | None = None,
    ) -> None:
        self._context = context_of(context)
        self._options = checked(
            options, LoopClosureOptions, "options"
        ) or LoopClosureOptions.from_voxel_size(voxel_size)
        self._core = _core.LoopCloser(self._context, self._options)

    def add(
        self,
        id: int,
        cloud: Any = None,
        world_from_fragment: Any = None,
        *,
        session: int = 0,
        time: float = 0.0,
        up: Any = None,
        viewpoints: Any = None,
    ) -> None:
        """Add a fragment.

        Parameters
        ----------
        cloud : PreparedCloud or points, optional
            Points as `prepare` takes them are prepared here. None: a node without a cloud.
        world_from_fragment : (4, 4) array, optional
            Metres. Odometry to other fragments replaces it.
        session : int
            Fragments of one session share a world.
        time : float
            Seconds.
        up : (3,) array, optional
            Up in the fragment's frame: registrations keep gravity.
        viewpoints : (V, 3) or (3,) array, "auto", "none" or "model", optional
            Sensor positions of points that are prepared here, as for `prepare`.
        """
        if cloud is not None and not isinstance(cloud, PreparedCloud):
            cloud = prepare(
                cloud,
                viewpoints=viewpoints,
                options=self._options.registration.prepare,
                context=self._context,
            )
        elif viewpoints is not None:
            raise TypeError("viewpoints: only for points, a PreparedCloud has its own")
        pose = np.eye(4) if world_from_fragment is None else _matrix(world_from_fragment)
        assert pose is not None
        self._core.add(id, cloud, pose, session, float(time), _matrix(up))

    def add_odometry(
        self, source: int, target: int, target_from_source: Any, covariance: Any = None
    ) -> None:
        """Add a relative pose by tracking: p_target = target_from_source @ p_source.

        The (6, 6) covariance is that of the right perturbation: rotation (radians) first, then
        translation (metres), in the source's frame.
        """
        pose = np.asarray(target_from_source, np.float64)
        self._core.add_odometry(source, target, pose, _matrix(covariance))

    def set_covisible(self, id: int, others: Iterable[int]) -> None:
        """Tracking has closed these pairs already: they are not proposed."""
        self._core.set_covisible(id, list(others))

    def propose(self, source: int, target: int, prior: RegistrationPrior | None = None) -> None:
        """Register a pair before all others: the host's place recognition."""
        self._core.propose(source, target, prior)

    def add_loop(
        self,
        source: int,
        target: int,
        target_from_source: Any,
        information: Any = None,
        confidence: float = 0.5,
    ) -> None:
        """Add a loop that the host found: images, GNSS, tags."""
        pose = np.asarray(target_from_source, np.float64)
        self._core.add_loop(source, target, pose, _matrix(information), confidence)

    def add_result(self, source: int, target: int, result: RegistrationResult) -> None:
        """Add the result of an `align` that the host ran itself."""
        self._core.add_result(source, target, result)

    def set_poses(self, poses: Mapping[int, Any]) -> None:
        """Take over poses that the host has optimised: world_from_fragment by id."""
        self._core.set_poses({id: np.asarray(pose, np.float64) for id, pose in poses.items()})

    def remove(self, id: int) -> None:
        """Forget a fragment; its edges are marginalised onto its neighbours."""
        self._core.remove(id)

    def process(
        self, *, milliseconds: float | None = None, registrations: int | None = None
    ) -> LoopUpdate:
        """Register what is due, verify the loops, optimise.

        Other threads run meanwhile. Ctrl-C ends it between two chunks of registrations; nothing is
        lost, and the next call goes on.
        """
        return self._core.process(milliseconds, registrations)

    @property
    def poses(self) -> dict[int, Any]:
        """world_from_fragment by id, as of the last `process`."""
        return self._core.poses

    @property
    def frames(self) -> dict[int, int]:
        """By id, the smallest id of the fragments that are in one frame with it."""
        return self._core.frames

    @property
    def loops(self) -> list[_core.Loop]:
        """Every loop of fragments present, as of the last `process`."""
        return self._core.loops

    def graph(self) -> PoseGraph:
        """Odometry and accepted loops, for ``pose_graph``."""
        return self._core.graph()

    def save(self, path: Path) -> None:
        """Write the whole state but the clouds and the options, completely or not at all."""
        self._core.save(os.fspath(path))

    def load(self, path: Path, clouds: Callable[[int], PreparedCloud]) -> None:
        """Replace the state by a saved one; ``clouds(id)`` returns the fragments' clouds again."""
        self._core.load(os.fspath(path), clouds)

    def __len__(self) -> int:
        return len(self._core)


__all__ = ["LoopCloser"]
