#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The clouds of a ROS bag (ROS 1, ROS 2 or MCAP) as a folder of scans, named by their times.

pip install rosbags
python 14_bag.py drive.bag scans --topic /points --every 10
gpureg reconstruct scans -o map
"""

import argparse
import pathlib
from typing import Any

import gpureg
import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

CLOUD = "sensor_msgs/msg/PointCloud2"
TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def points(message: Any) -> Any:
    """(N, 3) x y z of a message."""
    order = ">" if message.is_bigendian else "<"
    axes = {field.name: field for field in message.fields if field.name in ("x", "y", "z")}
    row = np.dtype(
        {
            "names": ["x", "y", "z"],
            "formats": [order + TYPES[axes[name].datatype] for name in "xyz"],
            "offsets": [axes[name].offset for name in "xyz"],
            "itemsize": message.point_step,
        }
    )
    size = message.width * message.point_step  # a row may be longer
    lines = np.asarray(message.data, np.uint8).reshape(message.height, message.row_step)[:, :size]
    rows = np.frombuffer(lines.tobytes(), row)
    xyz = np.stack([rows[name] for name in "xyz"], axis=1)
    return xyz[np.isfinite(xyz).all(axis=1)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bag", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path, help="for the scans")
    parser.add_argument("--topic", help="default: the only one with clouds")
    parser.add_argument("--every", type=int, default=1, help="write one of so many clouds")
    arguments = parser.parse_args()
    with AnyReader([arguments.bag], default_typestore=get_typestore(Stores.LATEST)) as reader:
        clouds = [connection for connection in reader.connections if connection.msgtype == CLOUD]
        topics = sorted({connection.topic for connection in clouds})
        topic = arguments.topic or (topics[0] if len(topics) == 1 else None)
        if topic not in topics:
            parser.error(f"--topic: the bag has clouds of {', '.join(topics) or 'no topic'}")
        arguments.folder.mkdir(exist_ok=True)
        chosen = [connection for connection in clouds if connection.topic == topic]
        count = 0
        for k, (connection, _, data) in enumerate(reader.messages(chosen)):
            if k % arguments.every:
                continue
            message: Any = reader.deserialize(data, connection.msgtype)
            stamp = message.header.stamp
            name = f"{stamp.sec}.{stamp.nanosec:09d}.ply"
            gpureg.write_point_cloud(arguments.folder / name, points(message))
            count += 1
    print(f"{count} clouds of {topic} in {arguments.folder}")


if __name__ == "__main__":
    main()
