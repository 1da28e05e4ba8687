#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the results of slam_demo as a recording for the viewer of rerun.io.

    rerun_log.py OUTPUT FILE.rrd

OUTPUT is the folder of slam_demo. Without arguments it only says whether the package is there.
"""

import sys
from pathlib import Path

PACKAGE = "rerun-sdk==0.41.0"  # needs Python 3.11 or later
try:
    import numpy as np
    import rerun as rr
except ImportError as error:
    sys.exit(f"rerun_log.py: {error}: python3 -m pip install {PACKAGE}")

SURFEL = np.dtype(
    [("position", "<f4", 3), ("normal", "<f4", 3), ("radius", "<f4"), ("confidence", "<f4")]
    + [("colour", "u1", 3)]
)


def poses(path: Path) -> np.ndarray:
    """Of a trajectory in TUM's format: rows of time, position, quaternion."""
    return np.loadtxt(path, ndmin=2).reshape(-1, 8)


def surfels(path: Path) -> np.ndarray:
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    return np.frombuffer(data, SURFEL, offset=end)


def main() -> None:
    output, file = Path(sys.argv[1]), sys.argv[2]
    rr.init("slam_demo")
    rr.save(file)
    rr.log("world", rr.ViewCoordinates.RIGHT_HAND_Y_DOWN, static=True)  # of the first camera
    cloud = surfels(output / "map.ply")
    rr.log(
        "world/map",
        rr.Points3D(cloud["position"], radii=cloud["radius"], colors=cloud["colour"]),
        static=True,
    )
    for name, colour in (("trajectory", (40, 160, 60)), ("odometry", (200, 60, 40))):
        path = poses(output / f"{name}.txt")
        rr.log(f"world/{name}", rr.LineStrips3D([path[:, 1:4]], colors=[colour]), static=True)
    keyframes = poses(output / "keyframes.txt")
    rr.log("world/keyframes", rr.Points3D(keyframes[:, 1:4], radii=0.02), static=True)
    for row in poses(output / "trajectory.txt"):
        rr.set_time("sequence", duration=row[0])
        rotation = rr.Quaternion(xyzw=row[4:8])
        rr.log("world/camera", rr.Transform3D(translation=row[1:4], quaternion=rotation))
    rr.disconnect()  # completes the file


if len(sys.argv) > 1:
    main()
