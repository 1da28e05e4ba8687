# SPDX-License-Identifier: BSD-3-Clause
"""Where in a map a scan is, or that it is not there."""

import pathlib
import sys
import threading
from collections.abc import Callable
from typing import Any

import gpureg
import numpy as np
import pytest
from scenes import moved, pose, room

OPTIONS = gpureg.MapOptions(voxel_size=0.05)
PLACES = [np.eye(4), np.eye(4)]
PLACES[1][:3, 3] = [4, 1, 0]
SENSOR = [1.8, 1.7, 1.6]


def scan_of(seed: int, frame: np.ndarray, thinned: int = 0) -> gpureg.PointCloud:
    points = room(seed, 24000)[thinned::2]
    return gpureg.PointCloud(moved(points, frame), viewpoints=moved(np.array([SENSOR]), frame))


@pytest.fixture(scope="module")
def two_rooms() -> gpureg.PreparedMap:
    scans = [scan_of(seed, np.eye(4)) for seed in (1, 2)]
    return gpureg.prepare_map(scans, np.array(PLACES), options=OPTIONS)


def numbers(result: gpureg.LocateResult) -> list[Any]:
    return [
        result.status,
        result.absent_probability,
        *(p.map_from_scan.tolist() + [p.confidence, p.alias] for p in result.poses),
    ]


def test_found_and_not_there(two_rooms: gpureg.PreparedMap) -> None:
    frame = pose()
    result = gpureg.locate(scan_of(2, frame, 1), two_rooms)
    assert result.status == "found" and result.found
    assert np.abs(result.map_from_scan - PLACES[1] @ np.linalg.inv(frame)).max() < 0.05
    assert result.poses[0].confidence + result.absent_probability <= 1 + 1e-12
    assert result.poses[0].verification.inlier_ratio > 0.5
    foreign = gpureg.locate(scan_of(9, frame), two_rooms)
    assert foreign.status == "not_found" and foreign.absent_probability > 0.5
    assert [numbers(r) for r in gpureg.locate_batch([scan_of(9, frame)], two_rooms)] == [
        numbers(foreign)
    ]


