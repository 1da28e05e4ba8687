# SPDX-License-Identifier: BSD-3-Clause
"""Loop consistency among the pairs of one set of clouds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from . import _core
from ._arrays import index_pairs
from ._core import LoopConsistencyOptions, PairConsistency, RegistrationResult


def loop_consistency(
    pairs: Any,
    results: Sequence[RegistrationResult],
    *,
    options: LoopConsistencyOptions | None = None,
) -> list[PairConsistency]:
    """Re-scores every pair by loops of three clouds and by the most confident path between its
    clouds.

    Correct poses around a loop of clouds compose to the identity. Perceptual aliases agree with each
    other in loops of three, but not with the path from one place to the other.

    Parameters
    ----------
    pairs : (M, 2) integer array or list of pairs
        Rows (source, target), as given to `align_batch`.
    results : sequence of RegistrationResult
        One per pair, as `align_batch` returns them. They are not changed.
    options : LoopConsistencyOptions, optional
        ``voxel_size`` is that of the clouds; default 0.05.

    Returns
    -------
    list of PairConsistency
        ``confidence`` given all pairs; ``mode``, an index into ``RegistrationResult.modes``;
        ``loops``, the number of loops of three that the pair is in; ``path``, the number of pairs on
        the path that it was compared with. Without loops and path the confidence is the result's
        confidence.

    Raises
    ------
    ValueError
        Naming the entry: different lengths, confidences outside [0, 1], poses that are no rigid motions.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> cloud = np.random.default_rng(1).random((2000, 3))
    >>> pairs = [(0, 1), (1, 2), (0, 2)]
    >>> results = gpureg.align_batch([cloud, cloud + [0.5, 0, 0], cloud - [0, 2, 0]], pairs)
    >>> [(p.mode, p.loops) for p in gpureg.loop_consistency(pairs, results)]
    [(0, 1), (0, 1), (0, 1)]
    """
    if options is not None and not isinstance(options, LoopConsistencyOptions):
        raise TypeError(f"options: expected LoopConsistencyOptions, got {options!r}")
    results = list(results)
    for k, result in enumerate(results):
        if not isinstance(result, RegistrationResult):
            raise TypeError(f"results[{k}]: expected a RegistrationResult, got {result!r}")
    entries = index_pairs(pairs, "pairs", None)
    return _core.loop_consistency(entries, results, options or LoopConsistencyOptions())


__all__ = ["loop_consistency"]
