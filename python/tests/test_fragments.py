# SPDX-License-Identifier: BSD-3-Clause
"""FragmentSet: what is in a folder, and which pairs are meant."""

import os

import gpureg
import numpy as np
import pytest

NAMES = ("Flur 9.ply", "Flur 10.ply", "great hall.ply", "K\u00fcche <b>.PLY")


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
        1, gpureg.RegistrationOptions()
    )
    assert points.shape == (100, 3) and normals is features is origin is stream is None
    assert viewpoints.tolist() == [[1, 2, 3]]
    with pytest.raises(gpureg.IoError):
        gpureg.FragmentSet.from_directory(folder / "nowhere")


@pytest.fixture()
def named(tmp_path, source):
    for k, name in enumerate(NAMES):
        gpureg.write_point_cloud(tmp_path / "first.ply", source[:100] + k)
        (tmp_path / "first.ply").rename(tmp_path / name)
    (tmp_path / "upstairs").mkdir()
    gpureg.write_point_cloud(tmp_path / "upstairs" / "bath.ply", source[:100])
    (tmp_path / "cameras.txt").write_text("great hall.ply 0 1 2 3 0 0 0 1\n1 0 4 5 6 0 0 0 1\n")
    return tmp_path


def test_names_of_any_folder(named):
    fragments = gpureg.FragmentSet.from_directory(named)
    assert fragments.names == NAMES and fragments.numbers == (0, 1, 2, 3)
    viewpoints = [fragments.load(k, gpureg.RegistrationOptions())[3] for k in range(4)]
    assert viewpoints[0] is viewpoints[3] is None
    assert viewpoints[2].tolist() == [[1, 2, 3]] and viewpoints[1].tolist() == [[4, 5, 6]]
    (named / "readme.md").write_text("")
    with pytest.warns(UserWarning, match="1 file that is no cloud is skipped in .*: readme.md"):
        below = gpureg.FragmentSet.from_directory(named, recursive=True)
    assert below.names == (*NAMES, "upstairs/bath.ply")
    assert fragments.without([0]).names == NAMES[1:]


def test_patterns_and_lists(named):
    of = gpureg.FragmentSet.from_directory
    assert of(named / "Flur*.ply").names == NAMES[:2]
    assert of(str(named / "**" / "b*.ply")).names == ("bath.ply",)
    (named / "list.txt").write_text("great hall.ply  Hall\nFlur 10.ply\n", "utf-8")
    assert of(named / "list.txt").names == ("Hall", "Flur 10.ply")
    with pytest.raises(gpureg.IoError, match="is one cloud"):
        of(named / "great hall.ply")
    with pytest.raises(gpureg.IoError, match="recursive=True"):
        of(named.parent)
    clouds = gpureg.FragmentSet.from_clouds([named / NAMES[0], named / NAMES[2]])
    assert clouds.names == (NAMES[0], NAMES[2])
    assert gpureg.FragmentSet.from_clouds([np.zeros((4, 3))] * 2).names == ("0", "1")
    assert gpureg.FragmentSet.from_clouds([np.zeros((4, 3))], ["hall"]).names == ("hall",)


def test_a_name_that_is_no_text(tmp_path, source):
    gpureg.write_point_cloud(tmp_path / "a.ply", source[:100])
    os.rename(tmp_path / "a.ply", os.fsencode(tmp_path) + b"/b\xff.ply")
    assert gpureg.FragmentSet.from_directory(tmp_path).names == ("b?.ply",)


def test_pairs_by_name(named):
    fragments = gpureg.FragmentSet.from_directory(named)
    pairs = [("great hall.ply", "Flur 10"), ("great hall", 0)]
    assert fragments.choose_pairs(pairs).tolist() == [[1, 2], [0, 2]]
    with pytest.raises(ValueError, match="no fragment named 'cellar'"):
        fragments.choose_pairs([("cellar", 0)])


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
