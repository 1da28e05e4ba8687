#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A scene as of a worse sensor, or a worse odometry, for fit_confidence.py --beside.

Drift bends each fragment by a smooth field: 24 waves of 0.7 to 3 m that together move a point by
--drift metres (root mean square, each axis). Noise moves every point by itself, before the voxels
average it. Depth cameras also make bumps, a field of waves of 6 to 25 cm, as
errors of neighbouring points are similar, which turns normals; holes, balls of 5 to 20 cm without a
point, where a surface was too dark, too bright or too steep; and flying points, patches of 2 to 6
cm, 2 to 12 cm in front of their surface, towards one of the cameras. Everything else of SCENE
(truth, cameras.txt) is copied.

usage: other_sensor.py SCENE OUT [--drift METRES] [--noise METRES] [--bumps METRES] [--holes SHARE]
[--flying SHARE] [--seed N] Reads cloud_bin_<i>.ply whose vertices are binary floats. Needs
numpy."""

import pathlib
import shutil
import sys

import numpy as np
from record import cameras, plain_parser

# Chosen by hand; no record compares other values.
WAVES = 24  # in the sum that makes a field
DRIFT, BUMPS = (0.7, 3.0), (0.06, 0.25)  # metres, shortest and longest wave
HOLE, PATCH = (0.05, 0.2), (0.02, 0.06)  # metres, smallest and largest radius
FLIGHT = (0.02, 0.12)  # metres before the surface


def read(path):
    """Header lines, and one row of floats a vertex."""
    raw = path.read_bytes()
    end = raw.find(b"end_header\n") + len(b"end_header\n")
    lines = raw[:end].decode("ascii", "replace").splitlines()
    properties = [line.split() for line in lines if line.startswith("property")]
    if (
        "format binary_little_endian 1.0" not in lines
        or any(p[1] != "float" for p in properties)
        or [p[2] for p in properties[:3]] != ["x", "y", "z"]
    ):
        sys.exit(f"error: {path}: not a binary PLY whose vertices are x, y, z and other floats")
    return raw[:end], np.frombuffer(raw, "<f4", offset=end).reshape(-1, len(properties)).copy()


def waves(points, metres, lengths, random):
    wave = random.normal(size=(WAVES, 3))
    wave *= (2 * np.pi / random.uniform(*lengths, WAVES) / np.linalg.norm(wave, axis=1))[:, None]
    amplitude = random.normal(size=(WAVES, 3)) * metres * np.sqrt(2 / WAVES)
    return np.cos(points @ wave.T + random.uniform(0, 2 * np.pi, WAVES)) @ amplitude


def balls(points, share, radii, random):
    """The points in each of some balls, as many as hold that share of all; where balls overlap they
    have less together.
    """
    left = share * len(points)
    while left > 0:
        inside = np.flatnonzero(
            ((points - points[random.integers(len(points))]) ** 2).sum(1)
            <= random.uniform(*radii) ** 2
        )
        left -= len(inside)
        yield inside


def main():
    parser = plain_parser(__doc__)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--drift", type=float, default=0.0)
    parser.add_argument("--noise", type=float, default=0.0)
    parser.add_argument("--bumps", type=float, default=0.0)
    parser.add_argument("--holes", type=float, default=0.0)
    parser.add_argument("--flying", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    for name in ("holes", "flying"):
        if not 0 <= getattr(arguments, name) < 1:
            parser.error(f"--{name} is {getattr(arguments, name)}, not a share in [0, 1)")
    if not list(arguments.scene.glob("cloud_bin_*.ply")):
        sys.exit(f"error: {arguments.scene}: no cloud_bin_<i>.ply")
    if arguments.out.exists() and arguments.out.samefile(arguments.scene):
        sys.exit(f"error: {arguments.out} is the scene itself")
    viewpoints = cameras(arguments.scene / "cameras.txt")
    arguments.out.mkdir(parents=True, exist_ok=True)
    for file in sorted(arguments.scene.iterdir()):
        if not file.name.startswith("cloud_bin_") or file.suffix != ".ply":
            shutil.copy(file, arguments.out / file.name)
            continue
        header, vertices = read(file)
        fragment = int(file.stem.rsplit("_", 1)[1])
        random = np.random.default_rng([arguments.seed, fragment])
        points = vertices[:, :3].astype(float)
        points += (
            waves(points, arguments.drift, DRIFT, random)
            + random.normal(size=points.shape) * arguments.noise
        )
        # Without bumps no numbers are drawn for them, so that such scenes keep their bytes.
        if arguments.bumps > 0:
            points += waves(points, arguments.bumps, BUMPS, random)
        still = points.copy()
        for patch in balls(still, arguments.flying, PATCH, random):
            seen_from = viewpoints.get(fragment, [[0.0, 0.0, 0.0]])
            towards = np.array(seen_from[random.integers(len(seen_from))]) - still[patch]
            points[patch] = still[patch] + towards / np.maximum(
                np.linalg.norm(towards, axis=1, keepdims=True), 1e-9
            ) * random.uniform(*FLIGHT)
        vertices[:, :3] = points
        kept = np.ones(len(points), bool)
        for hole in balls(still, arguments.holes, HOLE, random):
            kept[hole] = False
        count = f"element vertex {len(points)}\n".encode()
        if count not in header:
            sys.exit(f"error: {file}: {len(points)} vertices, but not by its header")
        (arguments.out / file.name).write_bytes(
            header.replace(count, f"element vertex {kept.sum()}\n".encode())
            + vertices[kept].tobytes()
        )


main()
