# SPDX-License-Identifier: BSD-3-Clause
"""Loops for a SLAM system that tracks by itself."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Union

import numpy as np

from . import _core
from ._contexts import checked, context_of, number_of, whole_number_of
from ._core import (
    Context,
    LoopClosureOptions,
    LoopUpdate,
    PoseGraph,
    PreparedCloud,
    RegistrationOptions,
    RegistrationPrior,
    RegistrationResult,
)
from .preparation import prepare

Path = Union[str, "os.PathLike[str]"]


def _matrix(value: Any) -> np.ndarray | None:
    return None if value is None else np.asarray(value, np.float64)


def _pair(source: Any, target: Any) -> tuple[int, int]:
    return whole_number_of(source, "source"), whole_number_of(target, "target")


class LoopCloser:
    """Finds, verifies and, if wanted, optimises the loops of a SLAM system.

    `process` registers pairs of fragments and says which loops changed their state. `save` and
    `load` wait for it. Every other method returns at once, also while another thread is in
    `process`; only `add` takes the time of preparing points if it is given points. On a GPU that
    waits for the registrations under way. The same calls give the same bits, as long as `process`
    has no time limit.

    Parameters
    ----------
    voxel_size : float
        Metres; every length follows from it. Not used if options are given.
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
        self._options = checked(options, LoopClosureOptions, "options") or LoopClosureOptions(
            registration=RegistrationOptions(voxel_size=voxel_size)
        )
        self._core = _core.LoopCloser(self._context, self._options)
        # process() holds the engine of its context while it registers. Clouds of all CPU contexts
        # are the same.
        cpu = self._context.backend == "cpu"
        self._preparing = Context.cpu(self._context.threads) if cpu else self._context

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
            Points as `prepare` takes them are prepared here. A prepared cloud has the voxel size
            of the closer. None: a node without a cloud.
        world_from_fragment : (4, 4) array, optional
            Metres. As long as no odometry is added between fragments of its session, the motion
            from the pose of the one before is its odometry. Odometry replaces it.
        session : int
            Fragments of one session share a world.
        time : float
            Seconds.
        up : (3,) array, optional
            Up in the fragment's frame: registrations keep gravity.
        viewpoints : (V, 3) or (3,) array, "auto", "none" or "model", optional
            Sensor positions of points that are prepared here, as for `prepare`.

        Raises
        ------
        InvalidArgument
            The id is present; the cloud has no points or another voxel size; the pose is not rigid.
        """
        id = whole_number_of(id, "id")
        session = whole_number_of(session, "session")
        if cloud is not None and not isinstance(cloud, PreparedCloud):
            cloud = prepare(
                cloud,
                viewpoints=viewpoints,
                options=self._options.registration,
                context=self._preparing,
            )
        elif viewpoints is not None:
            raise TypeError("viewpoints: only for points, a PreparedCloud has its own")
        self._core.add(
            id, cloud, _matrix(world_from_fragment), session, number_of(time, "time"), _matrix(up)
        )

    def add_odometry(
        self, source: int, target: int, target_from_source: Any, covariance: Any = None
    ) -> None:
        """Add a relative pose by tracking: p_target = target_from_source @ p_source.

        The (6, 6) covariance is that of the right perturbation: rotation (radians) first, then
        translation (metres), in the source's frame.
        """
        pose = np.asarray(target_from_source, np.float64)
        self._core.add_odometry(*_pair(source, target), pose, _matrix(covariance))

    def set_covisible(self, id: int, others: Iterable[int]) -> None:
        """Tracking has closed these pairs already: they are not proposed."""
        known = [whole_number_of(other, "others") for other in others]
        self._core.set_covisible(whole_number_of(id, "id"), known)

    def propose(self, source: int, target: int, prior: RegistrationPrior | None = None) -> None:
        """Register a pair before all others: the host's place recognition."""
        self._core.propose(*_pair(source, target), checked(prior, RegistrationPrior, "prior"))

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
        self._core.add_loop(
            *_pair(source, target), pose, _matrix(information), number_of(confidence, "confidence")
        )

    def add_result(self, source: int, target: int, result: RegistrationResult) -> None:
        """Add the result of an `align` that the host ran itself."""
        if not isinstance(result, RegistrationResult):
            raise TypeError(f"result: expected a RegistrationResult, got {result!r}")
        self._core.add_result(*_pair(source, target), result)

    def set_poses(self, poses: Mapping[int, Any]) -> None:
        """Take over poses that the host has optimised: world_from_fragment by id."""
        self._core.set_poses(
            {
                whole_number_of(id, "an id of poses"): np.asarray(pose, np.float64)
                for id, pose in poses.items()
            }
        )

    def remove(self, id: int) -> None:
        """Forget a fragment; its edges are marginalised onto its neighbours."""
        self._core.remove(whole_number_of(id, "id"))

    def process(
        self, *, milliseconds: float | None = None, registrations: int | None = None
    ) -> LoopUpdate:
        """Register what is due, verify the loops, optimise.

        `LoopUpdate.changed` has each loop once per change of its state. An accepted loop whose pose
        changes is retracted with the old one and accepted with the new one, in this order: add a
        factor for each accepted loop, take it out for each retracted one.

        Other threads run meanwhile. Ctrl-C ends it within a second on the CPU, on a GPU between two
        chunks of registrations. Nothing is lost: the next call goes on, and returns all that
        changed.
        """
        if milliseconds is not None:
            milliseconds = number_of(milliseconds, "milliseconds")
        if registrations is not None:
            registrations = whole_number_of(registrations, "registrations", 0)
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
        """Replace the state by a saved one; ``clouds(id)`` returns the fragments' clouds again.

        The state stays as it was if the file is damaged (IoError), if it is of another voxel
        size or a cloud is another (InvalidArgument), and if ``clouds`` raises.
        """

        def cloud_of(id: int) -> PreparedCloud:
            cloud = clouds(id)
            if not isinstance(cloud, PreparedCloud):
                raise TypeError(f"clouds({id}): expected a PreparedCloud, got {cloud!r}")
            return cloud

        if not callable(clouds):
            raise TypeError(f"clouds: expected a function of a fragment's id, got {clouds!r}")
        self._core.load(os.fspath(path), cloud_of)

    def __len__(self) -> int:
        return len(self._core)


__all__ = ["LoopCloser"]
