# SPDX-License-Identifier: BSD-3-Clause
"""Agreement among pairs: what crosses into C++ and back."""

import pickle

import gpureg
import numpy as np
import pytest
from scenes import few, moved, pose, room


@pytest.fixture(scope="module")
def loop():
    """Three clouds of one room, their pairs and results."""
    points = room(points=18000)
    clouds = [points[0::3], moved(points[1::3], pose(4)), moved(points[2::3], pose(5))]
    pairs = [(0, 1), (1, 2), (0, 2)]
    return pairs, gpureg.align_batch(
        clouds, pairs, options=gpureg.RegistrationOptions.from_voxel_size(0.05)
    )


def with_state(result, **changes):
    """The result with other values."""
    state = {**result.to_dict(), **changes}
    copy = gpureg.RegistrationResult.__new__(gpureg.RegistrationResult)
    copy.__setstate__(state)
    return copy


def test_right_pairs_of_a_loop_rise_and_a_wrong_one_falls(loop):
    pairs, results = loop
    weak = [with_state(r, score=0.6, modes=[]) for r in results]
    for before, after in zip(weak, gpureg.agreement(pairs, weak)):
        assert after.confidence > before.score and (after.mode, after.loops) == (0, 1)
    wrong = weak[:2] + [with_state(weak[2], target_from_source=np.eye(4))]
    assert gpureg.agreement(np.array(pairs), wrong)[2].confidence < 0.6


def test_without_loops_scores_stay(loop):
    pairs, results = loop
    agreed = gpureg.agreement(pairs[:2], results[:2])
    assert [(a.confidence, a.loops) for a in agreed] == [(r.score, 0) for r in results[:2]]
    assert gpureg.agreement([], []) == []
    assert pickle.loads(pickle.dumps(agreed[0])) == agreed[0]


def test_options(loop):
    pairs, results = loop
    options = gpureg.LoopConsistencyOptions.from_voxel_size(0.1)
    assert options.closing_distance == pytest.approx(0.3)
    assert len(gpureg.agreement(pairs, results, options=options)) == 3
    with pytest.raises(gpureg.InvalidArgument, match="rounds is 0"):
        gpureg.agreement(pairs, results, options=options.replace(rounds=0))
    with pytest.raises(TypeError, match="LoopConsistencyOptions has no option 'shift'"):
        gpureg.LoopConsistencyOptions(shift=1)


def test_bad_input_is_named(loop):
    pairs, results = loop
    with pytest.raises(gpureg.InvalidArgument, match="results has 2 entries, but pairs has 3"):
        gpureg.agreement(pairs, results[:2])
    with pytest.raises(gpureg.InvalidArgument, match=r"results\[1\].score is 2"):
        gpureg.agreement(pairs, [results[0], with_state(results[1], score=2.0), results[2]])
    with pytest.raises(TypeError, match=r"results\[0\]: expected a RegistrationResult, got 1"):
        gpureg.agreement(pairs, [1, 2, 3])
    with pytest.raises(TypeError, match="options: expected LoopConsistencyOptions"):
        gpureg.agreement(pairs, results, options=few())
