# SPDX-License-Identifier: BSD-3-Clause
"""Examples with the real packages of other programs: `pip install 'gpureg[hosts]'`."""

import importlib.util
import json
import re

import gpureg
import numpy as np
import pytest
from scenes import moved, planar, pose, room
from test_examples import run


def needs(package):
    # Found, not imported: the example imports it in a process of its own.
    return pytest.mark.skipif(
        importlib.util.find_spec(package) is None,
        reason=f"{package} is not installed (pip install 'gpureg[hosts]')",
    )


def matrix_in(text):
    numbers = text.replace("[", " ").replace("]", " ").split()[-16:]
    return np.array(numbers, float).reshape(4, 4)


@needs("small_gicp")
def test_small_gicp_refines_a_pose(tmp_path):
    points, truth = room(points=60000), pose()
    gpureg.write_point_cloud(tmp_path / "a.ply", points[::2])
    gpureg.write_point_cloud(tmp_path / "b.ply", moved(points[1::2], truth))
    shown = run("11_small_gicp.py", tmp_path / "a.ply", tmp_path / "b.ply")
    assert float(re.search(r"refined, confidence ([0-9.]+)", shown).group(1)) > 0.9
    assert np.abs(matrix_in(shown) - truth).max() < 0.01  # a fifth of a voxel


@needs("open3d")
def test_open3d_optimises_the_pairs(tmp_path):
    truth = [planar(0.1 * k, 0.05 * k, 5 * k) for k in range(4)]
    for k, world_from_scan in enumerate(truth):
        cloud = moved(room(points=12000), np.linalg.inv(world_from_scan))
        gpureg.write_point_cloud(tmp_path / f"cloud_bin_{k}.ply", cloud)
    output = tmp_path / "poses.json"
    assert "4 clouds, 6 edges" in run("12_open3d_pose_graph.py", tmp_path, "-o", output)
    nodes = json.loads(output.read_text())["nodes"]
    poses = [np.array(node["pose"]).reshape(4, 4).T for node in nodes]  # columns first
    for a, b in zip(poses, truth):
        assert np.abs(np.linalg.inv(poses[0]) @ a - np.linalg.inv(truth[0]) @ b).max() < 0.01


@needs("kiss_icp")
def test_kiss_icp_comes_back(tmp_path):
    """A sensor goes through a corner of a room and back: the fragments stay within a few cm."""
    out = [planar(0.03 * k, 0.015 * k, 1.5 * k) for k in range(12)]
    truth = out + out[::-1]
    folder = tmp_path / "scans"
    folder.mkdir()
    for k, world_from_scan in enumerate(truth):
        cloud = moved(room(points=12000)[k % 3 :: 3], np.linalg.inv(world_from_scan))
        gpureg.write_point_cloud(folder / f"scan_{k}.ply", cloud)
    output = tmp_path / "poses.txt"
    options = ("--voxel-size", 0.05, "--max-range", 5, "--scans-per-fragment", 6, "-o", output)
    assert "4 fragments" in run("08_kiss_icp.py", folder, *options)
    poses = np.loadtxt(output)[:, 1:].reshape(-1, 4, 4)
    for a, b in zip(poses, truth[::6]):
        assert np.linalg.norm(a[:3, 3] - (np.linalg.inv(truth[0]) @ b)[:3, 3]) < 0.05
