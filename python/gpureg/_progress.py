# SPDX-License-Identifier: BSD-3-Clause
"""Progress of long calls: tqdm's bar, if installed, or a callable of the user's."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Any

#: True: a bar; False: none; a callable gets (done, total).
Progress = bool | Callable[[int, int], object]

_REDRAW = 0.5  # seconds after which a bar shows its clock and its note, even if nothing is done


class Report:
    """Tells how many are done."""

    def __init__(self, tell: Callable[[int, int], object] | None, bar: Any, total: int) -> None:
        self._tell, self._bar, self._total = tell, bar, total
        self._drawn = time.monotonic()

    def __call__(self, done: int, note: str = "") -> None:
        """note: shown behind a bar."""
        if self._tell is not None:
            self._tell(done, self._total)
            return
        if note:
            self._bar.set_postfix_str(note, refresh=False)
        now = time.monotonic()
        if self._bar.update(done - self._bar.n):
            self._drawn = now
        elif now - self._drawn >= _REDRAW:
            self._bar.refresh()
            self._drawn = now


@contextlib.contextmanager
def batch_progress(
    progress: Progress, title: str, total: int, done: int = 0, unit: str = "pair"
) -> Iterator[Report | None]:
    """Gives a function of the number done, or None if nobody wants to know."""
    if callable(progress):
        yield Report(progress, None, total)
        return
    bar = _bar(title, total, done, unit) if progress else None
    if bar is None:
        yield None
        return
    try:
        yield Report(None, bar, total)
    finally:
        bar.close()


def _bar(title: str, total: int, done: int, unit: str) -> Any:
    try:
        from tqdm.auto import tqdm  # a widget in notebooks
    except ImportError:
        return None
    # Without miniters tqdm learns to skip updates, and after a fast part of a run the bar would stop.
    return tqdm(desc=title, total=total, initial=done, unit=unit, miniters=1)
