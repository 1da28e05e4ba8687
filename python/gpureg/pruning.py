# SPDX-License-Identifier: BSD-3-Clause
"""Which pairs of a large set are worth trying: those whose fragments look alike.

A fragment is summarised by a global descriptor, an aggregate of its local features that needs no
training, and by its key points. Candidates are the most alike pairs, k per fragment on average, by
both and by what third fragments tell. The cost of a run then grows as n * k, not as n * n."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from ._arrays import to_numpy
from ._contexts import default_context
from ._core import CloudSummary, Context, RegistrationOptions
from .fragments import FragmentSet, fragment_set

_TOGETHER = 32  # clouds in memory at once
_WORDS = 64
_SAMPLED, _SAMPLE = 256, 400  # fragments that words are learnt from, and features of each

FloatArray = npt.NDArray[np.float32]
Pairs = npt.NDArray[np.int64]


def learn_words(features: Sequence[FloatArray], words: int = _WORDS) -> FloatArray:
    """Centres of k-means over features of some fragments: (words, D) float32.

    No labels and no training set: the words are those of the scene itself.
    """
    return _core.learn_words([_rows(rows) for rows in features], words)


def describe(features: FloatArray, words: FloatArray) -> FloatArray:
    """Global descriptor of a cloud: what is left of its features beyond their nearest words, summed
    per word (VLAD with intra-normalisation, Jegou et al. 2010, Arandjelovic and Zisserman 2013).

    Rigid motions change it as little as they change the features.

    Parameters
    ----------
    features : (N, D) float32
        ``PreparedCloud.features``, or features of your own.
    words : (W, D) float32
        Of `learn_words`.

    Returns
    -------
    (W * D,) float32
        Unit length; zeros for a cloud without features.

    Examples
    --------
    >>> import numpy as np
    >>> from gpureg import pruning
    >>> features = np.random.default_rng(1).random((300, 33), np.float32)
    >>> words = pruning.learn_words([features], words=4)
    >>> descriptor = pruning.describe(features, words)
    >>> descriptor.shape, round(float(np.linalg.norm(descriptor)), 3)
    ((132,), 1.0)
    """
    return _core.describe_features(_rows(features), _rows(words))


def _rows(features: FloatArray) -> FloatArray:
    return np.ascontiguousarray(to_numpy(features, "features"), np.float32)


def summarize_all(
    fragments: Any,
    *,
    words: int = _WORDS,
    options: RegistrationOptions | None = None,
    context: Context | None = None,
) -> list[CloudSummary]:
    """What `likely_pairs` needs of a set's fragments, some 15 KB each: ``descriptor``, and
    ``len(summary)`` key points. Fragments are loaded and prepared a few at a time.
    """
    fragments, options, context = (
        fragment_set(fragments),
        options or RegistrationOptions(),
        context or default_context(),
    )

    def prepared(positions: Sequence[int]) -> Iterator[_core.PreparedCloud]:
        for begin in range(0, len(positions), _TOGETHER):
            part = positions[begin : begin + _TOGETHER]
            inputs = [fragments.load(k, options, context.backend == "cuda") for k in part]
            yield from _core.prepare_batch(
                context, inputs, options, [f"fragments[{k}]" for k in part]
            )

    n = len(fragments)
    samples = (cloud.features for cloud in prepared(range(0, n, max(1, n // _SAMPLED))))
    centres = learn_words([rows[:: max(1, len(rows) // _SAMPLE)] for rows in samples], words)
    return [_core.summarize_cloud(cloud, centres) for cloud in prepared(range(n))]


def likely_pairs(summaries: Sequence[CloudSummary], k: int = 20, *, consecutive: int = 0) -> Pairs:
    """Pairs of `summarize_all`'s fragments that are likely to overlap.

    Two fragments are alike if their descriptors are, if matches of their key points agree with
    one motion, and if a third fragment is like both.

    Returns
    -------
    (M, 2) int64
        Positions i < j of the most alike pairs, ascending: k per fragment on average. Of each
        fragment at least the k / 4 most alike.
    """
    if k < 1:
        raise ValueError(f"k is {k}, expected 1 or more")
    return _core.likely_pairs(list(summaries), k, consecutive)


@dataclasses.dataclass
class Nearest:
    """Pairs of fragments that look alike: for the argument pairs of `register_all`.

    Parameters
    ----------
    k : int
        Pairs per fragment on average.
    consecutive : int
        Also this many fragments that follow each one by number: scans of a walk.
    options : RegistrationOptions, optional
        Those of the run, usually.
    context : Context, optional

    Attributes
    ----------
    seconds : float
        Of the last call: summaries and search.

    Examples
    --------
    >>> import numpy as np, gpureg
    >>> from gpureg import pruning
    >>> rng = np.random.default_rng(1)
    >>> fragments = gpureg.FragmentSet.from_clouds([rng.random((500, 3)) for _ in range(6)])
    >>> pairs = pruning.Nearest(k=1)(fragments)
    >>> pairs.shape[1], 3 <= len(pairs) <= 6
    (2, True)
    """

    k: int = 20
    consecutive: int = 0
    options: RegistrationOptions | None = None
    context: Context | None = None
    seconds: float = 0.0

    def __call__(self, fragments: FragmentSet) -> Pairs:
        """(M, 2) pairs i < j of fragment numbers, ascending."""
        if self.k < 1:
            raise ValueError(f"k is {self.k}, expected 1 or more")
        begin = time.monotonic()
        summaries = summarize_all(fragments, options=self.options, context=self.context)
        positions = likely_pairs(summaries, self.k, consecutive=self.consecutive)
        self.seconds = time.monotonic() - begin
        return np.asarray(np.asarray(fragments.numbers, np.int64)[positions], np.int64).reshape(
            -1, 2
        )


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
        """Part of the overlapping pairs that are still tried, [0, 1]; 1 if none overlaps."""
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
        What is to be tried, and what should be found: the pairs of a ground truth, or those that a
        complete run aligned.
    fragments : int
        Number of fragments.

    Examples
    --------
    >>> from gpureg import pruning
    >>> print(pruning.measure([(0, 1), (1, 2)], [(1, 0), (0, 3)], fragments=4))
    2 of 6 pairs tried (33.3 %), 1 of 2 overlapping pairs among them: 50.0 % of the recall lost
    """
    tried, wanted = _as_set(chosen), _as_set(overlapping)
    return PruningReport(
        len(tried), fragments * (fragments - 1) // 2, len(tried & wanted), len(wanted)
    )


def _as_set(pairs: Any) -> set[tuple[int, int]]:
    return {(min(int(i), int(j)), max(int(i), int(j))) for i, j in pairs}


__all__ = [
    "CloudSummary",
    "Nearest",
    "PruningReport",
    "describe",
    "learn_words",
    "likely_pairs",
    "measure",
    "summarize_all",
]
