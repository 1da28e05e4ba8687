# SPDX-License-Identifier: BSD-3-Clause
"""Which pairs of a large set are worth trying: those whose fragments look alike.

A fragment's global descriptor is an aggregate of its local features that needs no training; candidates are the k nearest
neighbours (FAISS). The cost of a run then grows as n * k, not as n * n.
"""

from __future__ import annotations

import dataclasses
import time
from typing import Any, List, Optional, Tuple

import numpy as np
import numpy.typing as npt

try:
    import faiss
except ImportError as error:
    raise ImportError("gpureg.pruning needs FAISS: pip install 'gpureg[pruning]'") from error

from . import _core
from ._core import Context, PreparedCloud, PrepareOptions
from .fragments import FragmentSet, fragment_set
from .registration import default_context

_TOGETHER = 32  # clouds in memory at once
_FLAT = 20_000  # fragments up to which the exact search is fast
_COMPONENTS = 128

FloatArray = npt.NDArray[np.float32]
Pairs = npt.NDArray[np.int64]


def describe(cloud: PreparedCloud) -> FloatArray:
    """Global descriptor of a prepared cloud: second-order pooling of its features.

    The mean of f f' over the square roots f of the features, its upper triangle with signed square roots, at unit length.
    Points of any order and number give comparable descriptors; it does not change under rigid motions beyond what the
    downsampling changes.

    Returns
    -------
    (D * (D + 1) / 2,) float32
        561 numbers for FPFH (D = 33); zeros for a cloud without features.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> from gpureg import pruning
    >>> descriptor = pruning.describe(gpureg.prepare(np.random.default_rng(1).random((2000, 3))))
    >>> descriptor.shape, round(float(np.linalg.norm(descriptor)), 3)
    ((561,), 1.0)
    """
    features = cloud.features.astype(np.float64)
    rows, columns = np.triu_indices(cloud.feature_dimension)
    features = features[np.abs(features).sum(axis=1) > 0]
    if len(features) == 0:
        return np.zeros(len(rows), np.float32)
    features = np.sign(features) * np.sqrt(np.abs(features))
    features /= np.linalg.norm(features, axis=1, keepdims=True)
    pooled = (features.T @ features / len(features))[rows, columns]
    pooled = np.sign(pooled) * np.sqrt(np.abs(pooled))
    return np.asarray(pooled / np.linalg.norm(pooled), np.float32)


def describe_all(fragments: Any, *, options: Optional[PrepareOptions] = None, context: Optional[Context] = None) -> FloatArray:
    """(n, 561) descriptors of a set's fragments, which are loaded and prepared a few at a time."""
    fragments, options, context = fragment_set(fragments), options or PrepareOptions(), context or default_context()
    out: List[FloatArray] = []
    for begin in range(0, len(fragments), _TOGETHER):
        inputs = [
            fragments.load(k, options, context.backend == "cuda") for k in range(begin, min(begin + _TOGETHER, len(fragments)))
        ]
        out += [describe(cloud) for cloud in _core.prepare_batch(context, inputs, options)]
    return np.stack(out) if out else np.zeros((0, 0), np.float32)


def whiten(descriptors: FloatArray, components: int = _COMPONENTS) -> FloatArray:
    """Principal components of the set's descriptors, each divided by the root of its deviation, at unit length.

    What all fragments of a scene share (floors, walls) says nothing about which of them overlap.
    """
    centred = descriptors.astype(np.float64) - descriptors.mean(axis=0)
    values, vectors = np.linalg.eigh(centred.T @ centred / max(1, len(centred)))
    kept = np.argsort(values)[::-1][: min(components, max(1, len(descriptors) - 1))]
    kept = kept[values[kept] > 1e-9 * max(float(values.max()), 1e-300)]
    projected = centred @ (vectors[:, kept] / values[kept] ** 0.25)
    lengths = np.linalg.norm(projected, axis=1, keepdims=True)
    return np.ascontiguousarray(projected / np.where(lengths > 0, lengths, 1), dtype=np.float32)


