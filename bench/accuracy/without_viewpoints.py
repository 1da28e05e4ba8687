#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A scene without known viewpoints, for fit_confidence.py --origin and --unknown.

Either the same clouds without cameras.txt, whose normals then turn to the origin; or (--unknown)
clouds with a direction at every point, towards the nearest of every fifth camera: it tells the side
of a surface that was observed, and no viewpoint. The clouds are those of SCENE
(cloud_bin_<i>.ply, cameras.txt); the ground truth is copied along.

usage: without_viewpoints.py SCENE OUT [--unknown]
Needs numpy, and --unknown the Python package gpureg."""

import pathlib
import shutil
import sys

import numpy as np
from record import cameras, plain_parser

EVERY = 5  # thins out the cameras, whose neighbours in the sequence stand close together


def towards(points, positions):
    squared = ((points[:, None] - positions[None]) ** 2).sum(2)
    direction = positions[squared.argmin(1)] - points
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


def main():
    parser = plain_parser(__doc__)
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--unknown", action="store_true", help="not even the origin is a viewpoint")
    arguments = parser.parse_args()
    clouds = sorted(arguments.scene.glob("cloud_bin_*.ply"))
    if not clouds:
        sys.exit(f"error: {arguments.scene}: no cloud_bin_<i>.ply")
    arguments.out.mkdir(parents=True, exist_ok=True)
    for truth in [*arguments.scene.glob("gt*"), *arguments.scene.glob("poses.txt")]:
        shutil.copy(truth, arguments.out)
    if not arguments.unknown:
        for cloud in clouds:
            shutil.copy(cloud, arguments.out)
        return
    import gpureg

    positions = {
        fragment: np.array(every[::EVERY])
        for fragment, every in cameras(arguments.scene / "cameras.txt").items()
    }
    for cloud in clouds:
        if int(cloud.stem.rsplit("_", 1)[1]) not in positions:
            sys.exit(f"error: {arguments.scene / 'cameras.txt'}: no camera of {cloud.name}")
        points = np.asarray(gpureg.read_point_cloud(cloud).points, np.float64)
        gpureg.write_point_cloud(
            arguments.out / cloud.name,
            points,
            towards(points, positions[int(cloud.stem.rsplit("_", 1)[1])]),
        )


main()
