# SPDX-License-Identifier: BSD-3-Clause
"""Maps of a room, whose scans say where they are wrong."""

import gpureg
import numpy as np
import pytest
from scenes import moved, pose, room

OPTIONS = gpureg.RegistrationOptions.from_voxel_size(0.1, quality=2)


@pytest.fixture(scope="module")
def points():
    rng = np.random.default_rng(1)
    whole = room(1, 12000)
    return [moved(whole[rng.random(len(whole)) < 0.6], pose(k)) for k in range(5)]


@pytest.fixture(scope="module")
def scans(points):
    """With viewpoints: what stands in free space can be told."""
    viewpoint = np.array([[1.9, 1.9, 1.9]])
    viewpoints = {k: moved(viewpoint, pose(k)) for k in range(5)}
    return gpureg.FragmentSet(range(5), points, viewpoints)


def poses():
    return np.stack([np.linalg.inv(pose(k)) for k in range(5)])


def test_a_right_map_is_sound(scans):
    audit = gpureg.audit(scans, poses(), options=OPTIONS)
    assert audit.sound and len(audit.pairs) == 10 and len(audit.connections) == 4
    assert {pair.verdict for pair in audit.pairs} == {"supports"}
    assert {connection.verdict for connection in audit.connections} == {"confirmed"}


def test_a_wrong_scan_is_named(scans):
    wrong = poses()
    wrong[3, :3, 3] += [0.5, 0.4, 0.3]
    audit = gpureg.audit(scans, wrong, options=OPTIONS)
    assert not audit.sound
    assert audit.connections[0].scans == [3]
    for k in audit.connections[0].contradictions:
        assert 3 in (audit.pairs[k].source, audit.pairs[k].target)


def test_without_viewpoints_a_wrong_scan_is_not_confirmed(points):
    wrong = poses()
    wrong[3, :3, 3] += [0.5, 0.4, 0.3]
    audit = gpureg.audit(points, wrong, options=OPTIONS)
    assert audit.connections[0].scans == [3]
    assert audit.connections[0].verdict == "undecided"


def test_bad_poses(scans):
    with pytest.raises(ValueError, match="expected shape"):
        gpureg.audit(scans, poses()[:3], options=OPTIONS)
    scaled = poses()
    scaled[1, :3, :3] *= 1.1
    with pytest.raises(ValueError, match=r"world_from_scan\[1\]"):
        gpureg.audit(scans, scaled, options=OPTIONS)
