# SPDX-License-Identifier: BSD-3-Clause
"""From unordered scans to one map."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._arrays import float64, index_pairs
from ._audit import Audit, checked_options
from ._contexts import checked, context_of
from ._core import (
    AuditOptions,
    Context,
    ReconstructionOptions,
    RegistrationOptions,
    RegistrationResult,
)
from ._map import Map
from ._progress import Progress, Report, batch_progress
from .fragments import FragmentSet, fragment_set, options_for
from .registration import scale_range


def reconstruct(
    fragments: Any,
    pairs: Any = None,
    *,
    results: Any = None,
    odometry: Any = None,
    scale: Any = None,
    audit: bool = True,
    refine: bool = True,
    options: RegistrationOptions | None = None,
    map_options: ReconstructionOptions | None = None,
    audit_options: AuditOptions | None = None,
    journal: str | os.PathLike[str] | None = None,
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
    results : sequence of RegistrationResult, BatchRun, or path, optional
        Instead of aligning: one result per pair, what `register_all` returned, or a journal of pairs
        (``pairs.journal`` of a `BatchRun`).
    odometry : path, (N, 4, 4) array, or sequence, optional
        Known poses: a trajectory file (TUM with numbers or names as times, or poses.txt),
        ``world_from_scan`` of each fragment (NaN: not known), of both of which consecutive ones
        count, a Redwood log of pairs, or tuples (source, target, target_from_source) of fragment
        numbers, with a 6x6 information matrix as a fourth entry if it is known.
    scale : "free" or (least, most), optional
        Each scan has an unknown scale of its own, see `Map.scales`; a range is that of any later
        scan to an earlier one. Without results; poses are those of the scaled scans, and so is
        ``odometry``. A journal keeps the pairs that were searched.
    audit : bool
        Ask the scans whether they contradict each other where the map puts them, and take edges
        out that cannot be right. Clouds are needed, and prepared if `results` are given.
    refine : bool
        Refine all poses together at half the voxel size.
    options : RegistrationOptions, optional
        Of the alignment. Default: those of the voxel size of the results, or of the one that some
        fragments suggest.
    map_options : ReconstructionOptions, optional
        Of the map: drift of the odometry, confidences, islands. Default: those of the voxel size.
    audit_options : AuditOptions, optional
        Of the audit. Default: those of the voxel size.
    journal : path, optional
        File that keeps the results of the pairs until the map is complete: the same call goes on
        after an interruption, even a kill -9.
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
        Naming the argument: a repeated pair, an unknown fragment, results of another number, a
        journal of another run.
    IoError
        If fewer than two fragments can be used, or the journal is damaged.
    KeyboardInterrupt
        After Ctrl-C.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> map = gpureg.reconstruct([cloud, cloud + [0.5, 0, 0], cloud - [0, 2, 0]])
    >>> map.islands, map.poses[1, :3, 3].round(2).tolist()  # doctest: +SKIP
    ([[0, 1, 2]], [-0.5, 0.0, 0.0])
    """
    audit_options = checked_options(options, audit_options)
    map_options = (
        checked(map_options, ReconstructionOptions, "map_options") or ReconstructionOptions()
    )
    map_options.validate()
    context = context_of(context)
    fragments = fragment_set(fragments)
    fragments.check_files()
    if scale is not None and results is not None:
        raise TypeError("scale: not together with results")
    rows, values = _pair_results(fragments, pairs, results)
    known = next((value.voxel_size for value in values or () if value.voxel_size), 0)
    if known == 0 and journal is not None and scale is None:  # else it is of the search
        known = _core.voxel_size_of_journal(os.fspath(journal))
    source = fragments._core(fingerprints=journal is not None)
    found, searched = None, ""
    if scale is not None:
        # The journal is of the search alone: the map takes less time.
        searched, journal = os.fspath(journal or ""), None
        found = _find_scales(source, len(fragments), scale, options, context, searched, progress)
    if found is not None:
        fragments = fragments.scaled([s for s, _ in found])
    options = options_for(options, fragments, known)
    steps = _Steps(progress)
    try:
        made = _core.reconstruct_set(
            context,
            source,
            rows,
            values,
            _odometry(odometry, fragments),
            _core.ReconstructOptions(
                options, map_options, audit_options, audit, refine, os.fspath(journal or "")
            ),
            None if found is None else [s for s, _ in found],
            steps if progress else None,
        )
    finally:
        steps.close()
    if found is not None:
        fragments = fragments.scaled(made["scales"])
    if searched:
        os.remove(searched)
    unusable = made["unusable"]
    usable = fragments.without(unusable) if unusable else fragments
    audited = None if made["audit"] is None else Audit._of(made["audit"], usable.numbers)
    return Map(
        made["map"],
        usable,
        options,
        made["refinement"],
        fragments,
        unusable,
        audited,
        made["places_look_alike"],
    )


def _find_scales(
    source: _core.FragmentSource,
    count: int,
    scale: Any,
    options: RegistrationOptions | None,
    context: Context,
    journal: str,
    progress: Progress,
) -> list[tuple[float, int]]:
    """(scale, part) of each fragment."""
    total = count * (count - 1) // 2
    least, most = scale_range(scale)
    with batch_progress(progress, "finding scales", total) as report:
        return _core.find_scales(
            context,
            source,
            least,
            most,
            options or RegistrationOptions(),
            journal,
            None if report is None else lambda done, _: report(done),
        )


class _Steps:
    """Progress of one step after another."""

    TITLES = (
        ("preparing", "cloud"),
        ("aligning", "pair"),
        ("preparing", "cloud"),
        ("refining", "step"),
    )

    def __init__(self, progress: Progress) -> None:
        self._progress, self._step = progress, -1
        self._stack = contextlib.ExitStack()
        self._report: Report | None = None

    def __call__(self, step: int, done: int, total: int) -> None:
        if step != self._step:
            self.close()
            self._step = step
            title, unit = self.TITLES[step]
            self._report = self._stack.enter_context(
                batch_progress(self._progress, title, total, done, unit)
            )
        if self._report is not None:
            self._report(done)

    def close(self) -> None:
        self._stack.close()


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
    """Rows (source, target). None: the pairs are to be aligned."""
    if results is None:
        chosen = fragments.choose_pairs("all" if pairs is None else pairs)
        return np.ascontiguousarray(chosen[:, ::-1], np.uint32), None  # the later into the earlier
    if isinstance(results, str | os.PathLike) or hasattr(results, "journal"):
        if pairs is not None:
            raise TypeError("pairs: those of a run come with its results")
        path = results.journal if hasattr(results, "journal") else results
        names, rows, values = _core.read_journal(os.fspath(path))
        places = {name: k for k, name in enumerate(fragments.names)}
        strange = next((name for name in names if name not in places), None)
        used = set(rows.ravel().tolist())
        places_of = [places.get(name, len(fragments)) for name in names]
        if strange is not None and any(places_of[k] == len(fragments) for k in used):
            raise ValueError(f"results: {path} names {strange}, which fragments lacks")
        return np.asarray(places_of, np.uint32)[rows].reshape(-1, 2), values
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


def _odometry(odometry: Any, fragments: FragmentSet) -> Any:
    """As the core takes it."""
    if odometry is None:
        return []
    if isinstance(odometry, str | os.PathLike):
        return _core.read_odometry(
            os.fspath(odometry), fragments.numbers, fragments.names, "the set of fragments"
        )
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


__all__ = ["reconstruct"]
