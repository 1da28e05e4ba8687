# SPDX-License-Identifier: BSD-3-Clause
"""Prepared fragments in the memory of one context, within a budget."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.typing as npt

from .. import _core
from .._core import Context, PreparedCloud, RegistrationOptions, RegistrationResult
from ..fragments import FragmentSet
from ..preparation import pieces, prepare_usable

_READERS = 4  # reading a file leaves the interpreter free
_TOGETHER = 32  # clouds per call of prepare: enough to fill a device
_POINT_BYTES = 96  # of a prepared point besides its feature: coordinates, normal, grid


class Stopped(Exception):
    """Someone asked for the end of a batch."""


class Residency:
    """Aligns pairs of a set's fragments; those used last stay prepared as long as they fit.

    Not thread-safe: one per context, used by one thread.
    """

    def __init__(
        self, context: Context, fragments: FragmentSet, options: RegistrationOptions, memory: int
    ) -> None:
        self._context, self._fragments, self._options, self._memory = (
            context,
            fragments,
            options,
            memory,
        )
        self._clouds: OrderedDict[int, PreparedCloud] = OrderedDict()
        self._bytes = 0
        self.prepared = 0  # preparations so far
        self.unusable: dict[int, str] = {}  # positions of fragments, and why
        self._readers = ThreadPoolExecutor(_READERS)

    def close(self) -> None:
        self._readers.shutdown(wait=True)

    def align(
        self,
        pairs: npt.NDArray[np.int64],
        on_result: Callable[[int, RegistrationResult], object],
        stop: Callable[[], bool] | None = None,
    ) -> None:
        """Calls on_result(row, result) for each row (i, j) of pairs, in order and while others are
        under way: fragment j into fragment i. Leaves out the pairs of fragments that cannot be read
        or prepared.

        Raises Stopped if stop says so; on_result has been called for what was done.
        """
        group: list[int] = []
        held: dict[int, PreparedCloud] = {}
        for row, pair in enumerate(pairs.tolist()):
            if stop is not None and stop():
                break
            missing = [k for k in pair if k not in held]
            if missing and group and sum(map(_bytes_of, held.values())) >= self._memory:
                self._align_group(pairs, group, held, on_result, stop)
                group, held = [], {k: cloud for k, cloud in held.items() if k in pair}
            for k in missing:
                if k not in held and (cloud := self._cloud(k, pairs[row:], stop)) is not None:
                    held[k] = cloud
            if all(k in held for k in pair):
                group.append(row)
        if group:
            self._align_group(pairs, group, held, on_result, stop)
        if stop is not None and stop():
            raise Stopped

    def _align_group(
        self,
        pairs: npt.NDArray[np.int64],
        rows: Sequence[int],
        held: dict[int, PreparedCloud],
        on_result: Callable[[int, RegistrationResult], object],
        stop: Callable[[], bool] | None,
    ) -> None:
        places = {k: place for place, k in enumerate(held)}
        entries = np.array([[places[j], places[i]] for i, j in pairs[rows].tolist()], np.uint32)

        def check(done: int) -> None:
            if stop is not None and stop():
                raise Stopped

        _, error = _core.align_batch(
            self._context,
            list(held.values()),
            entries,
            self._options,
            check,
            on_result=lambda k, result: on_result(rows[k], result),
        )
        if error is not None:
            raise error

    def _cloud(
        self, wanted: int, ahead: npt.NDArray[np.int64], stop: Callable[[], bool] | None
    ) -> PreparedCloud | None:
        if wanted in self.unusable:
            return None
        if wanted in self._clouds:
            self._clouds.move_to_end(wanted)
            return self._clouds[wanted]
        # Some of what comes next along with it, as far as it leaves room for what is there.
        mean = self._bytes // max(1, len(self._clouds)) or self._memory
        room = max(1, min(_TOGETHER, self._memory // 4 // mean))
        chosen = [wanted]
        for k in dict.fromkeys(ahead.ravel().tolist()):
            if len(chosen) >= room:
                break
            if k not in self._clouds and k != wanted and k not in self.unusable:
                chosen.append(k)
        device = self._context.backend == "cuda"
        loads = [
            self._readers.submit(self._fragments.load, k, self._options.prepare, device)
            for k in chosen
        ]
        try:
            for piece in pieces(len(chosen), self._context):
                if stop is not None and stop():
                    raise Stopped
                inputs = {chosen[k]: loads[k].result for k in piece}
                for k, cloud in prepare_usable(
                    self._context, inputs, self._options.prepare, self.unusable
                ):
                    self._clouds[k] = cloud
                    self._bytes += _bytes_of(cloud)
                    self.prepared += 1
        finally:
            for load in loads:
                load.cancel()
        found = self._clouds.get(wanted)
        while self._bytes > self._memory and len(self._clouds) > len(chosen):
            _, old = self._clouds.popitem(last=False)
            self._bytes -= _bytes_of(old)
        return found


def _bytes_of(cloud: PreparedCloud) -> int:
    return len(cloud) * (4 * cloud.feature_dimension + _POINT_BYTES)