def test_saved_and_loaded(two_rooms: gpureg.PreparedMap, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "rooms.gpureg"
    two_rooms.save(path)
    loaded = gpureg.load_map(path)
    assert len(loaded) == len(two_rooms) and loaded.tiles == two_rooms.tiles
    assert loaded.options == two_rooms.options == OPTIONS
    assert np.array_equal(loaded.cloud.points, two_rooms.cloud.points)
    scan = scan_of(1, pose(5), 1)
    assert numbers(gpureg.locate(scan, loaded)) == numbers(gpureg.locate(scan, two_rooms))
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(gpureg.IoError, match="truncated"):
        gpureg.load_map(path)
    with pytest.raises(gpureg.IoError, match="nowhere"):
        gpureg.load_map(tmp_path / "nowhere")


def test_priors(two_rooms: gpureg.PreparedMap) -> None:
    frame = pose()
    scan = scan_of(1, frame, 1)
    truth = np.linalg.inv(frame)
    assert gpureg.locate(scan, two_rooms, near=(truth[:3, 3], 1.0)).found
    assert not gpureg.locate(scan, two_rooms, near=(truth[:3, 3] + [0, 0, 40], 1.0)).found
    assert gpureg.locate(scan, two_rooms, scan_up=frame[:3, 2]).found
    with pytest.raises(gpureg.InvalidArgument, match=r"position is 1e\+39, .* at most 1e12"):
        gpureg.locate(scan, two_rooms, near=([0, 1e39, 0], 1.0))
    with pytest.raises(ValueError, match=r"near: expected shape \(3,\)"):
        gpureg.locate(scan, two_rooms, near=([1, 2], 1.0))


def test_change(two_rooms: gpureg.PreparedMap) -> None:
    frame = pose()
    scan = scan_of(1, frame, 1)
    truth = np.linalg.inv(frame)
    same = gpureg.change(scan, two_rooms, truth)
    assert same is not None
    assert same.scan_labels.shape == (len(scan.points),) and same.map_labels.shape == (
        len(two_rooms),
    )
    names = np.array(gpureg.CHANGE_LABELS)
    assert (names[same.scan_labels] == "same").mean() > 0.9
    assert (names[same.scan_labels] == "new").mean() < 0.01
    assert same.scan_probabilities.min() >= 0 and same.scan_probabilities.max() <= 1
    assert np.abs(same.map_from_scan - truth).max() < 0.05
    located = gpureg.change(scan, two_rooms)
    assert located is not None and np.abs(located.map_from_scan - truth).max() < 0.05
    assert gpureg.change(scan_of(9, frame), two_rooms) is None
    with pytest.raises(gpureg.InvalidArgument, match="rigid"):
        gpureg.change(scan, two_rooms, 2 * truth)
    with pytest.raises(ValueError, match="map_from_scan: expected shape"):
        gpureg.change(scan, two_rooms, [1, 2, 3])


def test_options_may_change_while_a_call_runs(two_rooms: gpureg.PreparedMap) -> None:
    frame, context = pose(), gpureg.Context.cpu(1)
    scan, truth = scan_of(1, frame, 1), np.linalg.inv(frame)

    def found(options: gpureg.LocateOptions) -> list[Any]:
        return numbers(gpureg.locate(scan, two_rooms, options=options, context=context))

    def changed(options: gpureg.ChangeOptions) -> list[Any]:
        result = gpureg.change(scan, two_rooms, truth, options=options, context=context)
        assert result is not None
        return [result.scan_labels.tolist(), result.scan_probabilities.tolist()]

    calls: list[tuple[Callable[[Any], list[Any]], Any, str, float]] = [
        (found, gpureg.LocateOptions(), "min_confidence", 1.0),
        (changed, gpureg.ChangeOptions(), "tolerance", 100.0),
    ]
    for call, options, field, value in calls:
        expected, results = call(options), []
        interval = sys.getswitchinterval()
        sys.setswitchinterval(1000)  # the other thread runs until the library lets this one go on
        try:
            thread = threading.Thread(
                target=lambda c, o, r: r.append(c(o)), args=(call, options, results)
            )
            thread.start()
            setattr(options, field, value)
            thread.join()
        finally:
            sys.setswitchinterval(interval)
        assert results == [expected]
        assert call(options) != expected


def test_scans_with_odometry_are_one_scan(two_rooms: gpureg.PreparedMap) -> None:
    frame = pose()
    points = scan_of(2, frame, 1).points.astype(float)
    step = pose(8)  # the second scan, half of the points, has a frame of its own
    halves = [points[::2], moved(points[1::2], np.linalg.inv(step))]
    walk = gpureg.prepare_map(halves, np.array([np.eye(4), step]), options=OPTIONS).cloud
    result = gpureg.locate(walk, two_rooms)
    assert result.found
    assert np.abs(result.map_from_scan - PLACES[1] @ np.linalg.inv(frame)).max() < 0.05


def test_map_of_a_las_file(two_rooms: gpureg.PreparedMap, tmp_path: pathlib.Path) -> None:
    laspy = pytest.importorskip("laspy")
    points = room(2, 24000)[::2] + np.array([500000.0, 5400000.0, 0.0])
    file = laspy.create(point_format=3, file_version="1.2")
    file.header.offsets, file.header.scales = points.min(axis=0), [0.001] * 3
    file.x, file.y, file.z = points.T
    path = tmp_path / "map.las"
    file.write(str(path))
    frame = pose()
    result = gpureg.locate(scan_of(2, frame, 1), gpureg.prepare_map(path, options=OPTIONS))
    assert result.found
    placed = moved(scan_of(2, frame, 1).points.astype(float), result.map_from_scan)
    assert np.abs(placed - room(2, 24000)[1::2] - [500000, 5400000, 0]).max() < 0.1


def test_wrong_arguments(two_rooms: gpureg.PreparedMap) -> None:
    scan = room(1)
    with pytest.raises(gpureg.InvalidArgument, match="millimetres"):
        gpureg.locate(scan * 1000, two_rooms)
    with pytest.raises(gpureg.InvalidArgument, match="voxel_size"):
        gpureg.locate(
            scan,
            two_rooms,
            options=gpureg.LocateOptions(registration=gpureg.RegistrationOptions(voxel_size=0.1)),
        )
    with pytest.raises(TypeError, match="map: expected a PreparedMap"):
        gpureg.locate(scan, scan)
    with pytest.raises(TypeError, match="sequence of clouds"):
        gpureg.locate_batch(scan, two_rooms)
    with pytest.raises(ValueError, match=r"poses: expected shape \(1, 4, 4\)"):
        gpureg.prepare_map([scan], np.eye(4))
    with pytest.raises(gpureg.InvalidArgument, match="no points"):
        gpureg.prepare_map(np.zeros((0, 3)))


def test_part_in_a_scene() -> None:
    rng = np.random.default_rng(1)

    def step(count: int) -> tuple[Any, Any]:
        """A base and a wall at its end, with normals."""
        boxes = [([0, 0, 0.01], [0.08, 0.05, 0.02]), ([-0.03, 0, 0.035], [0.02, 0.05, 0.03])]
        at = rng.uniform(-1, 1, (2, count, 3))
        normals = np.zeros((2, count, 3))
        for k, axis in enumerate(rng.integers(0, 3, count)):
            for b in range(2):
                at[b, k, axis] = normals[b, k, axis] = 1 if k % 2 else -1
        points = [np.array(c) + a * np.array(s) / 2 for a, (c, s) in zip(at, boxes, strict=True)]
        return np.concatenate(points), normals.reshape(-1, 3)

    part, normals = step(4000)
    truth = pose()
    floor = np.c_[rng.uniform(-0.15, 0.15, (15000, 2)), np.zeros(15000)]
    scene = moved(np.concatenate([part[normals[:, 2] > -0.5], floor]), truth)
    options = gpureg.FindOptions(min_confidence=0, quality=2)
    result = gpureg.find(
        part, scene, part_normals=normals, scene_viewpoints="none", options=options
    )
    assert result.status == "found"
    assert "found" in result.explanation
    best = result.instances[0]
    assert np.allclose(best.scene_from_part, truth, atol=0.01)  # two voxels; angles of 0.01
    assert not best.evidence.viewpoint_known
    assert gpureg.find(part, scene[:5], part_normals=normals).status == "too_few_scene_points"
    with pytest.raises(ValueError, match="quality"):
        gpureg.find(part, scene, options=gpureg.FindOptions(quality=11))
