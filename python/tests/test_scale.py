# SPDX-License-Identifier: BSD-3-Clause
"""Registration with an unknown scale."""

import gpureg
import numpy as np
import pytest


def _room(seed):
    """Points of a corner of a room with boxes of different sizes: no other scale fits."""
    rng = np.random.default_rng(seed)
    parts = []

    def rectangle(corner, a, b):
        corner, a, b = (np.asarray(v, float) for v in (corner, a, b))
        count = int(2500 * np.linalg.norm(np.cross(a, b)))
        parts.append(corner + rng.random((count, 1)) * a + rng.random((count, 1)) * b)

    def box(corner, size):
        x, y, z = np.diag(size)
        corner = np.asarray(corner, float)
        for start, a, b in (
            (corner, x, z),
            (corner + y, x, z),
            (corner, y, z),
            (corner + x, y, z),
            (corner + z, x, y),
        ):
            rectangle(start, a, b)

    rectangle((0, 0, 0), (3, 0, 0), (0, 2, 0))
    rectangle((0, 0, 0), (3, 0, 0), (0, 0, 2))
    rectangle((0, 0, 0), (0, 1.4, 0), (0, 0, 1.7))
    box((0.3, 0.9, 0), (0.7, 0.4, 0.5))
    box((1.5, 0.2, 0), (0.35, 0.3, 1.1))
    box((2.1, 1.1, 0), (0.5, 0.6, 0.25))
    points = np.concatenate(parts)
    return points + rng.normal(0, 0.001, points.shape)


def _pose():
    pose = np.eye(4)
    pose[:3, :3] = [[0, -1, 0], [0, 0, -1], [1, 0, 0]]
    pose[:3, 3] = 1, -2, 0.5
    return pose


def test_the_scale_is_found_and_part_of_the_pose():
    truth = _pose()
    source = (_room(2) - truth[:3, 3]) @ truth[:3, :3] / 40
    result = gpureg.register(source, _room(1), 0.1, scale=(20, 80))
    assert result.aligned and result, result.explanation
    assert result.scale == pytest.approx(40, rel=0.01)
    assert result.scale_status == "found"
    assert 0 < result.scale_deviation < 0.01
    assert result.information.shape == (7, 7)
    assert result.candidates[0][0] == result.scale
    found = result.target_from_source
    assert np.cbrt(np.linalg.det(found[:3, :3])) == pytest.approx(result.scale)
    moved = source @ found[:3, :3].T + found[:3, 3]
    expected = 40 * source @ truth[:3, :3].T + truth[:3, 3]
    assert np.abs(moved - expected).max() < 0.1
    assert "found" in repr(result)


def test_a_known_scale_is_that_of_register():
    a, b = _room(1), _room(2)
    known = gpureg.register(a, b, 0.1, scale=1)
    plain = gpureg.register(a, b, 0.1)
    assert known.scale_status == "known" and known.scale == 1
    assert np.array_equal(known.result.target_from_source, plain.target_from_source)
    assert known.confidence == plain.confidence


def test_a_known_scale_asks_both_clouds_for_the_voxel_size():
    a, b = _room(1), _room(2)
    part = b[b[:, 0] < 1]
    plain = gpureg.register(a, part)
    assert plain.voxel_size > gpureg.suggest_voxel_size(part).voxel_size
    known = gpureg.register(a / 4, part, scale=4)
    assert known.result.voxel_size == plain.voxel_size


@pytest.mark.parametrize("scale", [0, -1, float("nan"), float("inf"), (0, 1), (2, 1), (1, np.nan)])
def test_wrong_scales_are_named(scale):
    with pytest.raises(gpureg.InvalidArgument, match="scale"):
        gpureg.register(_room(1), _room(2), 0.1, scale=scale)


@pytest.mark.parametrize("scale", ["any", (1, 2, 3), True])
def test_wrong_types_are_named(scale):
    with pytest.raises((TypeError, ValueError), match="scale"):
        gpureg.register(_room(1), _room(2), 0.1, scale=scale)


def test_scale_with_prior_is_refused():
    with pytest.raises(TypeError, match="scale"):
        gpureg.register(_room(1), _room(2), 0.1, scale="free", time_budget_ms=5)
    with pytest.raises(gpureg.InvalidArgument, match="downsample"):
        options = gpureg.RegistrationOptions(voxel_size=0.1)
        options.prepare.downsample = False
        gpureg.register(_room(1), _room(2), options=options, scale="free")
