# SPDX-License-Identifier: BSD-3-Clause
"""Pruning: descriptors of places, their neighbours, and what is lost."""

import gpureg
import numpy as np
import pytest
from country import make_fragments
from scenes import few, moved, pose, room

pytest.importorskip("pyarrow")
from gpureg import pruning


def test_descriptor_belongs_to_the_place_not_to_the_pose():
    clouds = [room(k % 3, 3000) for k in range(6)]
    clouds = [moved(cloud, pose(k)) for k, cloud in enumerate(clouds)]
    summaries = pruning.summarize_all(clouds)
    for summary in summaries:
        assert summary.descriptor.shape == (64 * 33,) and 50 < len(summary) <= 256
        assert abs(np.linalg.norm(summary.descriptor) - 1) < 1e-5
    assert pruning.likely_pairs(summaries, 1).tolist() == [[0, 3], [1, 4], [2, 5]]


def test_same_candidates_again():
    clouds, _ = make_fragments(30, seed=2)
    fragments = gpureg.FragmentSet.from_clouds(clouds)
    nearest = pruning.Nearest(k=4, options=few(1, 0.12))
    first = nearest(fragments)
    assert nearest.seconds > 0 and np.array_equal(first, nearest(fragments))
    assert (first[:, 0] < first[:, 1]).all()


def test_most_overlapping_pairs_are_kept():
    clouds, overlapping = make_fragments(120, seed=1)
    pairs = pruning.Nearest(k=12, options=few(1, 0.12))(gpureg.FragmentSet.from_clouds(clouds))
    report = pruning.measure(pairs, overlapping, len(clouds))
    # Twelve of 119 at random would keep less than a fifth.
    assert report.tried < 0.2 * report.pairs and report.recall > 0.7
    assert "of the recall lost" in str(report)


def test_consecutive_fragments_are_always_tried():
    fragments = gpureg.FragmentSet([3, 5, 6, 9], [room(k, 600) for k in range(4)])
    pairs = pruning.Nearest(k=1, consecutive=2)(fragments).tolist()
    assert all(pair in pairs for pair in ([3, 5], [5, 6], [6, 9], [3, 6], [5, 9]))


def test_odd_sets():
    assert len(pruning.Nearest(k=5)(gpureg.FragmentSet.from_clouds([room(1, 600)]))) == 0
    empty = gpureg.FragmentSet.from_clouds([np.zeros((0, 3)), room(1, 600), np.zeros((2, 3))])
    assert pruning.Nearest(k=2)(empty).tolist() == [[0, 1], [0, 2], [1, 2]]
    with pytest.raises(ValueError, match="k is 0"):
        pruning.Nearest(k=0)(empty)


def test_as_the_pairs_of_a_run(tmp_path):
    clouds, overlapping = make_fragments(20, seed=3)
    options = few(2000, 0.12)
    run = gpureg.register_all(
        clouds,
        pruning.Nearest(k=3, options=options),
        output=tmp_path,
        options=options,
        progress=False,
    )
    assert 20 <= run.pairs <= 60
