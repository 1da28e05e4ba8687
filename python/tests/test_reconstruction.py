# SPDX-License-Identifier: BSD-3-Clause
"""Maps from unordered scans, and errors of trajectories."""

import os
import signal

import gpureg
import numpy as np
import pytest
from scenes import moved, pose, room

OPTIONS = gpureg.RegistrationOptions(voxel_size=0.1, quality=2)


@pytest.fixture(scope="module")
def scans():
    """Six scans of one room, each in a frame of its own, and noise."""
    rng = np.random.default_rng(1)
    whole = room(1, 12000)
    clouds = [moved(whole[rng.random(len(whole)) < 0.6], pose(k)) for k in range(6)]
    return [*clouds, 3 * rng.random((6000, 3))]


@pytest.fixture(scope="module")
def map_of_scans(scans):
    return gpureg.reconstruct(scans, options=OPTIONS)


def truth(k, first=0):
    """island_from_scan, where the island has the frame of scan `first`."""
    return pose(first) @ np.linalg.inv(pose(k))


def test_places_the_scans_of_a_room(map_of_scans):
    assert map_of_scans.islands == [[0, 1, 2, 3, 4, 5]]
    assert map_of_scans.poses.shape == (7, 4, 4) and np.isnan(map_of_scans.poses[6]).all()
    for k in range(6):
        # A fifth of a voxel; the scans share points.
        assert np.abs(map_of_scans.poses[k] - truth(k)).max() < 0.02, k
    left = map_of_scans.scans[6]
    assert not left.placed and left.island is None and left.reason != "none" and left.explanation
    assert all(scan.placed and scan.confidence > 0.5 for scan in map_of_scans.scans[:6])
    edge = next(e for e in map_of_scans.edges if e.accepted)
    assert edge.target_from_source.shape == (4, 4) and edge.information.shape == (6, 6)
    assert edge.map_confidence > 0.9
    assert map_of_scans.refinement["final_rmse"] < 0.02
    assert len(map_of_scans.weakest_links) == 5
    assert "6 of 7" in repr(map_of_scans)


def test_points_of_the_map(map_of_scans, scans):
    points, normals = map_of_scans.points()
    assert points.dtype == np.float32 and points.shape[1] == 3 and normals is None
    # Points of the first scan, in whose frame the map is, have one of the map within a voxel.
    some = scans[0][::50].astype(np.float32)
    distances = np.linalg.norm(some[:, None] - points[None], axis=2).min(axis=1)
    assert distances.max() < 0.1
    assert len(map_of_scans.points(voxel_size=0.2)[0]) < len(points)
    with pytest.raises(IndexError, match="island is 1"):
        map_of_scans.points(1)


def test_same_map_from_results(map_of_scans, scans):
    pairs = [(j, i) for i in range(7) for j in range(i + 1, 7)]
    results = gpureg.align_batch(scans, pairs, options=OPTIONS)
    again = gpureg.reconstruct(scans, pairs, results=results, options=OPTIONS)
    assert np.array_equal(again.poses, map_of_scans.poses, equal_nan=True)


def test_map_from_a_run_of_register_all(map_of_scans, scans, tmp_path):
    pytest.importorskip("pyarrow")
    run = gpureg.register_all(scans, output=tmp_path, options=OPTIONS, progress=False)
    again = gpureg.reconstruct(scans, results=run, options=OPTIONS)
    assert np.array_equal(again.poses, map_of_scans.poses, equal_nan=True)
    again = gpureg.reconstruct(scans, results=run.journal, options=OPTIONS)
    assert np.array_equal(again.poses, map_of_scans.poses, equal_nan=True)
    with pytest.raises(ValueError, match="names 6, which fragments lacks"):
        gpureg.reconstruct(scans[:6], results=run, options=OPTIONS)
    with pytest.raises(TypeError, match="pairs"):
        gpureg.reconstruct(scans, "all", results=run, options=OPTIONS)


def test_goes_on_after_an_interruption(map_of_scans, scans, tmp_path):
    journal, seen = tmp_path / "pairs.journal", []

    def stop(done, total):
        if total == 21 and done >= 5:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        gpureg.reconstruct(scans, options=OPTIONS, journal=journal, progress=stop)
    assert journal.exists()
    with pytest.raises(ValueError, match="options.seed was 1, now 2"):
        gpureg.reconstruct(scans, options=OPTIONS.replace(seed=2), journal=journal)
    again = gpureg.reconstruct(
        scans, options=OPTIONS, journal=journal, progress=lambda *counts: seen.append(counts)
    )
    assert next(done for done, total in seen if total == 21) >= 5
    assert not journal.exists()
    assert np.array_equal(again.poses, map_of_scans.poses, equal_nan=True)


def test_folder_with_numbers(scans, tmp_path):
    for number, cloud in zip((2, 5, 9), scans):
        gpureg.write_point_cloud(tmp_path / f"cloud_bin_{number}.ply", cloud)
    steps = []
    map = gpureg.reconstruct(
        tmp_path, options=OPTIONS, progress=lambda done, total: steps.append((done, total))
    )
    assert map.islands == [[2, 5, 9]] and map.numbers == (2, 5, 9)
    assert (3, 3) in steps and any(total == 10 for _, total in steps)
    with pytest.raises(ValueError, match="fragment 3"):
        gpureg.reconstruct(tmp_path, [(2, 3)], options=OPTIONS)


