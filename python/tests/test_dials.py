# SPDX-License-Identifier: BSD-3-Clause
"""Dials instead of numbers: a time budget, and a voxel size from the clouds."""

import re

import gpureg
import numpy as np
import pytest
from scenes import error_of, moved, pose, room


@pytest.fixture(scope="module")
def clouds():
    points = room(points=18000)
    return points[0::2], moved(points[1::2], pose())


def test_a_time_budget_gives_the_result_of_its_level(clouds):
    options = gpureg.RegistrationOptions(voxel_size=0.05)
    a, b = gpureg.prepare_batch(clouds, options=options)
    timed = gpureg.align_within(a, b, 1e6, options=options)
    assert timed.levels >= 2 and timed.milliseconds > 0
    alone = gpureg.align(a, b, options=options.replace(quality=timed.quality))
    assert np.array_equal(timed.result.target_from_source, alone.target_from_source)
    assert timed.result.confidence == alone.confidence
    lowest = gpureg.align_within(a, b, 1e-3, options=options)
    assert (lowest.quality, lowest.levels) == (0, 1)
    with pytest.raises(gpureg.InvalidArgument, match="milliseconds is -1"):
        gpureg.align_within(a, b, -1)
    with pytest.raises(TypeError, match="source: expected a PreparedCloud"):
        gpureg.align_within(clouds[0], b, 10)


def test_large_coordinates_keep_their_place(clouds):
    far = np.array([4.5e5, 5.4e6, 100.0])
    a, b = gpureg.prepare_batch([clouds[0] + far, clouds[1] + far])
    found = gpureg.align_within(a, b, 1e6).result.target_from_source
    there = (clouds[0][:50] + far) @ found[:3, :3].T + found[:3, 3]
    assert np.abs(there - far - moved(clouds[0][:50], pose())).max() < 0.05


def test_register_takes_both(clouds):
    result = gpureg.register(*clouds, time_budget_ms=1e6)
    assert result.voxel_size == gpureg.suggest_voxel_size(clouds).voxel_size
    assert result.aligned and error_of(result, pose()) < 0.05
    with pytest.raises(TypeError, match="time_budget_ms: give either"):
        gpureg.register(*clouds, quality=3, time_budget_ms=10)
    with pytest.raises(TypeError, match="voxel_size: expected a number, got 'large'"):
        gpureg.register(*clouds, voxel_size="large")
    nothing = gpureg.register(np.ones((9, 3)), np.ones((9, 3)))
    assert nothing.reason == "too_few_source_points"


def test_suggestions(clouds):
    one = gpureg.suggest_voxel_size(clouds)
    assert one.reason == "none" and 0 < one.noise < one.voxel_size
    assert 3000 <= one.points <= 20000
    alone = gpureg.suggest_voxel_size([clouds[0]]).voxel_size
    for cloud in (clouds[0], gpureg.PointCloud(clouds[0])):
        assert gpureg.suggest_voxel_size(cloud).voxel_size == alone
    millimetres = gpureg.suggest_voxel_size([1000 * cloud for cloud in clouds])
    assert millimetres.voxel_size == pytest.approx(1000 * one.voxel_size, rel=0.1)
    far = gpureg.suggest_voxel_size([cloud + [4.5e5, 5.4e6, 0] for cloud in clouds])
    assert far.voxel_size == pytest.approx(one.voxel_size, rel=0.1)
    nothing = gpureg.suggest_voxel_size([])
    assert (nothing.voxel_size, nothing.reason) == (0, "no_clouds")
    with pytest.raises(ValueError, match=r"clouds\[1\]: expected shape \(N, 3\)"):
        gpureg.suggest_voxel_size([clouds[0], np.ones((4, 2))])