@dataclasses.dataclass
class Nearest:
    """Pairs of each fragment and the k that look most like it: for the argument pairs of `register_all`.

    Parameters
    ----------
    k : int
        Neighbours per fragment. A pair is tried where either has the other among them.
    consecutive : int
        Also the so many fragments that follow each one by number: scans of a walk.
    options : PrepareOptions, optional
        Those of the run, usually.
    context : Context, optional

    Attributes
    ----------
    seconds : float
        Of the last call: descriptors and search.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> from gpureg import pruning
    >>> rng = np.random.default_rng(1)
    >>> clouds = [rng.random((500, 3)) * [1, 1, k % 2] for k in range(6)]  # cubes and squares
    >>> pairs = pruning.Nearest(k=2)(gpureg.FragmentSet.from_clouds(clouds))
    >>> sorted({int(i + j) % 2 for i, j in pairs}), len(pairs)
    ([0], 6)
    """

    k: int = 20
    consecutive: int = 0
    options: Optional[PrepareOptions] = None
    context: Optional[Context] = None
    seconds: float = 0.0

    def __call__(self, fragments: FragmentSet) -> Pairs:
        """(M, 2) pairs i < j of fragment numbers, ascending."""
        if self.k < 1:
            raise ValueError(f"k is {self.k}, expected 1 or more")
        begin = time.monotonic()
        descriptors = whiten(describe_all(fragments, options=self.options, context=self.context))
        positions = nearest_pairs(descriptors, self.k)
        n = len(fragments)
        steps = [np.stack([np.arange(n - s), np.arange(s, n)], axis=1) for s in range(1, min(self.consecutive, n - 1) + 1)]
        positions = np.unique(np.concatenate([positions, *steps]), axis=0)
        self.seconds = time.monotonic() - begin
        return np.asarray(np.asarray(fragments.numbers, np.int64)[positions], np.int64).reshape(-1, 2)


def nearest_pairs(descriptors: FloatArray, k: int) -> Pairs:
    """(M, 2) positions i < j where either has the other among its k nearest. Exact for sets of up to 20,000."""
    n, dimension = descriptors.shape
    k = min(k + 1, n)  # the nearest of each is itself
    index = faiss.IndexFlatIP(dimension) if n <= _FLAT else faiss.IndexHNSWFlat(dimension, 32, faiss.METRIC_INNER_PRODUCT)
    index.add(descriptors)
    _, neighbours = index.search(descriptors, k)
    pairs = np.stack([np.repeat(np.arange(n), k), neighbours.ravel()], axis=1)
    pairs = np.sort(pairs[(pairs[:, 0] != pairs[:, 1]) & (pairs[:, 1] >= 0)], axis=1)
    return np.asarray(np.unique(pairs, axis=0), np.int64)


@dataclasses.dataclass(frozen=True)
class PruningReport:
    """What a choice of pairs saves, and what it loses.

    Attributes
    ----------
    tried, pairs : int
        Pairs chosen, of all that there are.
    kept, overlapping : int
        Overlapping pairs chosen, of all that overlap.
    """

    tried: int
    pairs: int
    kept: int
    overlapping: int

    @property
    def recall(self) -> float:
        """Part of the overlapping pairs that are still tried, [0, 1]; 1 where none overlaps."""
        return self.kept / self.overlapping if self.overlapping else 1.0

    def __str__(self) -> str:
        return (
            f"{self.tried} of {self.pairs} pairs tried ({100 * self.tried / max(1, self.pairs):.1f} %),"
            f" {self.kept} of {self.overlapping} overlapping pairs among them:"
            f" {100 * (1 - self.recall):.1f} % of the recall lost"
        )


def measure(chosen: Any, overlapping: Any, fragments: int) -> PruningReport:
    """How much recall a choice of pairs costs.

    Parameters
    ----------
    chosen, overlapping : lists or (M, 2) arrays of pairs of fragment numbers, in either order
        What is to be tried, and what should be found: the pairs of a ground truth, or those that a complete run aligned.
    fragments : int
        Number of fragments.

    Examples
    --------
    >>> from gpureg import pruning
    >>> print(pruning.measure([(0, 1), (1, 2)], [(1, 0), (0, 3)], fragments=4))
    2 of 6 pairs tried (33.3 %), 1 of 2 overlapping pairs among them: 50.0 % of the recall lost
    """
    tried, wanted = _as_set(chosen), _as_set(overlapping)
    return PruningReport(len(tried), fragments * (fragments - 1) // 2, len(tried & wanted), len(wanted))


def _as_set(pairs: Any) -> "set[Tuple[int, int]]":
    return {(min(int(i), int(j)), max(int(i), int(j))) for i, j in pairs}


__all__ = ["Nearest", "PruningReport", "describe", "describe_all", "measure", "nearest_pairs", "whiten"]
