# SPDX-License-Identifier: BSD-3-Clause
"""apps/slam_demo/bag_to_tum.py: bags of ROS 1, ROS 2 and MCAP as TUM's layout."""

import pathlib
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("rosbags")

from PIL import Image
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

SCRIPT = pathlib.Path(__file__).resolve().parents[3] / "apps/slam_demo/bag_to_tum.py"
IMAGE, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"
KINDS = ("ros1", "sqlite3", "mcap")
COLOUR = np.arange(2 * 3 * 3, dtype=np.uint8).reshape(2, 3, 3)  # 3 pixels wide
DEPTH = np.array([[0, 1000, 2500], [13107, 13108, 65535]], np.uint16)  # millimetres


def messages(store, kind, k):
    """Topic, message and type of everything at a time."""
    types = store.types
    seq = {"seq": k} if kind == "ros1" else {}
    stamp = types["builtin_interfaces/msg/Time"](sec=100 + k, nanosec=5)

    def image(encoding, data, padding=0):
        rows = data.reshape(2, -1).view(np.uint8)
        rows = np.pad(rows, ((0, 0), (0, padding)))
        header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera", **seq)
        return types[IMAGE](header, 2, 3, encoding, 0, rows.shape[1], rows.ravel())

    yield "/rgb/image", IMAGE, image("bgr8", COLOUR, padding=7)
    yield "/depth/image", IMAGE, image("16UC1", DEPTH)
    yield "/float/image", IMAGE, image("32FC1", np.where(DEPTH, DEPTH / 1000, np.nan).astype("f4"))
    k9, k12 = np.array([500, 0, 1, 0, 500, 0.5, 0, 0, 1.0]), np.zeros(12)
    fields = [np.array([0.1, 0, 0, 0, 0.0]), k9, np.eye(3).ravel(), k12, 0, 0]
    roi = types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera", **seq)
    yield "/rgb/camera_info", INFO, types[INFO](header, 2, 3, "plumb_bob", *fields, roi)


def write(folder, kind, leave_out=()):
    store = get_typestore(Stores.ROS1_NOETIC if kind == "ros1" else Stores.ROS2_HUMBLE)
    path = folder / ("a.bag" if kind == "ros1" else "a")
    plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    with (
        Writer1(path)
        if kind == "ros1"
        else Writer2(path, version=9, storage_plugin=plugin) as writer
    ):
        connections = {}
        for k in range(2):
            for topic, name, message in messages(store, kind, k):
                if topic in leave_out:
                    continue
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, name, typestore=store)
                to_bytes = store.serialize_ros1 if kind == "ros1" else store.serialize_cdr
                writer.write(connections[topic], (100 + k) * 10**9, to_bytes(message, name))
    return path


def convert(bag, folder, *words):
    return subprocess.run(
        [sys.executable, SCRIPT, bag, folder, *words], capture_output=True, text=True
    )


def read_png(path):
    return np.asarray(Image.open(path))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("depth", ["/depth/image", "/float/image"])
def test_what_a_bag_holds_is_in_the_folder(tmp_path, kind, depth):
    done = convert(write(tmp_path, kind), tmp_path / "out", "--depth", depth)
    assert done.returncode == 0, done.stderr
    out = tmp_path / "out"
    assert (out / "rgb.txt").read_text().split() == [
        "100.000000005",
        "rgb/100.000000005.png",
        "101.000000005",
        "rgb/101.000000005.png",
    ]
    np.testing.assert_array_equal(read_png(out / "rgb/101.000000005.png"), COLOUR[:, :, ::-1])
    expected = np.array([[0, 5000, 12500], [65535, 0, 0]])  # 1/5000 m; too far: none
    np.testing.assert_array_equal(read_png(out / "depth/100.000000005.png"), expected)
    camera = (out / "camera.yaml").read_text()
    assert "image_width: 3\n" in camera and "data: [ 500.0, 0.0, 1.0, 0.0, 500.0, 0.5," in camera
    assert "data: [ 0.1, 0.0, 0.0, 0.0, 0.0 ]" in camera


@pytest.mark.parametrize(
    ("leave_out", "words", "message"),
    [
        (("/depth/image", "/float/image"), (), "0 topics of depth images (16UC1, mono16, 32FC1)"),
        ((), (), "2 topics of depth images (16UC1, mono16, 32FC1): name one by --depth"),
        ((), ("--depth", "/depth/none"), "depth topic /depth/none is missing"),
        ((), ("--depth", "/rgb/image"), "depth topic /rgb/image is bgr8"),
        (("/rgb/image",), ("--depth", "/depth/image"), "0 topics of colour images"),
    ],
)
def test_the_error_names_the_topic(tmp_path, leave_out, words, message):
    done = convert(write(tmp_path, "mcap", leave_out), tmp_path / "out", *words)
    assert done.returncode == 1
    assert message in done.stderr
    assert "/rgb/camera_info (sensor_msgs/msg/CameraInfo)" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", [None, "no bag"])
def test_what_is_no_bag_is_named(tmp_path, text):
    bag = tmp_path / "a.bag"
    if text is not None:
        bag.write_text(text)
    done = convert(bag, tmp_path / "out")
    assert done.returncode == 1
    assert f"bag_to_tum: {bag}: " in done.stderr
    assert "Traceback" not in done.stderr
