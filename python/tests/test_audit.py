# SPDX-License-Identifier: BSD-3-Clause
"""Maps of a room, whose scans say where they are wrong."""

import json

import gpureg
import numpy as np
import pytest
from gpureg import pose_graph
from interrupts import ctrl_c
from scenes import moved, pose, room

OPTIONS = gpureg.RegistrationOptions(voxel_size=0.1, quality=2)


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
    assert (
        audit.verdict == "sound"
        and audit.sound
        and len(audit.pairs) == 10
        and len(audit.connections) == 4
    )
    assert {pair.verdict for pair in audit.pairs} == {"supports"}
    assert {connection.verdict for connection in audit.connections} == {"confirmed"}


def test_a_wrong_scan_is_named(scans):
    wrong = poses()
    wrong[3, :3, 3] += [0.5, 0.4, 0.3]
    audit = gpureg.audit(scans, wrong, options=OPTIONS)
    assert audit.verdict == "contradicted" and not audit.sound
    assert audit.connections[0].scans == [3]
    for k in audit.connections[0].contradictions:
        assert 3 in (audit.pairs[k].source, audit.pairs[k].target)


def test_without_viewpoints_a_wrong_scan_is_not_confirmed(points):
    wrong = poses()
    wrong[3, :3, 3] += [0.5, 0.4, 0.3]
    audit = gpureg.audit(points, wrong, options=OPTIONS)
    assert audit.connections[0].scans == [3]
    assert audit.connections[0].verdict == "undecided"
    far = poses()
    far[:, 0, 3] += 1000 * np.arange(5)
    audit = gpureg.audit(points, far, options=OPTIONS)
    assert audit.verdict == "undecided" and not audit.sound


@pytest.fixture(scope="module")
def two_rooms(points):
    """Five scans of a room, three of another one."""
    other = room(2, 12000) * [1.6, 0.7, 1.3]
    rng = np.random.default_rng(2)
    return [*points, *(moved(other[rng.random(len(other)) < 0.6], pose(k)) for k in range(3))]


def test_islands_are_judged_each_in_its_frame(two_rooms, tmp_path):
    map = gpureg.reconstruct(two_rooms, options=OPTIONS, refine=False)
    assert map.islands == [[0, 1, 2, 3, 4], [5, 6, 7]] and not map.places_look_alike
    contradicted, edges_per_scan, jumps = map.agreement
    assert contradicted < 0.1 and edges_per_scan > 1 and 0 <= jumps < 1
    assert map.audit.verdict == "sound"
    audit = gpureg.audit(two_rooms, map, options=OPTIONS)
    assert [(i.scans, i.verdict) for i in audit.islands] == [(i, "sound") for i in map.islands]
    assert {c.island for c in audit.connections} == {0, 1}
    mended = gpureg.mend(two_rooms, map, audit=audit, options=OPTIONS)
    assert not mended.moved and not mended.left_out and mended.audit.verdict == "sound"
    document = {
        "islands": map.islands,
        "scans": [
            {"id": s.number, "island": s.island, "island_from_scan": p.ravel().tolist()}
            for s, p in zip(map.scans, map.poses, strict=True)
        ],
    }
    with pytest.raises(ValueError, match=r"reconstruction\.json"):
        gpureg.audit(two_rooms, tmp_path, options=OPTIONS)
    (tmp_path / "reconstruction.json").write_text(json.dumps(document))
    assert gpureg.audit(two_rooms, tmp_path, options=OPTIONS) == audit
    located = gpureg.prepare_map(two_rooms, map, options=gpureg.MapOptions(voxel_size=0.1))
    alone = gpureg.prepare_map(
        two_rooms[:5], map.poses[:5], options=gpureg.MapOptions(voxel_size=0.1)
    )
    assert np.array_equal(located.cloud.points, alone.cloud.points)


def test_a_wrong_scan_is_mended(scans):
    wrong = poses()
    wrong[3, :3, 3] += [0.5, 0.4, 0.3]
    mended = gpureg.mend(scans, wrong, options=OPTIONS)
    assert mended.moved == [3] and mended.left_out == [] and mended.registered > 0
    assert np.abs(mended.poses - poses()).max() < 0.03
    assert mended.audit.verdict == "sound"
    with pytest.raises(ValueError, match="audit"):
        gpureg.mend(scans, np.full((5, 4, 4), np.nan), audit=mended.audit, options=OPTIONS)


def test_the_audit_has_options(scans):
    options = gpureg.AuditOptions()
    assert options == gpureg.AuditOptions()
    wrong = poses()
    wrong[3, :3, 3] += [0.5, 0.4, 0.3]
    loose = options.replace(max_contradicted=1e-12)
    audit = gpureg.audit(scans, wrong, options=OPTIONS, audit_options=loose)
    assert audit.verdict != "contradicted"
    with pytest.raises(ValueError, match="max_contradicted"):
        gpureg.audit(
            scans, wrong, options=OPTIONS, audit_options=options.replace(max_contradicted=0.95)
        )


def test_ctrl_c_ends_an_audit(points):
    many = [points[k % 5] for k in range(150)]
    places = poses()[np.arange(150) % 5]
    with ctrl_c(3), pytest.raises(KeyboardInterrupt):
        while True:
            gpureg.audit(many, places, options=OPTIONS)


def test_poses_are_read_as_by_the_command(scans, tmp_path):
    right = gpureg.audit(scans, poses(), options=OPTIONS)
    log, g2o = tmp_path / "poses.log", tmp_path / "poses.g2o"
    with open(log, "w") as file:
        for k, matrix in enumerate(poses()):
            file.write(f"{k} {k} 5\n")
            np.savetxt(file, matrix, "%.17g")
    graph = pose_graph.PoseGraph()
    for k, matrix in enumerate(poses()):
        pose_graph.add_node(graph, k, matrix)
    pose_graph.write_g2o(g2o, graph)
    for path in (log, g2o):
        audit = gpureg.audit(scans, path, options=OPTIONS)
        assert [pair.verdict for pair in audit.pairs] == [pair.verdict for pair in right.pairs]
        # g2o has quaternions: their rotations differ by the rounding of doubles.
        shifts = [[pair.shift for pair in of.pairs] for of in (audit, right)]
        assert np.allclose(*shifts, rtol=0, atol=1e-9)
    half = tmp_path / "half.txt"
    half.write_text("0 0 0 0 0 0 0 1\n1.5 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n")
    with pytest.raises(gpureg.IoError, match="half.txt: has the time 1.5.*number of a fragment"):
        gpureg.audit(scans, half, options=OPTIONS)
    with pytest.raises(gpureg.IoError, match="half.txt: has the time 1.5.*number of a fragment"):
        gpureg.reconstruct(scans, odometry=half, options=OPTIONS)


def test_a_scan_that_cannot_be_read_is_left_out(points, tmp_path):
    for k, cloud in enumerate(points):
        gpureg.write_point_cloud(tmp_path / f"cloud_bin_{k}.ply", cloud)
    (tmp_path / "cloud_bin_1.ply").write_bytes(b"ply")
    audit = gpureg.audit(tmp_path, poses(), options=OPTIONS)
    assert len(audit.pairs) == 6 and all(1 not in (p.source, p.target) for p in audit.pairs)


def test_bad_poses(scans):
    with pytest.raises(ValueError, match="expected shape"):
        gpureg.audit(scans, poses()[:3], options=OPTIONS)
    scaled = poses()
    scaled[1, :3, :3] *= 1.1
    with pytest.raises(ValueError, match=r"world_from_scan\[1\]"):
        gpureg.audit(scans, scaled, options=OPTIONS)