def test_a_scan_that_cannot_be_read_is_left_out(scans, tmp_path):
    for k, cloud in enumerate(scans[:4]):
        gpureg.write_point_cloud(tmp_path / f"cloud_bin_{k}.ply", cloud)
    whole = gpureg.reconstruct(tmp_path, options=OPTIONS)
    pairs = [(j, i) for i in range(4) for j in range(i + 1, 4)]
    results = gpureg.align_batch(
        [tmp_path / f"cloud_bin_{k}.ply" for k in range(4)], pairs, options=OPTIONS
    )
    steps = [(k + 1, k, truth(k + 1, k)) for k in range(3)]
    bad = tmp_path / "cloud_bin_1.ply"
    bad.write_bytes(bad.read_bytes()[:1000])
    first = gpureg.reconstruct(tmp_path, options=OPTIONS, odometry=steps)
    for map in (
        first,
        gpureg.reconstruct(tmp_path, pairs, results=results, options=OPTIONS),
        gpureg.reconstruct(tmp_path, pairs, results=results, options=OPTIONS, audit=False),
    ):
        assert map.islands == [[0, 2, 3]] and map.numbers == (0, 1, 2, 3)
        assert map.poses.shape == (4, 4, 4) and np.isnan(map.poses[1]).all()
        assert np.abs(map.poses[[0, 2, 3]] - whole.poses[[0, 2, 3]]).max() < 0.02
        scan = map.scans[1]
        assert not scan.placed and scan.reason == "unusable" and "truncated" in scan.explanation
        assert len(map.points()[0]) > 1000
    with pytest.raises(gpureg.IoError, match="fewer than two can be used: .*cloud_bin_1.ply"):
        gpureg.reconstruct([scans[0], bad], options=OPTIONS)
    with pytest.raises(FileNotFoundError, match="nowhere"):
        gpureg.reconstruct([scans[0], scans[1], tmp_path / "nowhere.ply"], options=OPTIONS)


def test_odometry(scans, tmp_path):
    poses = np.stack([np.linalg.inv(pose(k)) for k in range(7)])
    kept = {"pairs": [(0, 1), (0, 2)], "options": OPTIONS, "refine": False}
    assert gpureg.reconstruct(scans, **kept).islands == [[0, 1, 2]]
    map = gpureg.reconstruct(scans, odometry=poses, **kept)
    assert map.islands == [list(range(7))]
    assert map.scans[4].reason == "odometry_only" and map.scans[1].reason == "none"
    steps = [(k + 1, k, np.linalg.inv(poses[k]) @ poses[k + 1]) for k in range(6)]
    assert np.allclose(gpureg.reconstruct(scans, odometry=steps, **kept).poses, map.poses)
    path = tmp_path / "poses.txt"
    with open(path, "w") as file:
        for k, matrix in enumerate(poses):
            file.write(f"{k}\n")
            np.savetxt(file, matrix, "%.17g")
    assert np.allclose(gpureg.reconstruct(scans, odometry=path, **kept).poses, map.poses)
    log = tmp_path / "odometry.log"
    with open(log, "w") as file:
        for source, target, matrix in steps:
            file.write(f"{target} {source} 7\n")
            np.savetxt(file, matrix, "%.17g")
    assert np.allclose(gpureg.reconstruct(scans, odometry=log, **kept).poses, map.poses)
    with pytest.raises(ValueError, match=r"odometry: expected shape \(7, 4, 4\)"):
        gpureg.reconstruct(scans, odometry=poses[:3], **kept)
    with pytest.raises(ValueError, match=r"odometry\[0\].*fragment 8"):
        gpureg.reconstruct(scans, odometry=[(8, 0, np.eye(4))], **kept)


def test_wrong_arguments(scans):
    with pytest.raises(TypeError, match="pairs: needed"):
        gpureg.reconstruct(scans, results=[])
    with pytest.raises(TypeError, match=r"results\[0\]"):
        gpureg.reconstruct(scans, [(1, 0)], results=[None])
    with pytest.raises(ValueError, match="results: 0 for 1 pairs"):
        gpureg.reconstruct(scans, [(1, 0)], results=[])
    with pytest.raises(ValueError, match="min_connection_confidence"):
        gpureg.reconstruct(
            scans,
            [(0, 1)],
            options=OPTIONS,
            map_options=gpureg.ReconstructionOptions(min_connection_confidence=2),
        )
    assert gpureg.reconstruct(scans[:1], options=OPTIONS).islands == []


def test_trajectories(tmp_path):
    poses = np.tile(np.eye(4), (4, 1, 1))
    poses[:, :3, 3] = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    estimate = poses.copy()
    estimate[2, 2, 3] = 0.4
    times = np.arange(4.0)
    e = gpureg.evaluate_trajectory((times, estimate), (times, poses), align=False)
    assert e.matched == 4 and e.path_length == pytest.approx(3)
    assert e.absolute_translation.rmse == pytest.approx(0.2)
    assert e.relative_translation.max == pytest.approx(0.4)
    assert e.truth_from_estimate.tolist() == np.eye(4).tolist()
    path = tmp_path / "tum.txt"
    path.write_text(
        "".join(f"{t} {x} {y} {z} 0 0 0 1\n" for t, (x, y, z) in zip(times, poses[:, :3, 3]))
    )
    read = gpureg.read_trajectory(path)
    assert np.array_equal(read[0], times) and np.array_equal(read[1], poses)
    same = gpureg.evaluate_trajectory(path, path, delta=1.5, delta_unit="metres")
    assert same.absolute_translation.max < 1e-12 and same.relative_translation.count == 1
    with pytest.raises(ValueError, match="truth: a time is there twice"):
        gpureg.evaluate_trajectory((times, poses), (times * 0, poses))
    with pytest.raises(ValueError, match="delta_unit is 'feet'"):
        gpureg.evaluate_trajectory(path, path, delta_unit="feet")
    with pytest.raises(OSError, match="none.txt"):
        gpureg.read_trajectory(tmp_path / "none.txt")
