# SPDX-License-Identifier: BSD-3-Clause
"""Loop consistency among pairs: what crosses into C++ and back."""

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
        clouds, pairs, options=gpureg.RegistrationOptions(voxel_size=0.05)
    )


def with_state(result, **changes):
    """The result with other values."""
    state = {**result.to_dict(), **changes}
    copy = gpureg.RegistrationResult.__new__(gpureg.RegistrationResult)
    copy.__setstate__(state)
    return copy


def test_correct_pairs_of_a_loop_rise_and_a_false_one_falls(loop):
    pairs, results = loop
    weak = [with_state(r, confidence=0.6, modes=[]) for r in results]
    for before, after in zip(weak, gpureg.loop_consistency(pairs, weak)):
        assert after.confidence > before.confidence and (after.mode, after.loops) == (0, 1)
    false = weak[:2] + [with_state(weak[2], target_from_source=np.eye(4))]
    assert gpureg.loop_consistency(np.array(pairs), false)[2].confidence < 0.6


def test_without_loops_scores_stay(loop):
    pairs, results = loop
    consistent = gpureg.loop_consistency(pairs[:2], results[:2])
    assert [(p.confidence, p.loops) for p in consistent] == [(r.confidence, 0) for r in results[:2]]
    assert gpureg.loop_consistency([], []) == []
    assert pickle.loads(pickle.dumps(consistent[0])) == consistent[0]


def test_options(loop):
    pairs, results = loop
    options = gpureg.LoopConsistencyOptions(voxel_size=0.1)
    assert options.closing_distance == 3
    assert len(gpureg.loop_consistency(pairs, results, options=options)) == 3
    with pytest.raises(gpureg.InvalidArgument, match="iterations is 0"):
        gpureg.loop_consistency(pairs, results, options=options.replace(iterations=0))
    with pytest.raises(TypeError, match="LoopConsistencyOptions has no option 'shift'"):
        gpureg.LoopConsistencyOptions(shift=1)


def test_bad_input_is_named(loop):
    pairs, results = loop
    with pytest.raises(gpureg.InvalidArgument, match="results has 2 entries, but pairs has 3"):
        gpureg.loop_consistency(pairs, results[:2])
    with pytest.raises(gpureg.InvalidArgument, match=r"results\[1\].confidence is 2"):
        gpureg.loop_consistency(
            pairs, [results[0], with_state(results[1], confidence=2.0), results[2]]
        )
    with pytest.raises(TypeError, match=r"results\[0\]: expected a RegistrationResult, got 1"):
        gpureg.loop_consistency(pairs, [1, 2, 3])
    with pytest.raises(TypeError, match="options: expected LoopConsistencyOptions"):
        gpureg.loop_consistency(pairs, results, options=few())
