# SPDX-License-Identifier: BSD-3-Clause
"""From unordered scans to one map."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._arrays import float64, index_pairs
from ._audit import Audit, options_of
from ._contexts import checked, context_of
from ._core import (
    AuditOptions,
    Context,
    MapGraph,
    ReconstructionOptions,
    RegistrationOptions,
    RegistrationResult,
)
from ._map import Map
from ._progress import Progress, batch_progress
from .fragments import FragmentSet, fragment_set
from .preparation import check_enough, usable_fragments
from .registration import ALIGNED, align_batch


def reconstruct(
    fragments: Any,
    pairs: Any = None,
    *,
    results: Any = None,
    odometry: Any = None,
    audit: bool = True,
    refine: bool = True,
    options: RegistrationOptions | None = None,
    map_options: ReconstructionOptions | None = None,
    audit_options: AuditOptions | None = None,
    context: Context | None = None,
    progress: Progress = False,
) -> Map:
    """Make one map of unordered scans. No pose needs to be known.

    Parameters
    ----------
    fragments : FragmentSet, path, or sequence of clouds
        A path as for `FragmentSet.from_directory`: a folder, a pattern, a list.
    pairs : "all", list of pairs, (M, 2) array, or callable, optional
        Pairs of fragment numbers that are aligned, see `FragmentSet.choose_pairs`; default "all",
        and `gpureg.pruning.Nearest` for large sets. With a sequence as results: rows (source,
        target) of fragment numbers, as given to `align_batch`.
    results : sequence of RegistrationResult, or BatchRun, optional
        Instead of aligning: one result per pair, or what `register_all` returned. The table of a
        `register_all` keeps the best pose of a pair only, so that other modes take no part.
    odometry : path, (N, 4, 4) array, or sequence, optional
        Known poses: a trajectory file (TUM with numbers or names as times, or poses.txt),
        ``world_from_scan`` of each fragment (NaN: not known), of both of which consecutive ones
        count, a Redwood log of pairs, or tuples (source, target, target_from_source) of fragment
        numbers, with a 6x6 information matrix as a fourth entry if it is known.
    audit : bool
        Ask the scans whether they contradict each other where the map puts them, and take edges
        out that cannot be right. Clouds are needed, and prepared if `results` are given.
    refine : bool
        Refine all poses together at half the voxel size.
    options : RegistrationOptions, optional
        Of the alignment.
    map_options : ReconstructionOptions, optional
        Of the map: drift of the odometry, confidences, islands. Default: those of the voxel size.
    audit_options : AuditOptions, optional
        Of the audit. Default: those of the voxel size.
    context : Context, optional
    progress : bool or callable
        True: bars of tqdm. A callable gets (done, total) of each step: fragments, pairs, fragments
        again, iterations.

    Returns
    -------
    Map
        A scan that cannot be read or prepared is left out, with the reason "unusable".

    Raises
    ------
    ValueError
        Naming the argument: a repeated pair, an unknown fragment, results of another number.
    IoError
        If fewer than two fragments can be used.
    BatchInterrupted
        After Ctrl-C during the alignment; its ``results`` hold what is done.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> map = gpureg.reconstruct([cloud, cloud + [0.5, 0, 0], cloud - [0, 2, 0]])
    >>> map.islands, map.poses[1, :3, 3].round(2).tolist()  # doctest: +SKIP
    ([[0, 1, 2]], [-0.5, 0.0, 0.0])
    """
    options, audit_options = options_of(options, audit_options)
    map_options = checked(
        map_options, ReconstructionOptions, "map_options"
    ) or ReconstructionOptions.from_voxel_size(options.prepare.voxel_size)
    map_options.validate()
    context = context_of(context)
    if map_options.threads == 0 and context.backend == "cpu":
        map_options = map_options.replace(threads=context.threads)
    fragments = fragment_set(fragments)
    fragments.check_files()
    rows, values = _pair_results(fragments, pairs, results)
    known = _odometry(odometry, fragments)
    unusable: dict[int, str] = {}
    clouds: list[_core.PreparedCloud] = []
    if audit or values is None:
        clouds = usable_fragments(fragments, options.prepare, context, progress, unusable)
    elif refine:
        _find_unreadable(fragments, options.prepare, unusable)
    usable = fragments
    if unusable:
        usable = fragments.without(unusable)
        rows, values = _pairs_of_others(rows, values, unusable, len(fragments))
        known = _odometry_of_others(odometry, known, unusable, fragments)
    if values is None:
        values = align_batch(clouds, rows, options=options, context=context, progress=progress)
    graph, record, places_look_alike = _core.reconstruct_map(
        len(usable),
        rows,
        values,
        map_options,
        known,
        context,
        clouds if audit else [],
        options,
        audit_options,
    )
    del clouds
    refinement = _refine(graph, usable, options, context, progress) if refine else None
    found = None if record is None else Audit._of(record, usable.numbers)
    return Map(graph, usable, options, refinement, fragments, unusable, found, places_look_alike)


def _positions(fragments: FragmentSet, numbers: npt.NDArray[np.int64], name: str) -> Any:
    known = np.asarray(fragments.numbers, np.int64)
    if len(numbers) == 0:
        return np.zeros((0, 2), np.uint32)
    positions = np.minimum(np.searchsorted(known, numbers), len(known) - 1)
    unknown = known[positions] != numbers
    if unknown.any():
        raise ValueError(f"{name}: there is no fragment {numbers[unknown][0]}")
    return positions.astype(np.uint32)


def _pair_results(
    fragments: FragmentSet, pairs: Any, results: Any
) -> tuple[npt.NDArray[np.uint32], list[RegistrationResult] | None]:
    """None: the pairs are to be aligned."""
    if results is None:
        chosen = fragments.choose_pairs("all" if pairs is None else pairs)
        return np.ascontiguousarray(chosen[:, ::-1], np.uint32), None  # the later into the earlier
    if hasattr(results, "table"):  # a BatchRun
        if pairs is not None:
            raise TypeError("pairs: those of a BatchRun come with its results")
        return _from_table(fragments, results.table())
    if pairs is None:
        raise TypeError("pairs: needed with results, one per result")
    values = list(results)
    for k, value in enumerate(values):
        if not isinstance(value, RegistrationResult):
            raise TypeError(f"results[{k}]: expected a RegistrationResult, got {value!r}")
    entries = index_pairs(pairs, "pairs", None)
    if len(entries) != len(values):
        raise ValueError(f"results: {len(values)} for {len(entries)} pairs")
    return _positions(fragments, entries.astype(np.int64), "pairs"), values


def _pairs_of_others(
    rows: npt.NDArray[np.uint32],
    values: list[RegistrationResult] | None,
    unusable: Collection[int],
    count: int,
) -> tuple[npt.NDArray[np.uint32], list[RegistrationResult] | None]:
    """Without those of unusable fragments, as positions among the others."""
    places = np.array([k not in unusable for k in range(count)])
    kept = np.flatnonzero(places[rows].all(axis=1))
    rows = (np.cumsum(places) - 1)[rows[kept]].astype(np.uint32)
    return rows, None if values is None else [values[k] for k in kept.tolist()]


def _from_table(
    fragments: FragmentSet, table: Any
) -> tuple[npt.NDArray[np.uint32], list[RegistrationResult]]:
    columns = {
        name: table[name].to_pylist()
        for name in ("i", "j", "status", "score", "target_from_source", "information")
    }
    numbers = np.stack([columns["j"], columns["i"]], axis=1).astype(np.int64)
    values = []
    for status, score, pose, information in zip(
        columns["status"],
        columns["score"],
        columns["target_from_source"],
        columns["information"],
        strict=True,
    ):
        values.append(
            _core.result_of_row(
                status in ALIGNED,
                None if pose is None else np.reshape(pose, (4, 4)),
                score,
                None if information is None else np.reshape(information, (6, 6)),
            )
        )
    return _positions(fragments, numbers, "results"), values


def _odometry(odometry: Any, fragments: FragmentSet) -> Any:
    """As the core takes it."""
    if odometry is None:
        return []
    if isinstance(odometry, str | os.PathLike):
        return _from_file(odometry, fragments)
    if hasattr(odometry, "shape"):
        poses = float64(odometry, "odometry")
        if poses.shape != (len(fragments), 4, 4):
            raise ValueError(
                f"odometry: expected shape ({len(fragments)}, 4, 4), got {poses.shape}"
            )
        return poses
    out = []
    for k, entry in enumerate(odometry):
        if not isinstance(entry, Sequence) or len(entry) not in (3, 4):
            raise TypeError(f"odometry[{k}]: expected (source, target, pose), got {entry!r}")
        numbers = np.asarray([[entry[0], entry[1]]], np.int64)
        source, target = _positions(fragments, numbers, f"odometry[{k}]")[0].tolist()
        information = entry[3] if len(entry) == 4 else None
        out.append((source, target, float64(entry[2], f"odometry[{k}]"), information))
    return out


def _from_file(
    path: str | os.PathLike[str], scans: FragmentSet, unusable: Sequence[int] = ()
) -> list[Any]:
    return list(
        _core.read_odometry(
            os.fspath(path), scans.numbers, scans.names, "the set of fragments", list(unusable)
        )
    )


def _odometry_of_others(
    odometry: Any, known: Any, unusable: Collection[int], of: FragmentSet
) -> Any:
    """known: `_odometry` of the whole set."""
    kept = [k for k in range(len(of)) if k not in unusable]
    if isinstance(odometry, str | os.PathLike):
        return _from_file(odometry, of.without(unusable), [of.numbers[k] for k in unusable])
    if isinstance(known, np.ndarray):
        return known[kept]
    places = {k: place for place, k in enumerate(kept)}
    return [
        (places[edge[0]], places[edge[1]], *edge[2:])
        for edge in known
        if edge[0] in places and edge[1] in places
    ]


def _find_unreadable(
    fragments: FragmentSet, options: _core.PrepareOptions, unusable: dict[int, str]
) -> None:
    for k in range(len(fragments)):
        try:
            fragments.load(k, options)
        except OSError as error:
            unusable[k] = str(error)
    check_enough(fragments, unusable)


def _refine(
    graph: MapGraph,
    fragments: FragmentSet,
    options: RegistrationOptions,
    context: Context,
    progress: Progress,
) -> dict[str, Any]:
    placed = [k for k, scan in enumerate(graph.scans) if scan[0]]
    surfaces: list[_core.Surface | None] = [None] * len(fragments)
    finer = _core.surface_options(options.prepare)
    with batch_progress(progress, "preparing", len(placed), unit="cloud") as report:
        for done, k in enumerate(placed, 1):
            surfaces[k] = _core.surface_of(context, fragments.load(k, finer), options.prepare)
            if report is not None:
                report(done)
    with batch_progress(progress, "refining", _core.REFINE_ITERATIONS, unit="step") as report:
        tell = None if report is None else report
        return _core.refine_map(context, graph, surfaces, options.prepare.voxel_size, tell)


__all__ = ["reconstruct"]
