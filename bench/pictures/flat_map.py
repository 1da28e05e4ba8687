#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/images/flat_map.png: scans of a 2-D scanner, and the map that gpureg makes of them.

usage: flat_map.py SCANS MAP    SCANS: of `gpureg generate --scan-step`; MAP: of `gpureg reconstruct`
Needs matplotlib."""

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "bench/flat_scans"))
from run import moved, read_ply, read_poses

SHOWN = 3  # single scans


def main():
    scans, made = map(pathlib.Path, sys.argv[1:])
    poses = read_poses(made / "poses.txt")
    figure, axes = plt.subplots(
        1, SHOWN + 1, figsize=(10, 3), width_ratios=[1] * SHOWN + [2.2], constrained_layout=True
    )
    for k, place in enumerate(axes[:SHOWN]):
        points = read_ply(scans / f"cloud_bin_{7 * k + 1}.ply")
        place.plot(points[:, 0], points[:, 1], ".", ms=0.7, color="tab:blue")
        place.plot(0, 0, "r+")
        place.set_title(f"scan {7 * k + 1}", fontsize=9)
    for k, pose in poses.items():
        points = moved(pose, read_ply(scans / f"cloud_bin_{k}.ply"))
        axes[-1].plot(points[:, 0], points[:, 1], ",", color="tab:blue", alpha=0.4)
        axes[-1].plot(pose[0, 3], pose[1, 3], "r+", ms=4)
    axes[-1].set_title(f"map of {len(poses)} scans", fontsize=9)
    for place in axes:
        place.set_aspect("equal")
        place.axis("off")
    figure.savefig(ROOT / "docs/images/flat_map.png", dpi=90)


main()
