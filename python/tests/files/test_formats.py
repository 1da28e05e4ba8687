# SPDX-License-Identifier: BSD-3-Clause
"""Formats that libraries of Python read, in Python and in the command; depth images."""

import os
import pathlib
import re
import subprocess
import sys

import gpureg
import numpy as np
import pytest

COMMAND = pathlib.Path(gpureg.__file__).with_name("bin") / "gpureg"
with_command = pytest.mark.skipif(not COMMAND.exists(), reason="this build has no command")


def room(seed=1, count=6000):
    """Points of a floor, two walls and a step."""
    rng = np.random.default_rng(seed)
    u, v = rng.uniform(0, 1, (2, count))
    kind = rng.integers(0, 4, count)
    floor = np.stack([4 * u - 2, 3 * v - 1.5, np.zeros(count)], 1)
    wall = np.stack([4 * u - 2, np.full(count, 1.5), 2.5 * v], 1)
    side = np.stack([np.full(count, 2.0), 3 * u - 1.5, 2.5 * v], 1)
    step = np.stack([1 + 0.6 * u, 0.3 + 0.8 * v, np.full(count, 0.5)], 1)
    return np.choose(kind[:, None], [floor, wall, side, step])


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


STATIONS = [(0.0, [0.0, 0.0, 1.4]), (0.7, [-0.8, -0.6, 1.5]), (-0.4, [0.3, -0.9, 1.3])]


@pytest.fixture
def project(tmp_path):
    """An E57 file of three stations with poses, and the points of each in its own frame."""
    pye57 = pytest.importorskip("pye57")
    path, clouds = tmp_path / "project.e57", []
    with pye57.E57(str(path), mode="w") as file:
        for k, (angle, place) in enumerate(STATIONS):
            points = (room(k) - place) @ turned(angle)
            clouds.append(points)
            rows = np.vstack([points, [[0, 0, 0], [9, 9, 9]]])  # no return; invalid
            data = {f"cartesian{axis}": rows[:, i].copy() for i, axis in enumerate("XYZ")}
            data["cartesianInvalidState"] = np.arange(len(rows)) == len(rows) - 1
            file.write_scan_raw(
                data,
                name=f"Station {k + 1}",
                rotation=np.array([np.cos(angle / 2), 0, 0, np.sin(angle / 2)]),
                translation=np.array(place),
            )
    return path, clouds


def run(*arguments, **environment):
    return subprocess.run(
        [sys.executable, "-m", "gpureg", *map(str, arguments)],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
        timeout=120,
    )


