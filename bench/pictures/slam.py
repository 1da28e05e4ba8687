#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/images/slam.png: the map of a generated sequence before and after its loops.

    bench/pictures/slam.py SEQUENCE BEFORE AFTER [-o FILE]

BEFORE and AFTER are two outputs of slam_demo that share their tracking (--tracking): the first
without loops, the second with them. Where their surfels are the same, a detail shows where the loops
moved most. Where loops joined worlds they are not: then --detail says what to enlarge, if anything."""

import argparse
import json
import pathlib

import matplotlib
import numpy

matplotlib.use("Agg")
from matplotlib import pyplot

ROOT = pathlib.Path(__file__).resolve().parents[2]
LOW, HIGH = 0.5, 1.9  # metres over the floor: neither floor nor ceiling
WINDOW = 3.0  # metres that the detail shows
SURFEL = numpy.dtype(
    [(name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz", "radius", "confidence")]
    + [(name, "u1") for name in ("red", "green", "blue")]
)


def surfels_of(folder):
    data = (folder / "map.ply").read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    surfels = numpy.frombuffer(data[end:], SURFEL)
    points = numpy.stack([surfels[axis] for axis in "xyz"], 1).astype(float)
    return points, numpy.stack([surfels[c] for c in ("red", "green", "blue")], 1) / 255


def alignment(folder, truth):
    """Rotation and translation that put a trajectory onto the true one, whose world is z-up."""
    estimate = numpy.loadtxt(folder / "trajectory.txt")
    place = numpy.searchsorted(truth[:, 0], estimate[:, 0] - 1e-4)
    a, b = estimate[:, 1:4], truth[place, 1:4]
    u, _, v = numpy.linalg.svd((a - a.mean(0)).T @ (b - b.mean(0)))
    sign = numpy.diag([1, 1, numpy.sign(numpy.linalg.det(v.T @ u.T))])
    rotation = v.T @ sign @ u.T
    return rotation, b.mean(0) - rotation @ a.mean(0)


def draw(axes, points, colours, window, size):
    shown = (points[:, 2] > LOW) & (points[:, 2] < HIGH)
    for axis in (0, 1):
        shown &= (points[:, axis] > window[axis][0]) & (points[:, axis] < window[axis][1])
    order = numpy.argsort(points[shown, 2])
    axes.scatter(
        *points[shown][order, :2].T, s=size, c=colours[shown][order], marker="s", linewidths=0
    )
    axes.set_xlim(window[0])
    axes.set_ylim(window[1])
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])


def most_moved(before, after):
    """The square in which the loops moved most of the wall slice against the truth."""
    moved = numpy.linalg.norm(after - before, axis=1)
    shown = (after[:, 2] > LOW) & (after[:, 2] < HIGH)
    low = after[shown, :2].min(0)
    cells = ((after[shown, :2] - low) / (WINDOW / 2)).astype(int)
    total = numpy.zeros(cells.max(0) + 1)
    count = numpy.zeros_like(total)
    numpy.add.at(total, tuple(cells.T), moved[shown])
    numpy.add.at(count, tuple(cells.T), 1)
    mean = numpy.where(count > 0.3 * count.max(), total / numpy.maximum(count, 1), 0)
    centre = low + (numpy.array(numpy.unravel_index(mean.argmax(), mean.shape)) + 0.5) * WINDOW / 2
    return [(c - WINDOW / 2, c + WINDOW / 2) for c in centre]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name in ("sequence", "before", "after"):
        parser.add_argument(name, type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "docs/images/slam.png")
    parser.add_argument("--detail", type=float, nargs=2, help="centre of the detail, true x and y")
    args = parser.parse_args()
    truth = numpy.loadtxt(args.sequence / "groundtruth.txt")
    maps = []
    for folder in (args.before, args.after):
        points, colours = surfels_of(folder)
        rotation, shift = alignment(folder, truth)
        figures = json.loads((folder / "loops.json").read_text())
        maps.append((points @ rotation.T + shift, colours, figures))
    after = maps[1][0]
    whole = [(after[:, axis].min() - 0.2, after[:, axis].max() + 0.2) for axis in (0, 1)]
    if args.detail:
        detail = [(c - WINDOW / 2, c + WINDOW / 2) for c in args.detail]
    elif len(maps[0][0]) == len(after):
        detail = most_moved(maps[0][0], after)
    else:
        detail = None
    rows = 2 if detail else 1
    height = (whole[1][1] - whole[1][0]) / (whole[0][1] - whole[0][0])
    figure, axes = pyplot.subplots(
        rows, 2, figsize=(9, 4.5 * height + 0.5 + 4.2 * (rows - 1)), dpi=90, squeeze=False
    )
    titles = ("by tracking alone", "with loops")
    for column, ((points, colours, figures), title) in enumerate(zip(maps, titles, strict=True)):
        draw(axes[0][column], points, colours, whole, 0.5)
        ate = figures["ate"]
        axes[0][column].set_title(
            f"{title}: {ate['poses']:,} of {figures['frames']:,} frames, ATE {100 * ate['rmse_m']:.1f} cm",
            fontsize=10,
        )
        if detail:
            draw(axes[1][column], points, colours, detail, 1.0)
            corner = [low for low, _ in detail]
            axes[0][column].add_patch(
                pyplot.Rectangle(corner, WINDOW, WINDOW, fill=False, edgecolor="red", linewidth=1.2)
            )
    figure.tight_layout()
    args.output.parent.mkdir(exist_ok=True)
    figure.savefig(args.output, pil_kwargs={"optimize": True})
    print(f"{args.output}: {args.output.stat().st_size / 1024:.0f} KiB")


main()
