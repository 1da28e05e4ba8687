#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A scene as a worse sensor, or a worse odometry, would have brought it, for fit_confidence.py --beside.

Drift bends each fragment by a smooth field: 24 waves of 0.7 to 3 m that together move a point by --drift metres (root mean square, each
axis). Noise moves every point by itself, before the voxels average it. Everything else of SCENE (truth, cameras.txt) is copied.

usage: other_sensor.py SCENE OUT [--drift METRES] [--noise METRES] [--seed N]
Reads cloud_bin_<i>.ply whose vertices are binary floats. Needs numpy."""
import argparse
import pathlib
import shutil
import sys

import numpy as np

WAVES, SHORTEST, LONGEST = 24, 0.7, 3.0


def read(path):
    """Header lines, and one row of floats a vertex."""
    raw = path.read_bytes()
    end = raw.find(b"end_header\n") + len(b"end_header\n")
    lines = raw[:end].decode("ascii", "replace").splitlines()
    properties = [line.split() for line in lines if line.startswith("property")]
    if "format binary_little_endian 1.0" not in lines or any(p[1] != "float" for p in properties) or [p[2] for p in properties[:3]] != ["x", "y", "z"]:
        sys.exit(f"error: {path}: not a binary PLY whose vertices are x, y, z and other floats")
    return raw[:end], np.frombuffer(raw, "<f4", offset=end).reshape(-1, len(properties)).copy()


def drift(points, metres, random):
    wave = random.normal(size=(WAVES, 3))
    wave *= (2 * np.pi / random.uniform(SHORTEST, LONGEST, WAVES) / np.linalg.norm(wave, axis=1))[:, None]
    amplitude = random.normal(size=(WAVES, 3)) * metres * np.sqrt(2 / WAVES)
    return np.cos(points @ wave.T + random.uniform(0, 2 * np.pi, WAVES)) @ amplitude


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--drift", type=float, default=0.0)
    parser.add_argument("--noise", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    if not list(arguments.scene.glob("cloud_bin_*.ply")):
        sys.exit(f"error: {arguments.scene}: no cloud_bin_<i>.ply")
    if arguments.out.exists() and arguments.out.samefile(arguments.scene):
        sys.exit(f"error: {arguments.out} is the scene itself")
    arguments.out.mkdir(parents=True, exist_ok=True)
    for file in sorted(arguments.scene.iterdir()):
        if not file.name.startswith("cloud_bin_") or file.suffix != ".ply":
            shutil.copy(file, arguments.out / file.name)
            continue
        header, vertices = read(file)
        random = np.random.default_rng([arguments.seed, int(file.stem.rsplit("_", 1)[1])])
        points = vertices[:, :3].astype(float)
        points += drift(points, arguments.drift, random) + random.normal(size=points.shape) * arguments.noise
        vertices[:, :3] = points
        (arguments.out / file.name).write_bytes(header + vertices.tobytes())


main()
