# SPDX-License-Identifier: BSD-3-Clause
"""Loops of LoopCloser in iSAM2 of GTSAM: examples/python/10_gtsam.py."""

import importlib.util

import gpureg
import numpy as np
import pytest
from scenes import moved, planar, room
from test_examples import FOLDER, run

pytest.importorskip("gtsam", reason="gtsam is not installed (pip install 'gpureg[hosts]')")


@pytest.fixture()
def example():
    spec = importlib.util.spec_from_file_location("example_gtsam", FOLDER / "10_gtsam.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def relative(poses, source, target):
    return np.linalg.inv(poses[target]) @ poses[source]


def error(poses, truth, source, target):
    """Metres."""
    wrong = np.linalg.inv(relative(truth, source, target)) @ relative(poses, source, target)
    return np.linalg.norm(wrong[:3, 3])


def test_an_accepted_loop_moves_the_poses_and_a_retracted_one_is_taken_out(example):
    """A room, a corridor, a twin of the room, and back through the corridor. Odometry is lost at
    the door of the twin.
    """
    truth = [planar(0.5 * k, 0.2 * k, 10 * k) for k in range(5)]
    truth += [planar(2 + 6 * k / 5, 3, 0) for k in range(5)]
    truth += [planar(8 + 0.5 * k, 0.2 * k, 10 * k) for k in range(5)]
    truth += [planar(8 - 6 * k / 5, 3, 0) for k in range(5)]
    options = gpureg.LoopClosureOptions(optimize=False)
    closer = gpureg.LoopCloser(options=options, context=gpureg.Context.cpu(1))
    isam = example.Isam2()
    bias = planar(0.005, 0, 0.05)
    tracked = [truth[0]]

    def go_on(end):
        while len(tracked) < end or len(closer) < end:
            here = len(closer)
            if here == 0:
                closer.add(here, world_from_fragment=truth[0], time=0)
                isam.start(here, truth[0])
                continue
            motion = relative(truth, here, here - 1) @ bias
            tracked.append(tracked[-1] @ motion)
            covariance = example.covariance_of(motion, 0.02)
            if here == 10:
                covariance = np.diag([1.0, 1, 1, 25, 25, 25])
            closer.add(here, world_from_fragment=tracked[here], time=here)
            closer.add_odometry(here, here - 1, motion, covariance)
            isam.add_odometry(here, here - 1, motion, covariance)

    go_on(15)
    alias = relative(truth, 2, 2)  # fragment 12 looks as fragment 2 does
    closer.add_loop(12, 2, alias, confidence=0.97)
    (accepted,) = closer.process().changed
    assert accepted.state == "accepted"
    isam.update([accepted])
    index = isam.loops[12, 2]
    assert isam.isam.getFactorsUnsafe().exists(index)
    assert error(isam.poses(), truth, 12, 2) > 7  # it lies in the room, 8 m from the twin

    closer.set_poses(isam.poses())
    go_on(20)
    for source in range(16, 20):
        closer.add_loop(source, 24 - source, relative(truth, source, 24 - source), confidence=0.9)
    changed = closer.process().changed
    assert ("retracted", 12, 2) in [(loop.state, loop.source, loop.target) for loop in changed]
    isam.update(changed)
    assert (12, 2) not in isam.loops and len(isam.loops) == sum(
        loop.state == "accepted" for loop in closer.loops
    )
    assert not isam.isam.getFactorsUnsafe().exists(index)
    # The drift of ten fragments and the noise of a loop, 5 cm.
    assert error(isam.poses(), truth, 12, 2) < 0.5

    for edge in isam.loops:
        factor = isam.isam.getFactorsUnsafe().at(isam.loops[edge])
        assert sorted(factor.keys()) == sorted(edge)


def test_fragments_and_odometry_from_files(tmp_path):
    """Five looks into a room, with a drift of 2 cm a step: the loop of the first and the last."""
    folder = tmp_path / "fragments"
    folder.mkdir()
    truth = [planar(0.1 * k, 0.05 * k, 5 * k) for k in range(5)]
    rows, drifted = [], np.eye(4)
    for k, pose in enumerate(truth):
        cloud = moved(room(points=12000), np.linalg.inv(pose))
        gpureg.write_point_cloud(folder / f"cloud_bin_{k}.ply", cloud)
        if k:
            drifted = drifted @ relative(truth, k, k - 1) @ planar(0.02, 0, 0.5)
        rows.append(np.r_[k, drifted.ravel()])
    np.savetxt(tmp_path / "odometry.txt", rows)
    output = tmp_path / "poses.txt"
    shown = run("10_gtsam.py", folder, tmp_path / "odometry.txt", "--drift", 0.2, "-o", output)
    assert "4 -> 0 accepted" in shown and "5 fragments" in shown
    poses = np.loadtxt(output)[:, 1:].reshape(-1, 4, 4)
    odometry = np.array(rows)[:, 1:].reshape(-1, 4, 4)
    assert error(odometry, truth, 4, 0) > 0.07
    assert (
        error(poses, truth, 4, 0) < 0.04
    )  # half of that, with odometry that is believed beside the loops
