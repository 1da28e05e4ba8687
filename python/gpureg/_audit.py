# SPDX-License-Identifier: BSD-3-Clause
"""Where a finished map contradicts its own scans."""

from __future__ import annotations

import dataclasses
import os
from typing import Any

from . import _core
from ._arrays import float64
from ._contexts import checked, context_of
from ._core import Context, RegistrationOptions
from ._progress import Progress
from ._reconstruction import usable_fragments
from .fragments import FragmentSet, fragment_set


@dataclasses.dataclass(frozen=True)
class AuditedPair:
    """Two scans that are near each other in a map.

    Attributes
    ----------
    source : int
        Number of a fragment.
    target : int
        The same.
    verdict : str
        "supports", "contradicts" or "silent".
    log_likelihood_ratio : float
        Logarithm of: how much more likely such evidence is at a right pose than at a wrong one.
    overlap : float
        Share of points on the other scan's surfaces.
    observed : float
        Share of points in its view.
    free_space_violation : float
        Of these, the share in free space.
    shift : float
        Metres by which ICP moves the overlap.
    """

    source: int
    target: int
    verdict: str
    log_likelihood_ratio: float
    overlap: float
    observed: float
    free_space_violation: float
    shift: float


@dataclasses.dataclass(frozen=True)
class AuditedConnection:
    """A place where a map would fall into two parts; all pairs across it are judged together.

    Attributes
    ----------
    verdict : str
        "confirmed", "contradicted" or "undecided".
    confidence : float
        Probability that the parts lie right to each other.
    supporting : int
        Pairs across it.
    contradicting : int
        The same.
    contradictions : list of int
        Indices into ``Audit.pairs``, the strongest first.
    """

    verdict: str
    confidence: float
    supporting: int
    contradicting: int
    contradictions: list[int]
    _order: Any = dataclasses.field(repr=False, compare=False)
    _part: slice = dataclasses.field(repr=False)

    @property
    def scans(self) -> list[int]:
        """Numbers of the fragments of the smaller part."""
        return sorted(self._order[self._part])


@dataclasses.dataclass(frozen=True)
class Audit:
    """What the scans of a map say about it.

    Attributes
    ----------
    pairs : list of AuditedPair
    connections : list of AuditedConnection
        The least confident first.
    """

    pairs: list[AuditedPair]
    connections: list[AuditedConnection]

    @property
    def sound(self) -> bool:
        """Whether no connection is contradicted."""
        return all(connection.verdict != "contradicted" for connection in self.connections)


def audit(
    fragments: Any,
    poses: Any,
    *,
    options: RegistrationOptions | None = None,
    context: Context | None = None,
    progress: Progress = False,
) -> Audit:
    """Say where a finished map, of any program, contradicts its own scans. No truth is needed.

    Parameters
    ----------
    fragments : FragmentSet, folder, or sequence of clouds
    poses : path, or (N, 4, 4) array
        ``world_from_scan`` of each fragment, NaN where it has none; or a file, as for `gpureg
        audit`: a trajectory (TUM with fragment numbers as times, KITTI, or poses.txt), g2o, or a
        Redwood log of scans or of pairs.
    options : RegistrationOptions, optional
    context : Context, optional
    progress : bool or callable

    Returns
    -------
    Audit
        Without fragments that cannot be read or prepared.

    Raises
    ------
    ValueError
        Naming the pose that is no rigid motion.
    IoError
        Naming the file that holds no poses of these fragments.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> gpureg.audit([cloud, cloud], np.stack([np.eye(4)] * 2)).sound
    True
    """
    options = checked(options, RegistrationOptions, "options") or RegistrationOptions()
    options.validate()
    context = context_of(context)
    fragments = fragment_set(fragments)
    fragments.check_files()
    matrices = _poses(poses, fragments)
    unusable: dict[int, str] = {}
    clouds = usable_fragments(fragments, options.prepare, context, progress, unusable)
    if unusable:
        kept = [k for k in range(len(fragments)) if k not in unusable]
        fragments, matrices = fragments.without(unusable), matrices[kept]
    pairs, connections, order = _core.audit(context, clouds, matrices, options)
    numbers = [int(number) for number in fragments.numbers]
    order = [numbers[k] for k in order]
    return Audit(
        [AuditedPair(numbers[row[0]], numbers[row[1]], *row[2:]) for row in pairs],
        [AuditedConnection(*row[:5], order, slice(row[5], row[5] + row[6])) for row in connections],
    )


def _poses(poses: Any, fragments: FragmentSet) -> Any:
    if not isinstance(poses, str | os.PathLike):
        matrices = float64(poses, "poses")
        if matrices.shape != (len(fragments), 4, 4):
            raise ValueError(
                f"poses: expected shape ({len(fragments)}, 4, 4), got {matrices.shape}"
            )
        return matrices
    return _core.read_map_poses(os.fspath(poses), list(fragments.numbers), "fragments")


__all__ = ["Audit", "AuditedConnection", "AuditedPair", "audit"]
