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


def test_scans_of_one_unknown_scale_each_become_one_map(tmp_path):
    factors = np.array([1, 1.6, 0.8])
    turn = _pose()
    clouds = [_room(1), _room(2) @ turn[:3, :3] / 1.6, (_room(3) + [1, 0, 0]) / 0.8]
    told = []
    options = gpureg.RegistrationOptions(voxel_size=0.1)
    found = gpureg.reconstruct(
        clouds,
        scale=(0.5, 2),
        options=options,
        refine=False,
        progress=lambda done, total: told.append((done, total)),
    )
    assert found.islands == [[0, 1, 2]]
    assert found.scales == pytest.approx(factors, rel=0.01)
    assert told[0][1] == 3  # pairs whose scales are searched
    points, _ = found.points(voxel_size=0.1)
    assert np.abs(points.max(0) - _room(1).max(0)).max() < 0.15  # one room, in the first's unit
    assert gpureg.reconstruct(clouds[:1] * 2, options=options, refine=False).scales is None
    journal = tmp_path / "scales.journal"

    def interrupt(done, total):
        if total == 3 and done == 2:
            raise KeyboardInterrupt

    # In the voxels that the scaled scans suggest, also when it goes on.
    rest = {"scale": (0.5, 2), "refine": False}
    whole = gpureg.reconstruct(clouds, **rest)
    with pytest.raises(KeyboardInterrupt):
        gpureg.reconstruct(clouds, progress=interrupt, journal=journal, **rest)
    assert journal.exists()
    again = gpureg.reconstruct(clouds, journal=journal, **rest)
    assert np.array_equal(again.scales, whole.scales) and not journal.exists()
    assert np.array_equal(again.poses, whole.poses)
    with pytest.raises(TypeError, match="results"):
        gpureg.reconstruct(clouds, [(0, 1)], scale="free", results=[])
    with pytest.raises(ValueError, match="scale"):
        gpureg.reconstruct(clouds, scale=(2, 1))
    with pytest.raises(gpureg.InvalidArgument, match="known"):
        gpureg.reconstruct(clouds, scale=2)


def test_scaled_fragments_are_multiplied_when_they_are_loaded():
    cloud = np.arange(12, dtype=np.float32).reshape(4, 3)
    fragments = gpureg.FragmentSet.from_clouds([cloud, cloud]).scaled([2, 0.5])
    options = gpureg.RegistrationOptions()
    assert np.array_equal(fragments.load(0, options)[0], 2 * cloud)
    assert np.array_equal(fragments.without([0]).load(0, options)[0], cloud / 2)
    with pytest.raises(ValueError, match="scales: 1 for 2"):
        gpureg.FragmentSet.from_clouds([cloud, cloud]).scaled([1])


def test_similarities_of_another_method_are_verified():
    truth = _pose()
    source = (_room(2) - truth[:3, 3]) @ truth[:3, :3] / 4
    right, wrong = truth.copy(), truth.copy()
    right[:3, :3] *= 4
    wrong[:3, :3] *= 5
    options = gpureg.RegistrationOptions(voxel_size=0.1)
    found = gpureg.verify_scaled(source, _room(1), [wrong, right], options=options)
    assert [v.confidence > 0.5 for v in found] == [False, True]
    assert found[1].scale == pytest.approx(4) and found[1].scale_status == "known"
    assert found[1].target_from_source == pytest.approx(right, abs=1e-9)
    assert found[1].information.shape == (7, 7) and found[1].verification.inlier_ratio > 0.5
    near = right.copy()
    near[:3, :3] *= 1.03
    [refined] = gpureg.verify_scaled(source, _room(1), near, refine=True, options=options)
    assert refined.scale_status == "found" and refined.scale == pytest.approx(4, rel=0.005)
    assert "found" in repr(refined)
    near[0, 0] += 1
    with pytest.raises(ValueError, match=r"similarities\[0\]"):
        gpureg.verify_scaled(source, _room(1), near, options=options)
    with pytest.raises(ValueError, match="shape"):
        gpureg.verify_scaled(source, _room(1), np.eye(3), options=options)
