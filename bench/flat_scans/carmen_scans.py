#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Scans of a log of CARMEN (FLASER lines, poses corrected by a mapping program) as a folder for
run.py: cloud_bin_<i>.ply in the frame of the scanner, poses.txt.

usage: carmen_scans.py LOG OUT [--every 1.5] [--scans 60] [--range 30]. Needs numpy."""

import argparse
import pathlib

import numpy as np


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("log", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--every", type=float, default=1.5, help="metres between scans")
    parser.add_argument("--scans", type=int, default=60)
    parser.add_argument("--range", type=float, default=30, help="metres; longer is no return")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    poses, last, number = [], None, 0
    for line in arguments.log.read_text().splitlines():
        words = line.split()
        if not words or words[0] != "FLASER" or number == arguments.scans:
            continue
        count = int(words[1])
        ranges = np.array(words[2 : 2 + count], float)
        x, y, heading = map(float, words[2 + count : 5 + count])
        if last is not None and np.hypot(x - last[0], y - last[1]) < arguments.every:
            continue
        last = x, y
        step = 1.0 if count <= 181 else 0.5
        angle = np.radians(np.arange(count) * step - 90)
        kept = (ranges > 0.1) & (ranges < arguments.range)
        points = np.c_[ranges * np.cos(angle), ranges * np.sin(angle), 0 * ranges][kept]
        header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n" + "".join(
            f"property float {axis}\n" for axis in "xyz"
        )
        (arguments.out / f"cloud_bin_{number}.ply").write_bytes(
            (header + "end_header\n").encode() + points.astype("<f4").tobytes()
        )
        c, s = np.cos(heading), np.sin(heading)
        poses.append(f"{number}\n{c} {-s} 0 {x}\n{s} {c} 0 {y}\n0 0 1 0\n0 0 0 1\n")
        number += 1
    (arguments.out / "poses.txt").write_text("".join(poses))
    print(f"{number} scans in {arguments.out}")


main()
