# SPDX-License-Identifier: BSD-3-Clause
"""LoopCloser: states, threads, saving; the C++ tests have the method."""

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import gpureg
import numpy as np
import pytest
from scenes import planar, room


def lap(count=20):
    corners = [planar(0, 0, 0), planar(5, 0, 90), planar(5, 5, 180), planar(0, 5, 270)]
    return [corners[k // 5 % 4] @ planar(k % 5, 0, 0) for k in range(count)]


def drifting(closer, truth, begin=0, end=None):
    bias = planar(0.02, 0, 0.3)
    for k in range(begin, len(truth) if end is None else end):
        closer.add(k, world_from_fragment=truth[k], time=k)
        if k:
            closer.add_odometry(k, k - 1, np.linalg.inv(truth[k - 1]) @ truth[k] @ bias)


@pytest.fixture
def closer():
    return gpureg.LoopCloser(context=gpureg.Context.cpu(1))


def test_a_confident_loop_is_accepted_and_moves_the_poses(closer):
    truth = lap()
    drifting(closer, truth)
    before = closer.process()
    assert before.changed == [] and len(before.poses) == len(closer) == 20
    closer.add_loop(19, 0, np.linalg.inv(truth[0]) @ truth[19], confidence=0.95)
    update = closer.process(milliseconds=1000)
    (loop,) = update.changed
    assert (loop.source, loop.target, loop.state, loop.reason) == (19, 0, "accepted", "confident")
    assert loop.from_host and loop.weight == 1 and loop.drift_ratio < 1
    assert loop.information.shape == (6, 6) and "confident" in loop.explanation
    measured = np.linalg.inv(update.poses[0]) @ update.poses[19]
    # The loop's noise is 5 cm; odometry pulls by less.
    assert np.abs(measured - np.linalg.inv(truth[0]) @ truth[19]).max() < 0.05
    assert set(closer.frames.values()) == {0}
    assert closer.graph().edge_count == 20


def test_a_host_that_optimises_gets_no_poses():
    closer = gpureg.LoopCloser(
        options=gpureg.LoopClosureOptions(optimize=False), context=gpureg.Context.cpu(1)
    )
    drifting(closer, lap())
    assert closer.process().poses == {}
    closer.set_poses({3: planar(1, 2, 3)})
    closer.process()
    assert np.array_equal(closer.poses[3], planar(1, 2, 3))


def at(voxel_size):
    registration = gpureg.RegistrationOptions(voxel_size=voxel_size)
    return gpureg.LoopClosureOptions(registration=registration)


@pytest.mark.parametrize("options", [at, gpureg.LoopClosureOptions.loopsmart])
def test_lengths_follow_the_voxel_size(options):
    """The noise of a host's loop without information is a voxel, 5 cm at 5 cm."""

    def noise(**keywords):
        closer = gpureg.LoopCloser(context=gpureg.Context.cpu(1), **keywords)
        drifting(closer, lap())
        closer.add_loop(19, 0, np.linalg.inv(lap()[0]) @ lap()[19], confidence=0.95)
        closer.process()
        (loop,) = closer.loops
        return loop.information[3, 3] ** -0.5

    # The voxel size is a float32: 7 digits.
    assert noise() == pytest.approx(0.05, rel=1e-6)
    assert noise(voxel_size=0.2) == pytest.approx(0.2, rel=1e-6)
    assert noise(options=options(0.05)) == pytest.approx(0.05, rel=1e-6)
    assert noise(options=options(0.2)) == pytest.approx(0.2, rel=1e-6)


def test_faults_name_what_is_wrong(closer):
    closer.add(1)
    with pytest.raises(gpureg.InvalidArgument, match="fragment 1"):
        closer.add(1)
    with pytest.raises(gpureg.InvalidArgument, match="fragment 9"):
        closer.add_odometry(9, 1, np.eye(4))
    with pytest.raises(gpureg.InvalidArgument, match="not finite"):
        closer.add(2, world_from_fragment=np.full((4, 4), np.nan))
    with pytest.raises(ValueError, match="covariance"):
        closer.add(3)
        closer.add_odometry(3, 1, np.eye(4), np.eye(5))
    with pytest.raises(gpureg.IoError, match="missing"):
        closer.load("missing", lambda id: None)


def test_saving_in_the_middle_changes_nothing(closer, tmp_path):
    truth = lap(40)
    drifting(closer, truth, 0, 30)
    closer.process()
    closer.save(tmp_path / "state")
    loaded = gpureg.LoopCloser(context=gpureg.Context.cpu(1))
    loaded.load(tmp_path / "state", lambda id: None)
    for each in (closer, loaded):
        drifting(each, truth, 30)
        for k in range(30, 40, 3):
            each.add_loop(k, k - 20, np.linalg.inv(truth[k - 20]) @ truth[k], confidence=0.95)
        each.process()
    assert [loop.state for loop in closer.loops] == [loop.state for loop in loaded.loops]
    assert all(np.array_equal(closer.poses[k], loaded.poses[k]) for k in range(40))


def test_other_threads_run_beside_process(closer):
    truth = lap(40)
    done = threading.Event()

    def track():
        for k in range(len(truth)):
            drifting(closer, truth, k, k + 1)
        done.set()

    thread = threading.Thread(target=track)
    thread.start()
    while not done.is_set():
        closer.process(milliseconds=5)
    thread.join()
    closer.process()
    assert len(closer.poses) == 40


def test_numbers_of_other_kinds_are_refused(closer, tmp_path):
    closer.add(1)
    closer.add(2)
    eye = np.eye(4)
    for call, name in [
        (lambda: closer.add(True), "id"),
        (lambda: closer.add("7"), "id"),
        (lambda: closer.add(7.0), "id"),
        (lambda: closer.add(7, time=True), "time"),
        (lambda: closer.add(7, session=False), "session"),
        (lambda: closer.add_odometry(2, True, eye), "target"),
        (lambda: closer.set_covisible(1, [True]), "others"),
        (lambda: closer.propose("2", 1), "source"),
        (lambda: closer.propose(2, 1, prior=3), "prior"),
        (lambda: closer.add_loop(2, 1, eye, confidence=True), "confidence"),
        (lambda: closer.add_result(2, 1, None), "result"),
        (lambda: closer.set_poses({True: eye}), "poses"),
        (lambda: closer.remove("1"), "id"),
        (lambda: closer.process(milliseconds=True), "milliseconds"),
        (lambda: closer.process(registrations=1.5), "registrations"),
        (lambda: closer.load("missing", None), "clouds"),
    ]:
        with pytest.raises(TypeError, match=f"^{name}|^an id of {name}"):
            call()
    with pytest.raises(gpureg.InvalidArgument, match="registrations is -1, expected 0 or more"):
        closer.process(registrations=-1)
    with pytest.raises(gpureg.InvalidArgument, match="mirror image"):
        closer.add_odometry(2, 1, np.diag([1.0, 1, -1, 1]))
    assert len(closer) == 2


def test_clouds_that_do_not_fit_are_refused(closer, tmp_path):
    points = room()
    context = gpureg.Context.cpu(1)
    with pytest.raises(gpureg.InvalidArgument, match="fragment 3 has no points: of 9, 9 are not"):
        closer.add(3, np.full((9, 3), np.nan, np.float32))
    coarse = gpureg.RegistrationOptions(voxel_size=0.5)
    with pytest.raises(gpureg.InvalidArgument, match=r"fragment 3 has voxels of 0.5 m.* 0.05 m"):
        closer.add(3, gpureg.prepare(points, options=coarse, context=context))
    closer.add(3, points)
    closer.save(tmp_path / "state")
    with pytest.raises(gpureg.InvalidArgument, match=r"state.* 0.05 m.* 0.5 m"):
        gpureg.LoopCloser(voxel_size=0.5, context=context).load(tmp_path / "state", lambda id: None)
    with pytest.raises(TypeError, match=r"clouds\(3\): expected a PreparedCloud, got None"):
        closer.load(tmp_path / "state", lambda id: None)
    assert len(closer) == 1


def test_poses_of_a_session_are_its_odometry(closer):
    truth = lap(40)
    for k, pose in enumerate(truth):
        closer.add(k, world_from_fragment=pose, time=k)
    for k in range(20, 40, 3):
        closer.add_loop(k, k - 20, np.linalg.inv(truth[k - 20]) @ truth[k], confidence=0.8)
    closer.process()
    assert set(closer.frames.values()) == {0}
    assert {loop.state for loop in closer.loops} == {"accepted"}


def test_points_are_added_and_graphs_returned_while_process_registers():
    """process() holds the engine of its context for most of a registration."""
    options = gpureg.LoopClosureOptions()
    options.registration.quality = 10
    # Takes as long as some fifty calls.
    options.registration.tune = "compatibility.triangles=4096"
    closer = gpureg.LoopCloser(options=options, context=gpureg.Context.cpu(1))
    points = room(0)
    for k in range(2):
        closer.add(k, points, planar(0.1 * k, 0, 0))
    closer.propose(1, 0)
    registering = threading.Thread(target=closer.process)
    registering.start()
    for k in range(4):
        closer.graph()
        closer.add(100 + k, points)
    # The first of them that waits for the registration ends after it.
    assert registering.is_alive()
    registering.join()


INTERRUPTED = """
import sys
import gpureg
import numpy as np
sys.path.insert(0, sys.argv[1])
from scenes import room
from test_loop_closure import drifting, lap

closer = gpureg.LoopCloser(context=gpureg.Context.cpu(1))
truth = lap(40)
drifting(closer, truth)
for k in range(20, 40, 3):
    closer.add_loop(k, k - 20, np.linalg.inv(truth[k - 20]) @ truth[k], confidence=0.8)
cloud = gpureg.prepare(room(), context=gpureg.Context.cpu(1))
for k in range(100, 108):
    closer.add(k, cloud, session=k)
    if k > 100:
        closer.propose(k, 100)
print("ready", flush=True)
changed, interrupted = [], 0
while len(closer.loops) < 7 + 7:
    try:
        changed += closer.process().changed
    except KeyboardInterrupt:
        interrupted += 1
# The interrupts are over: what has changed since the last call that returned.
changed += closer.process().changed
states = {}
for loop in changed:
    pair = loop.source, loop.target
    assert (states.get(pair) == "accepted") == (loop.state == "retracted"), (pair, loop.state)
    states[pair] = loop.state
assert states == {(loop.source, loop.target): loop.state for loop in closer.loops}
assert list(states.values()).count("accepted") >= 7
print("interrupted", interrupted, flush=True)
"""


def test_what_an_interrupt_took_away_comes_with_the_next_call():
    """A real SIGINT from outside, while it registers."""
    child = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED, str(Path(__file__).parent)],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "ready\n"
    for _ in range(3):
        time.sleep(0.3)
        if child.poll() is None:
            child.send_signal(signal.SIGINT)
    rest = child.stdout.read()
    assert child.wait() == 0 and int(rest.split()[-1]) > 0, rest
