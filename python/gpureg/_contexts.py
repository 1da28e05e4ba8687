# SPDX-License-Identifier: BSD-3-Clause
"""The context that calls without one use."""

from __future__ import annotations

import math
import numbers
import os
import threading
from typing import Any

import numpy as np

from ._core import BackendUnavailable, Context, InvalidArgument

_default: Context | None = None
_default_lock = threading.Lock()


def default_context() -> Context:
    """The context that calls without one use: CUDA if a device can be used, else all CPU
    threads.

    Made at the first call, once per process. A forked child makes its own, on the CPU; CUDA does
    not survive a fork, nor do contexts of your own, as no thread does.
    """
    global _default
    with _default_lock:
        if _cuda_lost:
            raise BackendUnavailable(
                "CUDA does not survive a fork: start processes by multiprocessing's 'spawn' or 'forkserver', or name a context of the CPU"
            )
        if _default is None:
            _default = Context.best()
        return _default


def _forget_default() -> None:
    global _default, _default_lock, _cuda_lost
    _default_lock = threading.Lock()
    _cuda_lost = _cuda_lost or (_default is not None and _default.backend == "cuda")
    _default = None


_cuda_lost = False
os.register_at_fork(after_in_child=_forget_default)


def context_of(context: Context | None) -> Context:
    return checked(context, Context, "context") or default_context()


def number_of(value: Any, name: str, expected: str = "a number") -> float:
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise TypeError(f"{name}: expected {expected}, got {value!r}")
    return float(value)


def whole_number_of(value: Any, name: str, least: int = -(2**63)) -> int:
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Integral):
        raise TypeError(f"{name}: expected a whole number, got {value!r}")
    number = int(value)
    if not least <= number < 2**63:
        expected = "64 bits" if least < 0 else f"{least} or more"
        raise InvalidArgument(f"{name} is {number}, expected {expected}")
    return number


def milliseconds_of(value: Any, name: str) -> float:
    number = number_of(value, name, "milliseconds, a number")
    if not (math.isfinite(number) and number > 0):
        raise InvalidArgument(f"{name} is {value}, expected a number > 0")
    return number


def checked(value: Any, kind: Any, name: str) -> Any:
    if value is not None and not isinstance(value, kind):
        raise TypeError(f"{name}: expected a {kind.__name__}, got {value!r}")
    return value
