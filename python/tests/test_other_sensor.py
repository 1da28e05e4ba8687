# SPDX-License-Identifier: BSD-3-Clause
"""bench/accuracy/other_sensor.py: the same scene, worse by as much as was asked for."""

import pathlib
import subprocess
import sys

import gpureg
import numpy as np
import pytest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "bench/accuracy/other_sensor.py"


def run(*words):
    return subprocess.run(
        [sys.executable, SCRIPT, *map(str, words)], capture_output=True, text=True
    )


@pytest.fixture
def scene(tmp_path):
    folder = tmp_path / "scene"
    folder.mkdir()
    random = np.random.default_rng(3)
    for k in range(8):
        gpureg.write_point_cloud(
            folder / f"cloud_bin_{k}.ply", random.uniform(-3, 3, (4000, 3)).astype(np.float32)
        )
    (folder / "cameras.txt").write_text("0 0 0 0 0 0 0 0 1\n")
    return folder


def points(folder):
    return np.concatenate(
        [
            np.asarray(gpureg.read_point_cloud(folder / f"cloud_bin_{k}.ply").points)
            for k in range(8)
        ]
    )


def test_moves_points_by_what_was_asked(scene, tmp_path):
    assert run(scene, tmp_path / "noise", "--noise", 0.01).returncode == 0
    moved = points(tmp_path / "noise") - points(scene)
    assert moved.std() == pytest.approx(0.01, rel=0.02)
    assert run(scene, tmp_path / "drift", "--drift", 0.02).returncode == 0
    moved = points(tmp_path / "drift") - points(scene)
    # Eight fields of 24 random amplitudes each.
    assert moved.std() == pytest.approx(0.02, rel=0.2)
    # Neighbours move together: a field, no noise.
    order = np.argsort(points(scene)[:4000, 0])
    one = points(scene)[:4000][order]
    near = np.linalg.norm(np.diff(one, axis=0), axis=1) < 0.3
    assert near.any()
    assert np.abs(np.diff(moved[:4000][order], axis=0))[near].mean() < 0.012
    assert (tmp_path / "drift/cameras.txt").read_text() == (scene / "cameras.txt").read_text()


def test_bumps_turn_what_drift_only_bends(scene, tmp_path):
    assert run(scene, tmp_path / "bumps", "--bumps", 0.02).returncode == 0
    assert run(scene, tmp_path / "drift", "--drift", 0.02).returncode == 0
    from_each = points(scene)[:4000]
    near = np.linalg.norm(from_each[:, None] - from_each[None, :200], axis=2)
    one, other = np.nonzero((near > 0) & (near < 0.25))
    bend = {}
    for out in ("bumps", "drift"):
        moved = points(tmp_path / out) - points(scene)
        assert moved.std() == pytest.approx(0.02, rel=0.2)
        bend[out] = np.abs(moved[one] - moved[other]).mean()
    assert bend["bumps"] > 3 * bend["drift"]


def test_holes_leave_the_rest_where_it_is(scene, tmp_path):
    assert run(scene, tmp_path / "holes", "--holes", 0.2).returncode == 0
    for k in range(8):
        before, after = (
            np.asarray(gpureg.read_point_cloud(folder / f"cloud_bin_{k}.ply").points)
            for folder in (scene, tmp_path / "holes")
        )
        # Balls drawn at random leave exp(-0.2) = 0.82, as they overlap; the last of them goes
        # beyond what was asked for.
        assert 0.79 < len(after) / len(before) < 0.84
        assert {tuple(p) for p in after} < {tuple(p) for p in before}


def test_flying_points_hang_towards_a_camera(scene, tmp_path):
    assert run(scene, tmp_path / "flying", "--flying", 0.1).returncode == 0
    before, moved = points(scene), points(tmp_path / "flying") - points(scene)
    far = np.linalg.norm(moved, axis=1)
    # Patches overlap, too; the lengths are 0.02 to 0.12 but for the rounding to float32.
    assert 0.05 < (far > 0).mean() <= 0.11
    assert 0.019 < far[far > 0].min() and far.max() < 0.121
    # The only camera is at the origin.
    towards = -before / np.linalg.norm(before, axis=1, keepdims=True)
    assert ((moved * towards).sum(1)[far > 0] / far[far > 0]).min() > 0.999


def test_same_seed_same_bytes(scene, tmp_path):
    for out, seed in (("a", 1), ("b", 1), ("c", 2)):
        assert (
            run(scene, tmp_path / out, "--drift", 0.01, "--noise", 0.01, "--seed", seed).returncode
            == 0
        )
    read = {out: (tmp_path / out / "cloud_bin_0.ply").read_bytes() for out in "abc"}
    assert read["a"] == read["b"] != read["c"]


def test_says_what_is_wrong(scene, tmp_path):
    assert "no cloud_bin_<i>.ply" in run(tmp_path / "nothing", tmp_path / "out").stderr
    assert (
        "--holes is 1.0, not a share in [0, 1)" in run(scene, tmp_path / "out", "--holes", 1).stderr
    )
    assert "is the scene itself" in run(scene, scene).stderr
    (scene / "cloud_bin_0.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n"
    )
    assert "not a binary PLY" in run(scene, tmp_path / "out").stderr
