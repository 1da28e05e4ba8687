# SPDX-License-Identifier: BSD-3-Clause
"""LoopCloser: states, threads, saving; the C++ tests have the method."""

import threading

import gpureg
import numpy as np
import pytest
from scenes import planar


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


@pytest.mark.parametrize("preset", ["from_voxel_size", "loopsmart"])
def test_lengths_follow_the_voxel_size(preset):
    """The noise of a host's loop without information is a voxel, 5 cm at 5 cm."""

    def noise(**keywords):
        closer = gpureg.LoopCloser(context=gpureg.Context.cpu(1), **keywords)
        drifting(closer, lap())
        closer.add_loop(19, 0, np.linalg.inv(lap()[0]) @ lap()[19], confidence=0.95)
        closer.process()
        (loop,) = closer.loops
        return loop.information[3, 3] ** -0.5

    options = getattr(gpureg.LoopClosureOptions, preset)
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