def test_priors_drop_what_contradicts_them(clouds):
    a, b = gpureg.prepare_batch(clouds)
    known = gpureg.RegistrationPrior(target_from_source=pose(), max_rotation=5, max_translation=0.2)
    result = gpureg.align(a, b, prior=known)
    assert result.aligned and error_of(result, pose()) < 0.05
    up = np.array([0.0, 0, 1])
    tilted = gpureg.RegistrationPrior(
        source_up=up, target_up=pose()[:3, :3] @ [1, 2, 3], max_angle=1e-3
    )
    batch = gpureg.align_batch(
        [a, b], [(0, 1), (0, 1)], priors=[tilted, gpureg.RegistrationPrior()]
    )
    assert [r.reason for r in batch] == ["contradicts_prior", "none"]
    assert np.isnan(batch[0].target_from_source).all()
    assert np.array_equal(batch[1].target_from_source, gpureg.align(a, b).target_from_source)
    with pytest.raises(gpureg.InvalidArgument, match="priors has 1 entries, but pairs has 2"):
        gpureg.align_batch([a, b], [(0, 1), (1, 0)], priors=[known])
    with pytest.raises(ValueError, match="give both, or none"):
        gpureg.RegistrationPrior(source_up=up)
    with pytest.raises(gpureg.InvalidArgument, match="prior.pose.max_rotation is 0"):
        gpureg.RegistrationPrior(target_from_source=np.eye(4), max_rotation=0)
    with pytest.raises(
        ValueError, match="max_rotation is 5, but there is no target_from_source that it limits"
    ):
        gpureg.RegistrationPrior(max_rotation=5, source_up=[0, 0, 1], target_up=[0, 0, 1])
    with pytest.raises(
        ValueError, match="max_translation is 0.1, but there is no target_from_source"
    ):
        gpureg.RegistrationPrior(max_translation=0.1)
    with pytest.raises(ValueError, match="max_angle is 5, but there is no source_up and target_up"):
        gpureg.RegistrationPrior(max_angle=5, target_from_source=np.eye(4))
    with pytest.raises(TypeError, match="prior: expected a RegistrationPrior"):
        gpureg.align(a, b, prior=np.eye(4))


def test_register_takes_a_prior(clouds):
    right, wrong = pose(), pose()
    wrong[:3, 3] += 5
    for given in (
        clouds,
        [clouds[0] + 5e6, clouds[1]],
    ):  # in the caller's frames, also those of a map
        moved_back = np.eye(4)
        moved_back[:3, 3] = clouds[0][0] - given[0][0]

        def prior(known, moved_back=moved_back):
            return gpureg.RegistrationPrior(
                target_from_source=known @ moved_back, max_rotation=5, max_translation=0.3
            )

        assert gpureg.register(*given, quality=1, prior=prior(right)).aligned
        assert gpureg.register(*given, quality=1, prior=prior(wrong)).reason == "contradicts_prior"
    with pytest.raises(TypeError, match="prior: expected a RegistrationPrior"):
        gpureg.register(*clouds, prior=right)
    with pytest.raises(TypeError, match="prior: not together with time_budget_ms"):
        gpureg.register(*clouds, prior=gpureg.RegistrationPrior(), time_budget_ms=1)


def test_voxel_size_suggestions_show_what_they_hold(clouds):
    text = repr(gpureg.suggest_voxel_size(clouds))
    assert re.fullmatch(
        r"<gpureg.VoxelSizeSuggestion 0.0\d+, spacing [\d.e-]+, noise [\d.e-]+, \d+ points>", text
    )
    assert repr(gpureg.suggest_voxel_size([])) == "<gpureg.VoxelSizeSuggestion none: no_clouds>"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda t: t.T,
            r"target_from_source is no rigid motion: its last row is \[5, 6, 7, 1\], expected \[0, 0, 0, 1\]; it looks transposed",
        ),
        (
            lambda t: t + np.diag([0, 0, 0, 1]),
            r"target_from_source is no rigid motion: its last row is \[0, 0, 0, 2\], expected \[0, 0, 0, 1\]$",
        ),
        (
            lambda t: t @ np.diag([1.1, 1.1, 1.1, 1]),
            r"target_from_source is no rigid motion: .* determinant 1.331, .* by 0.21$",
        ),
        (
            lambda t: t @ np.diag([1, -1, 1, 1]),
            r"target_from_source is no rigid motion: .* determinant -1",
        ),
        (
            lambda t: t + np.diag([0, np.nan, 0], -1),
            r"target_from_source is no rigid motion: its element \[2, 1\] is nan, expected a finite number",
        ),
        (lambda t: t[:3], r"target_from_source: expected shape \(4, 4\), got \(3, 4\)"),
    ],
)
def test_wrong_poses_of_priors_are_named(change, message):
    right = np.eye(4)
    right[:3, 3] = 5, 6, 7
    gpureg.RegistrationPrior(target_from_source=right)
    with pytest.raises(ValueError, match=message):
        gpureg.RegistrationPrior(target_from_source=change(right))


def test_priors_are_in_the_frames_of_the_caller(clouds):
    far = np.array([4.5e5, 5.4e6, 100.0])
    a, b = gpureg.prepare_batch([clouds[0] + far, clouds[1]])
    truth = pose()
    truth[:3, 3] -= truth[:3, :3] @ far
    known = gpureg.RegistrationPrior(target_from_source=truth, max_rotation=5, max_translation=0.3)
    assert gpureg.align(a, b, prior=known).aligned
