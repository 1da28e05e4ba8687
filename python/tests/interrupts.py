# SPDX-License-Identifier: BSD-3-Clause
"""Signals that come while a call runs, and never after it."""

import contextlib
import os
import signal
import threading
import time


@contextlib.contextmanager
def ctrl_c(after: float):
    """Presses it once, `after` seconds from now, but never after the block. Yields a list: of the
    wall time and the processor time at which it was pressed.
    """
    pressed = []

    def press():
        pressed.extend([time.monotonic(), time.process_time()])
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(after, press)
    timer.start()
    try:
        yield pressed
    finally:
        timer.cancel()
        timer.join()


@contextlib.contextmanager
def alarm(after: float, function):
    """Calls the function once, `after` seconds from now, but never after the block."""
    before = signal.signal(signal.SIGALRM, lambda *_: function())
    signal.setitimer(signal.ITIMER_REAL, after)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
