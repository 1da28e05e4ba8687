# SPDX-License-Identifier: BSD-3-Clause
"""Where a finished map contradicts its own scans."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _core
from ._arrays import float64
from ._contexts import checked, context_of
from ._core import AuditOptions, Context, PreparedCloud, RegistrationOptions
from ._map import Map, Poses
from ._progress import Progress
from .fragments import FragmentSet, fragment_set, options_for
from .preparation import usable_fragments


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
    """Two parts of a map and all pairs between them, which give one verdict.

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
    island : int
        Index into ``Audit.islands``.
    """

    verdict: str
    confidence: float
    supporting: int
    contradicting: int
    contradictions: list[int]
    island: int
    _order: Any = dataclasses.field(repr=False, compare=False)
    _part: slice = dataclasses.field(repr=False)

    @property
    def scans(self) -> list[int]:
        """Numbers of the fragments of the smaller part."""
        return sorted(self._order[self._part])


@dataclasses.dataclass(frozen=True)
class AuditedIsland:
    """Scans that have one frame.

    Attributes
    ----------
    scans : list of int
        Numbers of the fragments.
    verdict : str
        "sound", "contradicted" or "undecided", as of `Audit`.
    """

    scans: list[int]
    verdict: str


@dataclasses.dataclass(frozen=True)
class Audit:
    """What the scans of a map say about it.

    Attributes
    ----------
    verdict : str
        "contradicted": a connection is; "sound": none is, and in every island of two scans or more
        more connections are confirmed than undecided; else "undecided", as of poses in other units
        or of other scans, which keep most scans out of each other's sight.
    islands : list of AuditedIsland
    pairs : list of AuditedPair
    connections : list of AuditedConnection
        The least confident first.
    """

    verdict: str
    islands: list[AuditedIsland]
    pairs: list[AuditedPair]
    connections: list[AuditedConnection]
    _record: Any = dataclasses.field(repr=False, compare=False)

    @property
    def sound(self) -> bool:
        """Whether the verdict is "sound"."""
        return self.verdict == "sound"

    @classmethod
    def _of(cls, record: _core.AuditRecord, numbers: Sequence[int]) -> Audit:
        order = [numbers[k] for k in record.order]
        return cls(
            record.verdict,
            [
                AuditedIsland([numbers[k] for k in scans], verdict)
                for scans, verdict in zip(record.islands, record.verdicts, strict=True)
            ],
            [AuditedPair(numbers[row[0]], numbers[row[1]], *row[2:]) for row in record.pairs],
            [
                AuditedConnection(*row[:6], order, slice(row[6], row[6] + row[7]))
                for row in record.connections
            ],
            record,
        )


@dataclasses.dataclass(frozen=True)
class MendedMap:
    """A map that was put together again where its audit contradicted it.

    Attributes
    ----------
    poses : (N, 4, 4) float64
        Of each fragment, in the frame of its island; NaN: what is right could not be found.
    moved : list of int
        Numbers of the fragments that got another pose.
    left_out : list of int
        Of those that have none any more.
    registered : int
        Pairs that were aligned.
    audit : Audit
        Of the mended map.
    """

    poses: Poses
    moved: list[int]
    left_out: list[int]
    registered: int
    audit: Audit


def audit(
    fragments: Any,
    poses: Any,
    *,
    options: RegistrationOptions | None = None,
    audit_options: AuditOptions | None = None,
    context: Context | None = None,
    progress: Progress = False,
) -> Audit:
    """Say where a finished map, of any program, contradicts its own scans. No truth is needed.

    Parameters
    ----------
    fragments : FragmentSet, path as for `FragmentSet.from_directory`, or sequence of clouds
    poses : Map, path, or (N, 4, 4) array
        A `Map`, or the output folder of ``gpureg reconstruct``: island by island. Of one frame:
        ``world_from_scan`` of each fragment, NaN if it has none; or a file, as for
        ``gpureg audit``: a trajectory (TUM with numbers or names of fragments as times, KITTI, or
        poses.txt), g2o, or a Redwood log of scans or of pairs.
    options : RegistrationOptions, optional
        Default: those of the voxel size of the map, or of the one that some fragments suggest.
    audit_options : AuditOptions, optional
        Default: those of the voxel size.
    context : Context, optional
    progress : bool or callable

    Returns
    -------
    Audit
        Without fragments that cannot be read or prepared.

    Raises
    ------
    ValueError
        Naming the pose that is no rigid motion; for a folder without a finished map.
    IoError
        Naming the file that holds no poses of these fragments.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> gpureg.audit([cloud, cloud], np.stack([np.eye(4)] * 2)).verdict
    'sound'
    """
    audit_options = checked_options(options, audit_options)
    context = context_of(context)
    fragments = fragment_set(fragments)
    fragments.check_files()
    matrices, islands = _map_of(poses, fragments)
    options = options_for(
        options, fragments, poses._options.voxel_size if isinstance(poses, Map) else 0
    )
    clouds, kept = _usable(fragments, options, context, progress)
    record = _core.audit(
        context, clouds, matrices[kept], _islands_of(islands, kept), options, audit_options
    )
    return Audit._of(record, [fragments.numbers[k] for k in kept])


def mend(
    fragments: Any,
    poses: Any,
    *,
    audit: Audit | None = None,
    options: RegistrationOptions | None = None,
    audit_options: AuditOptions | None = None,
    context: Context | None = None,
    progress: Progress = False,
) -> MendedMap:
    """Align again across what an audit contradicts, and put the parts together.

    What is still contradicted then has no pose any more. Islands that are not contradicted stay as
    they are.

    Parameters
    ----------
    fragments, poses, options, audit_options, context, progress
        As for `audit`.
    audit : Audit, optional
        The result of `audit` for the same poses; None: the map is audited first.

    Returns
    -------
    MendedMap

    Raises
    ------
    ValueError
        As `audit`; for an audit of another number of scans.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> gpureg.mend([cloud, cloud], np.stack([np.eye(4)] * 2)).moved
    []
    """
    audit_options = checked_options(options, audit_options)
    context = context_of(context)
    fragments = fragment_set(fragments)
    fragments.check_files()
    matrices, islands = _map_of(poses, fragments)
    options = options_for(
        options, fragments, poses._options.voxel_size if isinstance(poses, Map) else 0
    )
    found = checked(audit, Audit, "audit")
    clouds, kept = _usable(fragments, options, context, progress)
    islands, numbers = _islands_of(islands, kept), [fragments.numbers[k] for k in kept]
    placed = np.flatnonzero(np.isfinite(matrices[kept]).all(axis=(1, 2)))
    if found is not None and sorted(found._record.order) != placed.tolist():
        raise ValueError("audit: it is not one of these poses")
    record = (
        _core.audit(context, clouds, matrices[kept], islands, options, audit_options)
        if found is None
        else found._record
    )
    mended, moved, left_out, registered, after = _core.mend(
        context, clouds, matrices[kept], islands, record, options, audit_options
    )
    poses = np.full(matrices.shape, np.nan)
    poses[kept] = mended
    return MendedMap(
        poses,
        [numbers[k] for k in moved],
        [numbers[k] for k in left_out],
        registered,
        Audit._of(after, numbers),
    )


def _usable(
    fragments: FragmentSet, options: RegistrationOptions, context: Context, progress: Progress
) -> tuple[list[PreparedCloud], list[int]]:
    """Prepared, and their positions."""
    unusable: dict[int, str] = {}
    clouds = usable_fragments(fragments, options, context, progress, unusable)
    return clouds, [k for k in range(len(fragments)) if k not in unusable]


def _islands_of(islands: list[int], kept: list[int]) -> list[int]:
    """Of the kept fragments: islands that have none of them do not count."""
    counted: dict[int, int] = {}
    return [counted.setdefault(islands[k], len(counted)) for k in kept]


def checked_options(
    options: RegistrationOptions | None, audit_options: AuditOptions | None
) -> AuditOptions:
    """What is wrong with them shall be said before the fragments are read."""
    if options is not None:
        checked(options, RegistrationOptions, "options").validate()
    audit_options = checked(audit_options, AuditOptions, "audit_options") or AuditOptions()
    audit_options.validate()
    return audit_options


def _map_of(poses: Any, fragments: FragmentSet) -> tuple[Poses, list[int]]:
    """Poses of the fragments, and the island of each."""
    one = [0] * len(fragments)
    if isinstance(poses, Map):
        if poses.numbers != fragments.numbers:
            raise ValueError("poses: the map is of other fragments")
        return poses.poses, [scan.island or 0 for scan in poses.scans]
    if not isinstance(poses, str | os.PathLike):
        matrices = float64(poses, "poses")
        if matrices.shape != (len(fragments), 4, 4):
            raise ValueError(
                f"poses: expected shape ({len(fragments)}, 4, 4), got {matrices.shape}"
            )
        return matrices, one
    path = os.fspath(poses)
    if not (os.path.isdir(path) or path.endswith(".json")):
        return _core.read_pose_file(path, fragments.numbers, fragments.names, "fragments")
    matrices = np.full((len(fragments), 4, 4), np.nan)
    islands = _read_map(path, fragments, matrices)
    if np.isfinite(matrices[:, 0, 0]).sum() < 2:
        raise ValueError(f"poses: {path} holds no poses of two fragments")
    return matrices, islands


def _read_map(path: str, fragments: FragmentSet, matrices: Poses) -> list[int]:
    """Fills in the poses of a reconstruction.json, and returns the island of each fragment. Names
    count before numbers, which are places where files came and went.
    """
    file = os.path.join(path, "reconstruction.json") if os.path.isdir(path) else path
    if not os.path.exists(file):
        raise ValueError(
            f"poses: there is no {file}, which `gpureg reconstruct` writes when all else is there"
        )
    islands = [0] * len(fragments)
    counted: dict[int, int] = {}  # islands without a fragment here do not count
    try:
        with open(file, encoding="utf-8") as text:
            scans = json.load(text)["scans"]
        known: tuple[Any, ...] = fragments.names
        key = "name"
        if not set(known) & {scan.get(key) for scan in scans}:
            known, key = fragments.numbers, "id"
        positions = {name: k for k, name in enumerate(known)}
        for scan in scans:
            k = positions.get(scan[key])
            if k is None or scan["island"] is None:
                continue
            matrices[k] = np.reshape(scan["island_from_scan"], (4, 4))
            islands[k] = counted.setdefault(scan["island"], len(counted))
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"poses: {file} is no map of `gpureg reconstruct`: {error!r}") from None
    return islands


__all__ = [
    "Audit",
    "AuditedConnection",
    "AuditedIsland",
    "AuditedPair",
    "MendedMap",
    "audit",
    "checked_options",
    "mend",
]
