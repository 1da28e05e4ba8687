# SPDX-License-Identifier: BSD-3-Clause
"""Poses of other methods: what crosses into C++ and back."""

import gpureg
import numpy as np
import pytest
from scenes import moved, pose, room


def test_modes_of_align_keep_their_evidence():
    target = room(1)
    truth = pose(2)
    source = moved(target, np.linalg.inv(truth))
    a, b = gpureg.prepare(source), gpureg.prepare(target)
    result = gpureg.align(a, b)
    assert result.aligned
    found = gpureg.verify(a, b, [mode.target_from_source for mode in result.modes])
    assert found[0].confidence == result.confidence
    assert found[0].inlier_ratio == result.inlier_ratio
    for verified, mode in zip(found, result.modes):
        assert verified.evidence.source_overlap == mode.evidence.source_overlap
        assert np.array_equal(verified.target_from_source, mode.target_from_source)
    information = found[0].source_moments.information_open3d()
    assert np.array_equal(information, result.source_moments.information_open3d())


def test_one_pose_of_raw_arrays():
    target = room(1)
    truth = pose(3)
    source = moved(target, np.linalg.inv(truth))
    rough = truth.copy()
    rough[:3, 3] += 0.02
    (refined,) = gpureg.verify(source, target, rough, refine=True, search_alternatives=False)
    assert refined.confidence > 0.9 and "confidence" in repr(refined)
    assert np.linalg.norm(refined.target_from_source[:3, 3] - truth[:3, 3]) < 0.01


def test_bad_poses_are_named():
    cloud = gpureg.prepare(room(1))
    for poses, words in (
        (np.eye(3), "expected shape"),
        ([np.eye(4), 2 * np.eye(4)], r"poses\[1\]"),
        ([np.diag([1.1, 1.1, 1.1, 1])], r"poses\[0\]\[0\] is no rigid motion"),
        (np.full((4, 4), np.nan), r"poses\[0\]"),
    ):
        with pytest.raises(ValueError, match=words):
            gpureg.verify(cloud, cloud, poses)
    assert gpureg.verify(cloud, cloud, np.empty((0, 4, 4))) == []
