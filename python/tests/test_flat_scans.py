# SPDX-License-Identifier: BSD-3-Clause
"""Scans of 2-D scanners."""

import pickle

import gpureg
import numpy as np

WALLS = [
    (-5, -3, 5, -3),
    (5, -3, 5, 3),
    (5, 3, -5, 3),
    (-5, 3, -5, -3),
    (1, 0.2, 1, 3),
    (-2, -3, -2, -1),
    (2.6, -2.3, 3.4, -2),
    (3.4, -2, 3.2, -1.5),
    (3.2, -1.5, 2.4, -1.8),
    (-4.2, 1.65, -2.8, 1.65),
    (-2.8, 1.65, -2.8, 2.35),
]


def scan(x, y, turn, seed):
    """(N, 3) points of a scanner in a flat, z = 0."""
    angles = np.linspace(-np.pi, np.pi, 1440, endpoint=False)
    ray = np.c_[np.cos(angles + turn), np.sin(angles + turn)]
    ranges = np.full(len(angles), np.inf)
    for ax, ay, bx, by in WALLS:
        along, to = np.array([bx - ax, by - ay]), np.array([ax - x, ay - y])
        cross = ray[:, 0] * along[1] - ray[:, 1] * along[0]
        with np.errstate(divide="ignore"):
            t = (to[0] * along[1] - to[1] * along[0]) / cross
            u = (to[0] * ray[:, 1] - to[1] * ray[:, 0]) / cross
        hit = (t > 0.05) & (u >= 0) & (u <= 1)
        ranges[hit] = np.minimum(ranges, t)[hit]
    ranges += np.random.default_rng(seed).normal(size=len(ranges)) * 0.006
    return np.c_[ranges * np.cos(angles), ranges * np.sin(angles), 0 * angles]


def pose(x, y, turn):
    c, s = np.cos(turn), np.sin(turn)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]])


FIRST, SECOND = (-1.2, 0.8, 0.2), (-0.2, -1.0, 2.6)


def test_pose_is_planar():
    source, target = scan(*FIRST, 1), scan(*SECOND, 2)
    size = gpureg.suggest_voxel_size([source, target])
    assert size.flat
    result = gpureg.register(source, target, voxel_size=size.voxel_size)
    assert result.aligned and result.flat
    truth = np.linalg.inv(pose(*SECOND)) @ pose(*FIRST)
    np.testing.assert_allclose(result.target_from_source, truth, atol=0.02)
    for mode in result.modes:
        assert mode.target_from_source[2].tolist() == [0, 0, 1, 0]
        assert mode.target_from_source[:2, 2].tolist() == [0, 0]
    information = result.source_moments.information_open3d
    assert (information[np.ix_([2, 3, 4], [0, 1, 5])] == 0).all()
    assert pickle.loads(pickle.dumps(result)).flat


def test_prepared_clouds_say_so():
    cloud = gpureg.prepare(scan(*FIRST, 1), voxel_size=0.1)
    assert cloud.statistics.flat
    assert cloud.statistics.input_points == 1440


def test_with_another_cloud_it_is_refused():
    room = np.random.default_rng(1).random((5000, 3)) * [4, 3, 2]
    room[:, 2] *= np.arange(5000) % 2
    result = gpureg.register(scan(*FIRST, 1), room, voxel_size=0.1)
    assert result.reason == "flat_with_solid"
    assert "2-D scanner" in result.explanation
    assert not result.flat
