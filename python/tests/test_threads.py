# SPDX-License-Identifier: BSD-3-Clause
"""Options that another thread writes, forked children that end, Ctrl-C in a single call."""

import os
import subprocess
import sys
import time

import gpureg
import numpy as np
import pytest
from interrupts import alarm, ctrl_c
from scenes import few, room

WRITER = """
import sys, threading, time
import gpureg, numpy as np
from scenes import moved, pose, room

context = gpureg.Context.cpu(2)
options = gpureg.RegistrationOptions(voxel_size=0.08)
points = room(points=3000)
a, b = gpureg.prepare_batch([points, moved(points, pose())], options=options, context=context)
calls = {
    "align": lambda: gpureg.align(a, b, options=options, context=context),
    "align_batch": lambda: gpureg.align_batch([a, b], [(0, 1)] * 2, options=options, context=context),
    "align_within": lambda: gpureg.align_within(a, b, 50, options=options, context=context),
    "verify": lambda: gpureg.verify(a, b, np.eye(4), options=options, context=context),
}
done = threading.Event()

def write():
    while not done.is_set():
        for large in [False, True] * 1000:
            options.quality = 10 if large else 0
            options.tune = "compatibility.max_members=1024 evidence.modes=64" if large else ""

thread = threading.Thread(target=write)
thread.start()
end = time.monotonic() + 5
while time.monotonic() < end:
    calls[sys.argv[1]]()
done.set()
thread.join()
"""

CHILD = """
import os, sys
import gpureg, numpy as np

cloud = np.random.default_rng(1).random((2000, 3))
context = gpureg.Context.cpu(2) if sys.argv[1] == "own" else None
gpureg.register(cloud, cloud, quality=0, context=context)
child = os.fork()
if child == 0:
    sys.exit(7)
sys.exit(0 if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7 else 1)
"""


def python(script: str, argument: str) -> subprocess.CompletedProcess:
    path = os.pathsep.join([os.path.dirname(__file__), *filter(None, sys.path)])
    return subprocess.run(
        [sys.executable, "-c", script, argument],
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "PYTHONPATH": path},
    )


@pytest.mark.parametrize("call", ["align", "align_batch", "align_within", "verify"])
def test_another_thread_may_write_the_options(call):
    done = python(WRITER, call)
    assert done.returncode == 0, done.stderr[-500:]


@pytest.mark.parametrize("context", ["default", "own"])
def test_a_forked_child_ends(context):
    done = python(CHILD, context)
    assert done.returncode == 0, done.stderr[-500:]


@pytest.fixture(scope="module")
def slow():
    """Calls that take a dozen seconds of processor time and more, on clouds that a few threads
    share. The rooms are different ones: `align_within` ends early only where it is sure.
    """
    cpu = gpureg.Context.cpu(2)
    quadruples = few(1 << 28, 0.02)
    most = gpureg.RegistrationOptions(
        voxel_size=0.02,
        quality=10,
        tune="compatibility.triangles=4096 compatibility.max_members=1024 "
        "compatibility.max_matches=65536 evidence.sample=65536",
    )
    a, b = gpureg.prepare_batch(
        [room(seed, points=30_000) for seed in (1, 2)], options=most, context=cpu
    )
    kept = gpureg.RegistrationOptions(
        prepare=gpureg.PrepareOptions(downsample=False, feature_radius=10, normal_radius=10)
    )
    large = room(points=120_000)
    return {
        "align": lambda: gpureg.align(a, b, options=most, context=cpu),
        "align quadruples": lambda: gpureg.align(a, b, options=quadruples, context=cpu),
        "align one thread": lambda: gpureg.align(a, b, options=most, context=gpureg.Context.cpu(1)),
        "align_batch": lambda: gpureg.align_batch([a, b], [(0, 1)] * 50, options=most, context=cpu),
        "align_within": lambda: gpureg.align_within(a, b, 3_600_000, options=most, context=cpu),
        "verify": lambda: gpureg.verify(a, b, np.eye(4), options=most, context=cpu),
        "prepare": lambda: gpureg.prepare(large, options=kept, context=cpu),
        "register": lambda: gpureg.register(
            large, large, options=most.replace(voxel_size=0.05, prepare=kept.prepare), context=cpu
        ),
    }


@pytest.mark.parametrize(
    "call",
    [
        "align",
        "align quadruples",
        "align one thread",
        "align_batch",
        "align_within",
        "verify",
        "prepare",
        "register",
    ],
)
def test_ctrl_c_ends_a_single_call(slow, call):
    with pytest.raises(KeyboardInterrupt), ctrl_c(after=0.3) as pressed:
        slow[call]()
    # Processor time: a busy machine does not lengthen it. A tenth of a second on two threads until
    # it is heard; the calls take a dozen seconds and more.
    seconds = time.process_time() - pressed[1]
    print(f"{call}: {seconds:.2f} s of processor time after Ctrl-C")
    assert seconds < 1


def test_nothing_is_left_of_an_interrupted_call(source, target):
    def bits(result):
        return result.target_from_source.tobytes(), result.confidence

    context, options = gpureg.Context.cpu(2), few(20_000)
    a, b = gpureg.prepare_batch([source, target], context=context)
    before = bits(gpureg.align(a, b, options=options, context=context))
    threads = len(os.listdir("/proc/self/task"))
    for _ in range(3):
        with pytest.raises(TimeoutError), alarm(0.3, time_is_up):
            gpureg.align(a, b, options=few(1 << 28), context=context)
        assert bits(gpureg.align(a, b, options=options, context=context)) == before
    assert len(os.listdir("/proc/self/task")) == threads


def test_a_handler_cannot_call_what_it_interrupts(source):
    cloud = gpureg.prepare(source, context=gpureg.Context.cpu(1))
    with pytest.raises(RuntimeError, match="by the handler of a signal that interrupted it"):
        with alarm(0.3, lambda: gpureg.align(cloud, cloud)):
            gpureg.align(cloud, cloud, options=few(1 << 28))


def time_is_up():
    raise TimeoutError
