#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/images/slam.png: the map of a generated sequence before and after its loops.

    gpureg generate SEQUENCE --fragments 36 --seed 11 --rgbd --depth-noise 3
    slam_demo SEQUENCE --tracking FILE --output BEFORE
    slam_demo SEQUENCE --tracking FILE --output AFTER --image-loops
    bench/pictures/slam.py SEQUENCE BEFORE AFTER [-o FILE]

BEFORE and AFTER share their tracking: the first run writes it and uses no loops. Both maps are put
onto the true trajectory, whose world is z-up. A detail shows where the loops moved the surfels most,
or where --detail says. Needs numpy, scipy, Pillow and matplotlib, whose font it takes.
"""

import argparse
import json
import pathlib

import numpy as np
import render
from PIL import Image, ImageDraw
from scipy.spatial import cKDTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
AZIMUTH, ELEVATION = 210, 52  # degrees
WINDOW = 2.6  # metres that the detail shows
ALONE = 0.06  # metres to the 16th neighbour


def alignment(folder: pathlib.Path, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and translation that put a trajectory onto the true one."""
    estimate = np.loadtxt(folder / "trajectory.txt")
    place = np.searchsorted(truth[:, 0], estimate[:, 0] - 1e-4)
    a, b = estimate[:, 1:4], truth[place, 1:4]
    u, _, v = np.linalg.svd((a - a.mean(0)).T @ (b - b.mean(0)))
    sign = np.diag([1, 1, np.sign(np.linalg.det(v.T @ u.T))])
    rotation = v.T @ sign @ u.T
    return rotation, b.mean(0) - rotation @ a.mean(0)


class Map:
    """Surfels in the world of the truth, and the figures of the run."""

    def __init__(self, folder: pathlib.Path, truth: np.ndarray) -> None:
        surfels = render.read_ply(folder / "map.ply")
        points = render.columns(surfels, "x y z")
        alone = cKDTree(points).query(points, 16)[0][:, -1] > ALONE
        surfels = surfels[~alone]
        rotation, shift = alignment(folder, truth)
        self.points = render.columns(surfels, "x y z") @ rotation.T + shift
        self.normals = render.columns(surfels, "nx ny nz") @ rotation.T
        self.colours = 255 * (render.columns(surfels, "red green blue") / 255) ** 0.75  # brighter
        self.kept = ~alone
        self.figures = json.loads((folder / "loops.json").read_text())

    def draw(self, view, size, centre, radius) -> Image.Image:
        return render.draw(view, self.points, self.normals, self.colours, size, centre, radius)


def most_moved(before: Map, after: Map) -> np.ndarray:
    """Middle of the cell of furniture that the loops moved most; maps of different surfels: None."""
    if len(before.kept) != len(after.kept):
        return None
    both = before.kept & after.kept
    moved = np.linalg.norm(
        after.points[both[after.kept]] - before.points[both[before.kept]], axis=1
    )
    after = after.points[both[after.kept]]
    shown = (after[:, 2] > 0.3) & (after[:, 2] < 1.5)
    cells = np.floor(after[shown, :2] / (WINDOW / 2)).astype(int)
    keys, index, count = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    mean = np.bincount(index.ravel(), moved[shown]) / count
    best = np.where(count > 0.3 * count.max(), mean, 0).argmax()
    return np.append((keys[best] + 0.5) * WINDOW / 2, 0.8)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name in ("sequence", "before", "after"):
        parser.add_argument(name, type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "docs/images/slam.png")
    parser.add_argument("--detail", type=float, nargs=3, help="centre of the detail, true x y z")
    parser.add_argument("--azimuth", type=float, default=AZIMUTH)
    arguments = parser.parse_args()
    truth = np.loadtxt(arguments.sequence / "groundtruth.txt")
    maps = [Map(folder, truth) for folder in (arguments.before, arguments.after)]
    detail = arguments.detail or most_moved(*maps)

    size, top, gap = (760, 560), 56, 24
    below = 0 if detail is None else 400
    page = Image.new("RGB", (2 * size[0] + gap, top + size[1] + below), render.BACKGROUND)
    view = render.View(arguments.azimuth, ELEVATION, 1)
    seen = maps[1].points[render.faces_viewer(view, maps[1].normals)]
    low, high = view.extent(seen)
    view.scale = 0.97 * min(np.array(size) / (high - low))
    low, high = view.extent(seen)
    close = render.View(arguments.azimuth, ELEVATION, size[0] / WINDOW / 1.6)
    for column, (part, title) in enumerate(zip(maps, ("by tracking alone", "with loops"))):
        left = column * (size[0] + gap)
        page.paste(part.draw(view, size, (low + high) / 2, 0.014), (left, top))
        ate = part.figures["ate"]
        text = f"{title}: {ate['poses']:,} of {part.figures['frames']:,} frames, error {100 * ate['rmse_m']:.1f} cm"
        render.write(page, (left + 14, 16), text, 24, bold=True)
        if detail is not None:
            middle = close.project(np.array([detail]))[0, :2]
            crop = part.draw(close, (size[0], below), middle, 0.012)
            page.paste(crop, (left, top + size[1]))
            frame = [left + 2, top + size[1] + 2, left + size[0] - 3, top + size[1] + below - 3]
            ImageDraw.Draw(page).rectangle(frame, outline=render.GREY)
    arguments.output.parent.mkdir(exist_ok=True)
    page.quantize(200, dither=Image.Dither.NONE).save(arguments.output, optimize=True)


if __name__ == "__main__":
    main()
