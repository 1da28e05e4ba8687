# SPDX-License-Identifier: BSD-3-Clause
"""Pose graphs from Python."""

import gpureg
import numpy as np
import pytest
from gpureg import pose_graph

INFORMATION = np.diag([1e4] * 3 + [1e3] * 3)


def turn(angle, x=0.0):
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    pose[0, 3] = x
    return pose


def ring(n=12):
    """Nodes of a regular polygon, odometry, and the loop that closes it."""
    graph = pose_graph.PoseGraph()
    step = turn(2 * np.pi / n, 1)
    for k in range(n):
        pose_graph.add_node(graph, k)
    for k in range(1, n):
        pose_graph.add_edge(graph, k, k - 1, step, information=INFORMATION, kind="odometry")
    pose_graph.add_edge(graph, 0, n - 1, step, information=INFORMATION)
    return graph, step


def test_a_ring_closes():
    graph, step = ring()
    result = pose_graph.optimize(graph)
    assert result.converged and result.status == "converged" and result.accepted.all()
    poses = result.world_from_node
    assert poses.shape == (12, 4, 4)
    assert np.allclose(np.linalg.inv(poses[3]) @ poses[4], step, atol=1e-9)
    assert result.components == [list(range(12))] and result.final_cost < 1e-9


def test_a_wrong_loop_is_rejected_and_a_mode_chosen():
    graph, step = ring()
    wrong = pose_graph.add_edge(graph, 6, 0, turn(1.0, 30), information=INFORMATION)
    other = pose_graph.add_edge(graph, 7, 2, turn(2.0, -9), information=INFORMATION)
    correct = np.linalg.matrix_power(step, 5)
    pose_graph.add_mode(graph, other, correct, information=INFORMATION)
    result = pose_graph.optimize(graph)
    assert not result.accepted[wrong] and result.weights[wrong] == 0
    assert result.accepted[other] and result.modes[other] == 1


def test_files_round_trip(tmp_path):
    graph, _ = ring()
    result = pose_graph.optimize(graph)
    pose_graph.write_g2o(tmp_path / "a.g2o", graph, result, radians=True)
    pose_graph.write_open3d(tmp_path / "a.json", graph, result)
    for read in (
        pose_graph.read_g2o(tmp_path / "a.g2o", radians=True),
        pose_graph.read_open3d(tmp_path / "a.json"),
    ):
        assert (read.node_count, read.edge_count) == (12, 12)
        again = pose_graph.optimize(read, threads=1)
        assert np.allclose(again.world_from_node, result.world_from_node, atol=1e-9)


def test_mistakes_name_field_and_value(tmp_path):
    graph, _ = ring()
    with pytest.raises(gpureg.InvalidArgument, match="robust is 'huber'"):
        pose_graph.optimize(graph, robust="huber")
    with pytest.raises(gpureg.InvalidArgument, match="threads is -1"):
        pose_graph.optimize(graph, threads=-1)
    with pytest.raises(ValueError, match="expected shape"):
        pose_graph.add_edge(graph, 0, 1, np.eye(3))
    with pytest.raises(gpureg.InvalidArgument, match="edge is 99"):
        pose_graph.add_mode(graph, 99, np.eye(4))
    pose_graph.add_node(graph, 3)
    with pytest.raises(gpureg.InvalidArgument, match=r"nodes\[12\].id is 3"):
        pose_graph.optimize(graph)
    (tmp_path / "bad.g2o").write_text("EDGE_SE2 0 1\n")
    with pytest.raises(gpureg.IoError, match="bad.g2o:1: the tag is 'EDGE_SE2'"):
        pose_graph.read_g2o(tmp_path / "bad.g2o")
