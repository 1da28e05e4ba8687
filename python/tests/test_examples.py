# SPDX-License-Identifier: BSD-3-Clause
"""The examples run, and are typed."""

import json
import pathlib
import re
import subprocess
import sys

import gpureg
import numpy as np
import pytest
from country import make_fragments
from scenes import moved, planar, room

FOLDER = pathlib.Path(__file__).parents[2] / "examples" / "python"


def run(name, *arguments):
    done = subprocess.run(
        [sys.executable, FOLDER / name, *map(str, arguments)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture()
def scans(tmp_path, source, truth):
    folder = tmp_path / "scans"
    folder.mkdir()
    gpureg.write_point_cloud(folder / "cloud_bin_0.ply", source)
    gpureg.write_point_cloud(folder / "cloud_bin_1.ply", moved(source, truth))
    gpureg.write_point_cloud(folder / "cloud_bin_2.ply", room(5))
    return folder


def test_two_clouds(scans, tmp_path):
    pytest.importorskip("matplotlib")
    picture = tmp_path / "picture.png"
    shown = run(
        "01_two_clouds.py",
        scans / "cloud_bin_0.ply",
        scans / "cloud_bin_1.ply",
        "--picture",
        picture,
    )
    assert "aligned" in shown and picture.read_bytes().startswith(b"\x89PNG")


def test_notebook(capsys):
    notebook = json.loads((FOLDER.parent / "notebooks" / "first_pair.ipynb").read_text())
    names = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    shown = capsys.readouterr().out
    assert float(re.match(r"True ([0-9.]+) ", shown).group(1)) > 0.9
    # A tenth of a voxel: the noise of 60,000 points averages out.
    assert float(re.search(r"off by ([0-9.]+) mm", shown).group(1)) < 5


def test_batch(scans, tmp_path):
    pytest.importorskip("pyarrow")
    shown = run("02_batch.py", scans, "--output", tmp_path / "run", "--quality", 2)
    assert shown.startswith("3 pairs, ") and "   1 into    0: aligned" in shown


def test_many_fragments(tmp_path):
    pytest.importorskip("pyarrow")
    scans = tmp_path / "scans"
    scans.mkdir()
    for k, cloud in enumerate(make_fragments(24, seed=1)[0]):
        gpureg.write_point_cloud(scans / f"cloud_bin_{k}.ply", cloud)
    shown = run(
        "06_many_fragments.py",
        *(scans, "--output", tmp_path / "run", "--check", 12, "--neighbors", 4),
        *("--voxel-size", 0.12, "--quality", 0),
    )
    assert "of the recall lost" in shown and "of 66 pairs tried" in shown


def test_map(scans, tmp_path):
    shown = run("07_map.py", scans, "--output", tmp_path / "map.ply")
    assert "island 0: scans [0, 1" in shown and "weakest connection" in shown
    assert len(gpureg.read_point_cloud(tmp_path / "map.ply").points) > 500


def test_locate(scans, tmp_path):
    later = tmp_path / "later"
    later.mkdir()
    (scans / "cloud_bin_0.ply").rename(later / "cloud_bin_7.ply")
    gpureg.write_point_cloud(scans / "cloud_bin_3.ply", moved(room(), np.eye(4)))
    shown = run("09_locate.py", scans, later, "--save-map", tmp_path / "map.gpureg")
    assert "scan 7: found" in shown and len(gpureg.load_map(tmp_path / "map.gpureg")) > 500


def test_own_features():
    pytest.importorskip("torch")
    assert "aligned" in run("04_own_features.py")


def snippets():
    """The Python programs of the README, as printed."""
    text = (pathlib.Path(__file__).parents[2] / "README.md").read_text()
    assert "pip install '.[batch,formats]'" in text
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


def test_readme_aligns_two_files(tmp_path, monkeypatch, source, truth):
    gpureg.write_point_cloud(tmp_path / "scan_a.ply", moved(source, truth))
    gpureg.write_point_cloud(tmp_path / "scan_b.ply", source)
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(snippets()[0], names)
    assert names["result"].aligned
    assert np.abs(names["moved"] - source).max() < 0.05  # a voxel


def test_readme_closes_a_loop(capsys):
    """Five looks into a room, the last one from where the first one was."""
    poses = [planar(0.1 * k, 0.05 * k, 5 * k) for k in (0, 1, 2, 1, 0)]
    fragments = [(moved(room(points=12000), np.linalg.inv(pose)), pose) for pose in poses]
    names: dict = {"gpureg": gpureg, "fragments": fragments}
    exec(snippets()[1], names)
    assert len(names["poses"]) == 5 and "4 0 accepted" in capsys.readouterr().out


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.name)
def test_mypy_strict(path):
    pytest.importorskip("mypy")
    from test_stubs import ROOT
    from test_stubs import run as run_module

    run_module("mypy", "--config-file", str(ROOT / "pyproject.toml"), str(path))


def test_bag(source, tmp_path):
    pytest.importorskip("rosbags")
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    field = types["sensor_msgs/msg/PointField"]
    cloud = types["sensor_msgs/msg/PointCloud2"]
    header, time = types["std_msgs/msg/Header"], types["builtin_interfaces/msg/Time"]
    with Writer(tmp_path / "bag", version=9) as writer:
        topic = writer.add_connection("/points", cloud.__msgtype__, typestore=store)
        for k in range(3):
            rows = np.zeros((100, 5), np.float32)  # x y z intensity ring
            rows[:, :3] = source[100 * k : 100 * k + 100]
            rows[0, 0] = np.nan
            message = cloud(
                header(time(1305031102 + k, 175304000), "lidar"),
                *(1, 100),
                [field(name, 4 * n, 7, 1) for n, name in enumerate("xyz")],
                *(False, 20, 2000, rows.view(np.uint8).ravel(), False),
            )
            writer.write(topic, 10 * k, store.serialize_cdr(message, cloud.__msgtype__))
    shown = run("14_bag.py", tmp_path / "bag", tmp_path / "scans", "--every", "2")
    assert shown.startswith("2 clouds of /points")
    scans = gpureg.FragmentSet.from_directory(tmp_path / "scans")
    assert scans.names == ("1305031102.175304000.ply", "1305031104.175304000.ply")
    written = gpureg.read_point_cloud(tmp_path / "scans" / scans.names[1]).points
    assert np.array_equal(written, source[201:300].astype(np.float32))
