# SPDX-License-Identifier: BSD-3-Clause
"""Close the loops of KISS-ICP.

    pip install kiss-icp
    python 08_kiss_icp.py FOLDER [--voxel-size 0.5] [--scans-per-fragment 20] [-o poses.txt]

FOLDER has the scans in order, as PLY or PCD files in the frame of the sensor. KISS-ICP tracks them;
every few metres its scans become a fragment, and the closer says where the fragments really are.
"""

import argparse
import re
from pathlib import Path

import gpureg
import numpy as np
from kiss_icp.config import KISSConfig
from kiss_icp.kiss_icp import KissICP


def in_order(path: Path) -> list[tuple[int, str]]:
    """Key of a name whose numbers count as numbers: scan_2 is before scan_10."""
    return [(int(part) if part.isdigit() else -1, part) for part in re.split(r"(\d+)", path.name)]


def main() -> int:
    parser = argparse.ArgumentParser(description="Close the loops of KISS-ICP.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--voxel-size", type=float, default=0.5, help="metres, of the registration")
    parser.add_argument("--max-range", type=float, default=100.0, help="metres")
    parser.add_argument("--scans-per-fragment", type=int, default=20)
    parser.add_argument("-o", "--output", type=Path, default=Path("poses.txt"))
    arguments = parser.parse_args()

    config = KISSConfig()
    config.data.max_range = arguments.max_range
    config.data.deskew = False  # the files have no time stamps of points
    config.mapping.voxel_size = arguments.max_range / 100
    tracker = KissICP(config)
    closer = gpureg.LoopCloser(voxel_size=arguments.voxel_size)

    points: list[np.ndarray] = []
    sensors: list[np.ndarray] = []
    world_from_fragments: list[np.ndarray] = []
    files = sorted(
        (p for p in arguments.folder.iterdir() if p.suffix in (".ply", ".pcd")), key=in_order
    )
    for number, file in enumerate(files):
        scan = np.asarray(gpureg.read_point_cloud(file).points, np.float64)
        tracker.register_frame(scan, np.array([]))
        world_from_scan = np.array(tracker.last_pose)
        if not points:
            world_from_fragments.append(world_from_scan)
        fragment_from_scan = np.linalg.inv(world_from_fragments[-1]) @ world_from_scan
        points.append(scan @ fragment_from_scan[:3, :3].T + fragment_from_scan[:3, 3])
        sensors.append(fragment_from_scan[:3, 3])
        if len(points) < arguments.scans_per_fragment and number + 1 < len(files):
            continue
        here = len(world_from_fragments) - 1
        cloud = gpureg.prepare(
            np.concatenate(points),
            viewpoints=np.array(sensors),
            options=gpureg.RegistrationOptions(voxel_size=arguments.voxel_size),
        )
        closer.add(here, cloud, world_from_fragments[-1], time=float(number))
        if here > 0:
            previous_from_here = np.linalg.inv(world_from_fragments[-2]) @ world_from_fragments[-1]
            closer.add_odometry(here, here - 1, previous_from_here)
        for loop in closer.process(milliseconds=50).changed:
            print(f"scan {number}: {loop.source} -> {loop.target} {loop.state} ({loop.reason})")
        points, sensors = [], []

    for loop in closer.process().changed:
        print(f"end: {loop.source} -> {loop.target} {loop.state} ({loop.reason})")
    rows = [np.r_[id, pose.ravel()] for id, pose in sorted(closer.poses.items())]
    np.savetxt(arguments.output, rows, fmt="%.9g", header="fragment, world_from_fragment by rows")
    print(f"{len(rows)} fragments in {arguments.output}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
