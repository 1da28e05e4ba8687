# SPDX-License-Identifier: BSD-3-Clause
"""FragmentSet: what is in a folder, and which pairs are meant."""

import gpureg
import numpy as np
import pytest


@pytest.fixture()
def folder(tmp_path, source):
    for number in (3, 10, 4):
        gpureg.write_point_cloud(tmp_path / f"cloud_bin_{number}.ply", source[:100] + number)
    (tmp_path / "cameras.txt").write_text("4 0 1 2 3 0 0 0 1\n")
    return tmp_path


def test_folder(folder):
    fragments = gpureg.FragmentSet.from_directory(folder)
    assert fragments.numbers == (3, 4, 10) and len(fragments) == 3 and fragments.count == 11
    points, normals, features, viewpoints, origin, stream = fragments.load(
        1, gpureg.PrepareOptions()
    )
    assert points.shape == (100, 3) and normals is features is origin is stream is None
    assert viewpoints.tolist() == [[1, 2, 3]]
    with pytest.raises(gpureg.IoError):
        gpureg.FragmentSet.from_directory(folder / "nowhere")


def test_cameras(folder):
    cameras = gpureg.read_cameras(folder / "cameras.txt")
    assert {number: rows.tolist() for number, rows in cameras.items()} == {4: [[1, 2, 3]]}
    (folder / "cameras.txt").write_text("4 0 1 2 nan 0 0 0 1\n")
    with pytest.raises(gpureg.IoError, match="cameras.txt:1"):
        gpureg.read_cameras(folder / "cameras.txt")


def test_fingerprints_tell_clouds_apart(folder):
    before = gpureg.FragmentSet.from_directory(folder)
    prints = [before.fingerprint(k) for k in range(3)]
    assert len(set(prints)) == 3
    (folder / "cameras.txt").write_text("4 0 1 2 4 0 0 0 1\n")
    after = gpureg.FragmentSet.from_directory(folder)
    assert [after.fingerprint(k) == prints[k] for k in range(3)] == [True, False, True]
    clouds = gpureg.FragmentSet.from_clouds([np.zeros((4, 3)), np.ones((4, 3))])
    assert clouds.fingerprint(0) != clouds.fingerprint(1)


def test_a_fingerprint_sees_the_middle_of_a_file(tmp_path):
    path = tmp_path / "cloud_bin_0.ply"
    gpureg.write_point_cloud(path, np.random.default_rng(1).random((20_000, 3)))
    fragments = gpureg.FragmentSet.from_directory(tmp_path)
    before = fragments.fingerprint(0)
    with open(path, "r+b") as file:
        file.seek(path.stat().st_size // 2)
        file.write(b"\0\0\0\0")
    assert fragments.fingerprint(0) != before


def test_pairs():
    fragments = gpureg.FragmentSet([2, 5, 9, 12], [None] * 4)
    assert len(fragments.choose_pairs("all")) == 6
    assert fragments.choose_pairs([(9, 5), (2, 12), (5, 9)]).tolist() == [[1, 2], [0, 3]]
    assert fragments.choose_pairs(lambda f: np.array([[2, f.numbers[-1]]])).tolist() == [[0, 3]]
    assert len(fragments.choose_pairs([])) == 0
    for wrong, message in [
        ([(2, 3)], "there is no fragment 3"),
        ([(2, 99)], "there is no fragment 99"),
        ([(2, 2)], "is a fragment and itself"),
        ([(2.0, 5.0)], r"whole numbers of shape \(M, 2\), got float64"),
        ([(2, 5, 9)], r"shape \(1, 3\)"),
        ("some", 'expected "all"'),
    ]:
        with pytest.raises(ValueError, match=message):
            fragments.choose_pairs(wrong)


def test_numbers_are_checked():
    with pytest.raises(ValueError, match="twice"):
        gpureg.FragmentSet([1, 1], [None] * 2)
    with pytest.raises(ValueError, match="ascending"):
        gpureg.FragmentSet([2, 1], [None] * 2)
