# SPDX-License-Identifier: BSD-3-Clause
"""Progress of long calls: tqdm's bar, where installed, or a callable of the user's."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

#: True: a bar; False: none; a callable gets (done, total).
Progress = bool | Callable[[int, int], object]


@contextlib.contextmanager
def batch_progress(
    progress: Progress, title: str, total: int, done: int = 0
) -> Iterator[Callable[[int], object] | None]:
    """Gives a function of the number done, or None where nobody wants to know."""
    if callable(progress):
        tell = progress
        yield lambda count: tell(count, total)
        return
    bar = _bar(title, total, done) if progress else None
    if bar is None:
        yield None
        return
    try:
        yield lambda count: bar.update(count - bar.n)
    finally:
        bar.close()


def _bar(title: str, total: int, done: int) -> Any:
    try:
        from tqdm.auto import tqdm  # a widget in notebooks
    except ImportError:
        return None
    return tqdm(desc=title, total=total, initial=done, unit="pair")
