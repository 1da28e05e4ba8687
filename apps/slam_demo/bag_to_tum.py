#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Colour and depth images of a bag (ROS 1, ROS 2, MCAP) as a sequence that slam_demo reads.

usage: bag_to_tum.py BAG FOLDER [--colour TOPIC] [--depth TOPIC]

BAG is a file of ROS 1 or a folder of ROS 2. FOLDER gets TUM's layout, and a camera.yaml where the
bag has the CameraInfo of the colour camera. Depth images need to be registered to the colour
camera. Topics that are not named are the only ones of their kind. Needs rosbags
and pillow (python3 -m pip install rosbags pillow).
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from rosbags.highlevel import AnyReader, AnyReaderError

IMAGE, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"
COLOUR = {"rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4, "mono8": 1}  # channels
DEPTH = {"16UC1": 0.001, "mono16": 0.001, "32FC1": 1}  # metres of a value
TUM_DEPTH_UNITS = 5000  # values per metre


def pixels(message, dtype, channels):
    """height x width x channels of a message, whose rows may be padded."""
    dtype = np.dtype(dtype).newbyteorder(">" if message.is_bigendian else "<")
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)
    rows = rows[:, : message.width * channels * dtype.itemsize].copy().view(dtype)
    return rows.reshape(message.height, message.width, channels).astype(dtype.newbyteorder("="))


def colour_image(message):
    image = pixels(message, np.uint8, COLOUR[message.encoding])
    if image.shape[2] == 1:
        return image[:, :, 0]
    order = (2, 1, 0) if message.encoding.startswith("bgr") else (0, 1, 2)
    return np.ascontiguousarray(image[:, :, order])


def depth_image(message):
    metres = pixels(message, np.float32 if message.encoding == "32FC1" else np.uint16, 1)[:, :, 0]
    values = metres * DEPTH[message.encoding] * TUM_DEPTH_UNITS
    values = np.rint(np.nan_to_num(values, posinf=0, neginf=0))
    values[(values < 0) | (values > 65535)] = 0
    return values.astype(np.uint16)


def choose(kind, wanted, known, reader):
    """The topic of a kind of images, whose encodings are known."""
    found = {}  # encodings of all topics of images
    for connection in reader.connections:
        if connection.msgtype == IMAGE and connection.msgcount:
            _, _, raw = next(reader.messages([connection]))
            found[connection.topic] = reader.deserialize(raw, IMAGE).encoding
    fitting = [topic for topic, encoding in found.items() if encoding in known]
    if wanted in fitting or (not wanted and len(fitting) == 1):
        return wanted or fitting[0]
    if wanted:
        what = f"{kind} topic {wanted} is {found.get(wanted, 'missing')}"
    else:
        what = f"{len(fitting)} topics of {kind} images ({', '.join(known)})"
        what += f": name one by --{kind}" if fitting else ""
    topics = ", ".join(f"{c.topic} ({c.msgtype})" for c in reader.connections)
    raise SystemExit(f"bag_to_tum: {what}; topics: {topics or 'none'}")


def camera_yaml(info):
    def matrix(rows, columns, data):
        numbers = ", ".join(repr(float(value)) for value in data)
        return (
            f"!!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n"
            f"   data: [ {numbers} ]\n"
        )

    k, d = (info.K, info.D) if hasattr(info, "K") else (info.k, info.d)
    text = f"%YAML:1.0\n---\nimage_width: {info.width}\nimage_height: {info.height}\n"
    text += f"camera_matrix: {matrix(3, 3, k)}depth_units: {TUM_DEPTH_UNITS}.\n"
    if any(d):
        if info.distortion_model not in ("plumb_bob", "rational_polynomial"):
            raise SystemExit(f"bag_to_tum: distortion model {info.distortion_model} is not known")
        text += f"distortion_coefficients: {matrix(1, len(d), d)}"
    return text


def convert(bag, folder, colour, depth):
    with AnyReader([bag]) as reader:
        topics = {
            choose("colour", colour, COLOUR, reader): ("rgb", colour_image),
            choose("depth", depth, DEPTH, reader): ("depth", depth_image),
        }
        info_topic = str(Path(next(iter(topics))).parent / "camera_info")
        lists = {name: [] for name, _ in topics.values()}
        for name in lists:
            (folder / name).mkdir(parents=True, exist_ok=True)
        wanted = [c for c in reader.connections if c.topic in (*topics, info_topic)]
        camera = folder / "camera.yaml"
        for connection, _, raw in reader.messages(wanted):
            message = reader.deserialize(raw, connection.msgtype)
            if connection.msgtype == INFO:
                if not camera.exists():
                    camera.write_text(camera_yaml(message))
                continue
            name, pixels_of = topics[connection.topic]
            stamp = message.header.stamp
            file = f"{name}/{stamp.sec}.{stamp.nanosec:09d}.png"
            Image.fromarray(pixels_of(message)).save(folder / file)
            lists[name].append(f"{file[len(name) + 1 : -4]} {file}\n")
    for name, lines in lists.items():
        (folder / f"{name}.txt").write_text("".join(sorted(lines)))
    return {name: len(lines) for name, lines in lists.items()}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("bag", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--colour", help="topic of the colour images")
    parser.add_argument("--depth", help="topic of the depth images, registered to colour")
    args = parser.parse_args()
    try:
        counts = convert(args.bag, args.folder, args.colour, args.depth)
    except (AnyReaderError, OSError) as error:
        raise SystemExit(f"bag_to_tum: {args.bag}: {error}") from error
    print(f"{counts['rgb']} colour and {counts['depth']} depth images in {args.folder}")
    if not (args.folder / "camera.yaml").exists():
        print("no CameraInfo: name the camera by slam_demo --camera", file=sys.stderr)
