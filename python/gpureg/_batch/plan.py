# SPDX-License-Identifier: BSD-3-Clause
"""What a run is, and into which chunks it falls: a function of its inputs, never of the machine."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from .._core import RegistrationOptions
from ..fragments import FragmentSet

#: Chunks visit pairs in tiles of so many fragments by so many: a tile's fragments fit into memory together.
TILE = 64

Key = tuple[int, int]


@dataclasses.dataclass(frozen=True)
class Plan:
    """Pairs (positions i < j) in the caller's order, and the order in which chunks take them."""

    fragments: FragmentSet
    options: RegistrationOptions
    pairs: npt.NDArray[np.int64]
    order: npt.NDArray[np.int64]
    chunk_size: int

    @classmethod
    def make(
        cls,
        fragments: FragmentSet,
        options: RegistrationOptions,
        pairs: npt.NDArray[np.int64],
        chunk_size: int,
    ) -> Plan:
        i, j = pairs[:, 0], pairs[:, 1]
        return cls(fragments, options, pairs, np.lexsort((j, i, j // TILE, i // TILE)), chunk_size)

    @property
    def chunks(self) -> int:
        return -(-len(self.pairs) // self.chunk_size)

    def chunk(self, index: int) -> npt.NDArray[np.int64]:
        """(n, 2) positions i < j."""
        begin = index * self.chunk_size
        return np.asarray(self.pairs[self.order[begin : begin + self.chunk_size]])

    def keys(self, index: int) -> list[Key]:
        """The same, as numbers of fragments."""
        return list(map(tuple, self.numbers(self.chunk(index)).tolist()))

    def name(self, index: int) -> str:
        """Of a chunk's file: another one if the chunk has other pairs."""
        pairs = np.ascontiguousarray(self.numbers(self.chunk(index)), "<i8")
        return f"{index:06d}-{hashlib.blake2b(pairs.tobytes(), digest_size=4).hexdigest()}"

    def numbers(self, pairs: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
        """Positions to the fragments' numbers."""
        return np.asarray(self._numbers[pairs])

    @functools.cached_property
    def _numbers(self) -> npt.NDArray[np.int64]:
        return np.asarray(self.fragments.numbers, np.int64)

    def manifest(self) -> dict[str, Any]:
        """What a run is. Devices and memory may change: they change no result."""
        return {
            "gpureg_run": 3,
            "version": _core.__version__,
            "options": options_dict(self.options),
            "chunk_size": self.chunk_size,
            "tile": TILE,
            "pairs": {
                "count": len(self.pairs),
                "hash": hashlib.blake2b(
                    np.ascontiguousarray(self.numbers(self.pairs), "<i8").tobytes(), digest_size=16
                ).hexdigest(),
            },
            "fragments": [
                {"number": number, "name": name, "fingerprint": self.fragments.fingerprint(k)}
                for k, (number, name) in enumerate(
                    zip(self.fragments.numbers, self.fragments.names)
                )
            ],
        }


def options_dict(options: Any) -> Any:
    """Nested dictionaries of plain values."""
    fields: tuple[str, ...] = getattr(type(options), "_fields", ())
    return {name: options_dict(getattr(options, name)) for name in fields} if fields else options


def difference(before: Any, now: Any, name: str = "") -> str:
    """Names the first part of a manifest that is not the same; empty if all is."""
    if isinstance(before, dict) and isinstance(now, dict):
        for key in sorted(set(before) | set(now)):
            inner = f"{name}.{key}" if name else str(key)
            if key not in before or key not in now:
                return f"{inner} is in one of them only"
            found = difference(before[key], now[key], inner)
            if found:
                return found
        return ""
    if isinstance(before, list) and isinstance(now, list):
        if len(before) != len(now):
            return f"{name} had {len(before)} entries, now {len(now)}"
        return next(
            (
                found
                for k, (a, b) in enumerate(zip(before, now))
                for found in [difference(a, b, f"{name}[{k}]")]
                if found
            ),
            "",
        )
    return "" if before == now else f"{name} was {before!r}, now {now!r}"