class TestE57:
    def test_scans_have_names_poses_and_viewpoints(self, project):
        path, clouds = project
        scans = gpureg.scans_in(path)
        assert [scan.name for scan in scans] == ["Station 1", "Station 2", "Station 3"]
        for k, (angle, place) in enumerate(STATIONS):
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = turned(angle), place
            assert np.allclose(scans[k].file_from_scan, pose)
            assert scans[k].points == len(clouds[k]) + 2
            for cloud in (
                gpureg.read_point_cloud(path, k + 1),
                gpureg.read_point_cloud(f"{path}#{k + 1}"),
            ):
                assert np.allclose(cloud.points, clouds[k], atol=1e-6)
                assert cloud.viewpoints.tolist() == [[0, 0, 0]]
        assert gpureg.prepare(f"{path}#2").statistics.input_points == len(clouds[1])

    def test_several_scans_want_a_name(self, project):
        path, _ = project
        for read in (gpureg.read_point_cloud, gpureg.prepare):
            with pytest.raises(
                gpureg.IoError, match=r"3 scans: 1 'Station 1', 2 'Station 2'.*project\.e57#2"
            ):
                read(path)
        with pytest.raises(gpureg.IoError, match="there is no scan 4, it holds 3: 1 'Station 1'"):
            gpureg.read_point_cloud(path, 4)

    def test_damaged_files_are_named(self, project, tmp_path):
        content = project[0].read_bytes()
        for name, damaged in (
            ("half.e57", content[: len(content) // 2]),
            ("crc.e57", content[:2000] + bytes([content[2000] ^ 1]) + content[2001:]),
            ("text.e57", b"no points at all"),
            ("none.e57", b""),
        ):
            (tmp_path / name).write_bytes(damaged)
            with pytest.raises(gpureg.IoError, match=re.escape(name)):
                gpureg.read_point_cloud(f"{tmp_path / name}#1")

    def test_without_pye57_the_error_says_what_to_install(self, project, monkeypatch):
        monkeypatch.setitem(sys.modules, "pye57", None)
        with pytest.raises(ImportError, match=r"project\.e57.*pip install 'gpureg\[formats\]'"):
            gpureg.read_point_cloud(project[0], 1)

    def test_stations_in_a_batch(self, project, tmp_path):
        pytest.importorskip("pyarrow")
        path, clouds = project
        names = [f"{path}#{k + 1}" for k in range(len(clouds))]
        fragments = gpureg.FragmentSet.from_clouds(names)
        assert len({fragments.fingerprint(k) for k in range(3)}) == 3
        options = gpureg.RegistrationOptions(voxel_size=0.1)
        run = gpureg.register_all(names, output=tmp_path / "o", options=options, progress=False)
        assert run.log.read_text().count("\n") == 3 * 5  # all three pairs

    @with_command
    def test_the_command_aligns_two_stations(self, project):
        path, _ = project
        done = run("register", f"{path}#1", f"{path}#2", "--voxel-size", 0.1)
        assert done.returncode == 0, done.stderr
        assert "viewpoint given" in done.stdout
        poses = [scan.file_from_scan for scan in gpureg.scans_in(path)]
        rows = done.stdout.split("target_from_source\n")[1].split("\n")[:4]
        found = np.array([[float(number) for number in row.split()] for row in rows])
        assert np.abs(found - np.linalg.inv(poses[1]) @ poses[0]).max() < 0.05

    @with_command
    def test_the_command_lists_the_scans(self, project):
        path, _ = project
        done = run("register", path, path)
        assert done.returncode == 2 and "name one of them" in done.stderr
        assert done.stderr.count("\n") == 1 and "Traceback" not in done.stderr
        done = run("info", path)
        assert done.returncode == 0, done.stderr
        assert re.search(r"scans +3, named .*project\.e57#1 to .*project\.e57#3", done.stdout)
        assert "#2 Station 2: 6,002 points, scanned from -0.8 -0.6 1.5" in done.stdout
        assert "points           6,000" in run("info", f"{path}#3").stdout


class TestLas:
    @pytest.fixture
    def las(self, tmp_path):
        laspy = pytest.importorskip("laspy")
        file = laspy.create(point_format=3, file_version="1.2")
        points = room() + [500000, 5400000, 300]
        file.header.offsets, file.header.scales = points.min(axis=0), [0.001] * 3
        file.x, file.y, file.z = points.T
        file.write(str(tmp_path / "tile.laz"))
        return tmp_path / "tile.laz"

    def test_read_point_cloud_keeps_the_digits(self, las):
        cloud = gpureg.read_point_cloud(las)
        assert cloud.points.dtype == np.float64 and not len(cloud.viewpoints)
        assert np.abs(cloud.points - room() - [500000, 5400000, 300]).max() < 1e-2
        with pytest.raises(gpureg.IoError, match="one scan"):
            gpureg.read_point_cloud(las, 2)

    @with_command
    def test_the_command(self, las, tmp_path):
        done = run("info", las)
        assert done.returncode == 0, done.stderr
        assert "points           6,000" in done.stdout and "5400001.5" in done.stdout
        done = run("register", las, las, "--voxel-size", 0.1)
        assert done.returncode == 0, done.stderr

    @with_command
    def test_the_command_says_what_is_wrong(self, las, tmp_path):
        (tmp_path / "wrong.las").write_bytes(b"LASF" + bytes(400))
        for arguments, environment, phrase in (
            (["info", tmp_path / "wrong.las"], {}, r"wrong\.las: "),
            (["info", las], {"GPUREG_PYTHON": ""}, r"pip install 'gpureg\[formats\]'"),
            (["info", las], {"GPUREG_PYTHON": "/none/python"}, "cannot start /none/python"),
            (["info", las], {"GPUREG_PYTHON": "/bin/false"}, r"tile\.laz: /bin/false failed"),
        ):
            done = run(*arguments, **environment)
            assert done.returncode == 2 and done.stdout == ""
            assert re.search(phrase, done.stderr), done.stderr
            assert done.stderr.count("\n") == 1

    @with_command
    def test_the_command_without_laspy(self, las, tmp_path):
        (tmp_path / "laspy.py").write_text("raise ImportError\n")
        path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
        done = run("info", las, PYTHONPATH=path)
        assert done.returncode == 2
        assert re.search(r"tile\.laz: .*laspy: pip install 'gpureg\[formats\]'", done.stderr)


class TestText:
    def test_notes_are_warnings(self, tmp_path):
        path = tmp_path / "scan.csv"
        path.write_text("x,y\n1,2\n3,4\n")
        with pytest.warns(UserWarning, match=r"scan\.csv: it has no column z"):
            assert gpureg.read_point_cloud(path).points.tolist() == [[1, 2, 0], [3, 4, 0]]

    def test_parts_of_a_ptx(self, tmp_path):
        path = tmp_path / "two.ptx"
        scan = "1\n2\n1 2 3\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n{0} 2 3 1\n0 0 0 0\n"
        path.write_text(scan.format(5) + scan.format(6))
        assert [scan.points for scan in gpureg.scans_in(path)] == [2, 2]
        assert gpureg.read_point_cloud(path, 2).points.tolist() == [[6, 2, 3]]
        with pytest.raises(gpureg.IoError, match=r"2 scans: name one of them, .*two\.ptx#1"):
            gpureg.prepare(path)


class TestDepthImage:
    def test_points_are_in_front_of_the_camera(self):
        depth = np.zeros((4, 6), np.uint16)
        depth[1, 2], depth[3, 5] = 2000, 500
        cloud = gpureg.from_depth_image(depth, 100, 200, 2, 1)
        assert np.allclose(cloud.points, [[0, 0, 2], [0.015, 0.005, 0.5]])
        assert cloud.viewpoints.tolist() == [[0, 0, 0]]
        metres = np.where(depth > 0, depth / 1000, np.nan)
        assert np.allclose(
            gpureg.from_depth_image(metres, 100, 200, 2, 1, depth_scale=1).points, cloud.points
        )

    def test_wrong_images_are_named(self):
        with pytest.raises(ValueError, match=r"depth: .*\(2, 3, 3\)"):
            gpureg.from_depth_image(np.zeros((2, 3, 3)), 1, 1, 0, 0)
        with pytest.raises(ValueError, match="fx is 0"):
            gpureg.from_depth_image(np.zeros((2, 3)), 0, 1, 0, 0)
        with pytest.raises(ValueError, match="depth_scale is -1"):
            gpureg.from_depth_image(np.zeros((2, 3)), 1, 1, 0, 0, depth_scale=-1)

    def test_a_file_of_an_image_names_the_function(self, tmp_path):
        path = tmp_path / "depth.png"
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
        with pytest.raises(gpureg.IoError, match=r"an image.*gpureg\.from_depth_image"):
            gpureg.read_point_cloud(path)


# Test data of laspy, pye57, trimesh and PDAL, of which their packages have none: a folder of it.
REAL = os.environ.get("GPUREG_FORMAT_FILES", "")


@pytest.mark.skipif(not REAL, reason="GPUREG_FORMAT_FILES names no folder of other programs' files")
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_files_of_other_programs():
    read, refused = 0, []
    for path in sorted(pathlib.Path(REAL).rglob("*")):
        if not path.is_file() or path.suffix == ".list":
            continue
        try:
            parts = [scan_k + 1 for scan_k, _ in enumerate(gpureg.scans_in(path))] or [0]
            for part in parts:
                assert gpureg.read_point_cloud(path, part) is not None
            read += 1
        except (OSError, ImportError) as error:
            assert path.name in str(error)
            refused.append(f"{path.name}: {str(error).split(path.name)[-1]}")
    print(f"{read} read, {len(refused)} refused:\n" + "\n".join(refused))
    assert read > 0
