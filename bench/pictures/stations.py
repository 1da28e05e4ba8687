#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/images/stations.png: an E57 project of three stations of a terrestrial scanner, and the map that
gpureg makes of it.

    bench/pictures/stations.py write project.e57
    gpureg reconstruct project.e57 -o map --voxel-size auto
    bench/pictures/stations.py draw project.e57 map

The house is simulated: three rooms with doors between them, furniture of boxes. Needs numpy, scipy, trimesh,
embreex, manifold3d, pye57, gpureg, Pillow and matplotlib, whose font it takes."""

import pathlib
import sys

import numpy as np
import render
from PIL import Image, ImageDraw

ROOT = pathlib.Path(__file__).resolve().parents[2]
SEED = 4
WALL, HEIGHT, DOOR = 0.15, 2.6, 1.4  # metres
LENGTH, DEPTH = 11.0, 6.0
STATIONS = [
    (-4.0, 0.8, 1.5, 0.3),
    (-0.2, -0.9, 1.6, 2.1),
    (3.8, 1.2, 1.4, -1.3),
]  # x, y, z, heading
COLOURS = np.array([(86, 148, 214), (230, 150, 70), (112, 178, 110)])


def walls(box):
    """Outer walls, floor, ceiling, and two inner walls with a door each."""
    pieces = [
        box([LENGTH, DEPTH, WALL], [0, 0, -WALL / 2]),
        box([LENGTH, DEPTH, WALL], [0, 0, HEIGHT + WALL / 2]),
    ]
    for side in (-1, 1):
        pieces.append(box([LENGTH, WALL, HEIGHT], [0, side * DEPTH / 2, HEIGHT / 2]))
        pieces.append(box([WALL, DEPTH, HEIGHT], [side * LENGTH / 2, 0, HEIGHT / 2]))
    for x, y in ((-2.0, 0.6), (1.9, -0.4)):  # the middles of the doors
        for low, high in ((-DEPTH / 2, y - DOOR / 2), (y + DOOR / 2, DEPTH / 2)):
            pieces.append(box([WALL, high - low, HEIGHT], [x, (low + high) / 2, HEIGHT / 2]))
        pieces.append(box([WALL, DOOR, 0.5], [x, y, HEIGHT - 0.25]))
    return pieces


def furniture(box, random):
    for room in (-3.7, 0.0, 3.7):
        for _ in range(7):
            size = random.uniform([0.3, 0.3, 0.4], [1.6, 0.9, 1.9])
            turn = random.choice([0, np.pi / 2, random.uniform(0, np.pi)])
            place = [room + random.uniform(-1.2, 1.2), random.uniform(-2.3, 2.3), size[2] / 2]
            if min(np.hypot(place[0] - x, place[1] - y) for x, y, *_ in STATIONS) > 1.1:
                yield box(size, place, turn)


def panorama(mesh, pose, random, noise=0.003):
    """A scan of the scanner on its tripod, 0.25 degrees between rays."""
    from domain_scenes import cast

    elevation, azimuth = np.meshgrid(
        np.radians(np.arange(-60, 85, 0.25)), np.radians(np.arange(0, 360, 0.25)), indexing="ij"
    )
    level = np.cos(elevation)
    rays = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)], -1)
    rays = rays.reshape(-1, 3)
    ranges, cosines = cast(mesh, pose[:3, 3], rays @ pose[:3, :3].T)
    seen = np.isfinite(ranges) & (cosines > 0.05)
    return rays[seen] * (ranges[seen] + random.normal(0, noise, seen.sum()))[:, None]


def write(path):
    sys.path.append(str(ROOT / "bench/accuracy"))
    import domain_scenes as scenes
    import pye57
    import trimesh

    random = np.random.default_rng(SEED)
    mesh = trimesh.util.concatenate([*walls(scenes.box), *furniture(scenes.box, random)])
    with pye57.E57(str(path), mode="w") as file:
        for k, (x, y, z, heading) in enumerate(STATIONS):
            pose = scenes.translation(x, y, z) @ scenes.rotation_about([0, 0, 1], heading)
            points = panorama(mesh, pose, random)
            data = {f"cartesian{axis}": points[:, i].copy() for i, axis in enumerate("XYZ")}
            # As a scanner leaves them: every station in a frame of its own.
            file.write_scan_raw(
                data,
                name=f"Station {k + 1}",
                rotation=np.array([1.0, 0, 0, 0]),
                translation=np.zeros(3),
            )


def draw(project, made):
    import gpureg

    poses = render.numbered_poses(made / "poses.txt")
    scans = [gpureg.read_point_cloud(project, k + 1).points for k in range(len(STATIONS))]
    alone, whole = render.View(-62, 50, 15), render.View(-62, 50, 40)
    parts = []
    for k, points in enumerate(scans):
        normals, _ = render.normals_of(points, np.zeros((1, 3)))
        parts.append((points, normals, np.broadcast_to(COLOURS[k], points.shape)))
    # The scanner stands upright: the map has the frame of the first station, turned to the walls.
    turn = np.eye(4)
    c, s = np.cos(STATIONS[0][3]), np.sin(STATIONS[0][3])
    turn[:2, :2] = [[c, -s], [s, c]]
    together = []
    for number, (points, normals, colours) in enumerate(parts):
        pose = turn @ poses[sorted(poses)[number]]
        together.append((points @ pose[:3, :3].T + pose[:3, 3], normals @ pose[:3, :3].T, colours))

    def picture(view, points, normals, colours, size):
        roofless = points[:, 2] < points[:, 2].max() - 0.2
        points, normals, colours = points[roofless], normals[roofless], colours[roofless]
        low, high = view.extent(points)
        return render.draw(view, points, normals, colours, size, (low + high) / 2)

    page = Image.new("RGB", (980, 350), render.BACKGROUND)
    pen = ImageDraw.Draw(page)
    for k, part in enumerate(parts):
        page.paste(picture(alone, *part, (300, 112)), (10, 4 + 114 * k))
        pen.text((14, 8 + 114 * k), f"Station {k + 1}", fill=render.INK, font=render.font(12, True))
    page.paste(picture(whole, *map(np.concatenate, zip(*together)), (650, 340)), (320, 4))
    page.quantize(128).save(ROOT / "docs/images/stations.png", optimize=True)


if __name__ == "__main__":
    words = sys.argv[1:]
    if words[:1] == ["write"] and len(words) == 2:
        write(pathlib.Path(words[1]))
    elif words[:1] == ["draw"] and len(words) == 3:
        draw(*map(pathlib.Path, words[1:]))
    else:
        sys.exit(__doc__)
