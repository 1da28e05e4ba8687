#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/images/building.png and docs/images/building.webp: scans, and the map made of them.

    gpureg generate scans --fragments 48 --seed 11
    gpureg reconstruct scans -o map
    bench/pictures/building.py scans map

Every scan has a colour. The poses are those of the map, not the truth. Needs numpy, scipy, Pillow
and matplotlib, whose font it takes.
"""

import argparse
import json
import pathlib

import numpy as np
import render
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]
AZIMUTH, ELEVATION = -60, 52  # degrees


def cameras(path: pathlib.Path) -> dict[int, np.ndarray]:
    """Sensor positions of each fragment, in its frame."""
    found: dict[int, list] = {}
    for line in path.read_text().splitlines():
        if line.strip() and not line.startswith("#"):
            words = line.split()
            found.setdefault(int(words[0]), []).append([float(word) for word in words[2:5]])
    return {number: np.array(places) for number, places in found.items()}


class Scan:
    ALONE = 0.08  # metres to the 16th neighbour

    def __init__(self, folder: pathlib.Path, number: int, sensors: np.ndarray) -> None:
        self.number = number
        vertices = render.read_ply(folder / f"cloud_bin_{number}.ply")
        points = render.columns(vertices, "x y z")
        normals, spacing = render.normals_of(points, sensors)
        alone = spacing > self.ALONE
        self.points, self.normals = points[~alone], normals[~alone]

    def placed(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.points @ pose[:3, :3].T + pose[:3, 3], self.normals @ pose[:3, :3].T


def upright(poses: dict[int, np.ndarray], scans: list[Scan]) -> np.ndarray:
    """Turns the frame of the map so that its floor is level and its walls are along the axes."""
    normals = np.concatenate([s.placed(poses[s.number])[1][::20] for s in scans])
    # The floor: most normals point up; cameras look down a little, so up is -y of the scans on average.
    up = np.mean([-poses[s.number][:3, 1] for s in scans], 0)
    for _ in range(20):
        near = normals[normals @ up > 0.95 * np.linalg.norm(up)]
        up = near.mean(0) / np.linalg.norm(near.mean(0))
    level = normals[abs(normals @ up) < 0.1]
    first = level[0] - up * (level[0] @ up)
    first /= np.linalg.norm(first)
    second = np.cross(up, first)
    angles = np.arctan2(level @ second, level @ first)
    heading = np.angle(np.exp(4j * angles).mean()) / 4
    first, second = (
        first * np.cos(heading) + second * np.sin(heading),
        second * np.cos(heading) - first * np.sin(heading),
    )
    turn = np.eye(4)
    turn[:3, :3] = np.stack([first, second, up])
    return turn


def thumbnails(
    scans: list[Scan], colours: np.ndarray, columns: int, size: tuple[int, int]
) -> Image.Image:
    """Every scan in its own frame, as its camera saw it from above."""
    rows = -(-len(scans) // columns)
    cell = (size[0] // columns, size[1] // rows)
    sheet = Image.new("RGB", size, render.BACKGROUND)
    for k, scan in enumerate(scans):
        # x right, y down, z forward becomes x right, y forward, z up.
        turn = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
        points, normals = scan.points @ turn.T, scan.normals @ turn.T
        view = render.View(-75, 30, 1)
        low, high = view.extent(points)
        view.scale = 0.86 * min(np.array(cell) / (high - low))
        low, high = view.extent(points)
        paint = np.repeat(colours[k : k + 1], len(points), 0)
        image = render.draw(view, points, normals, paint, cell, (low + high) / 2, 0.03, cull=False)
        sheet.paste(image, (k % columns * cell[0], k // columns * cell[1]))
    return sheet


class Building:
    """The placed scans; of a place that several scans saw, the first one's points."""

    CELL = 0.06  # metres

    def __init__(self, scans: list[Scan], poses: dict[int, np.ndarray], colours: np.ndarray):
        taken: set[int] = set()
        parts = []
        for scan in scans:
            points, normals = scan.placed(poses[scan.number])
            cells = np.floor(points / self.CELL).astype(np.int64) + (1 << 19)
            keys = (cells[:, 0] << 40) | (cells[:, 1] << 20) | cells[:, 2]
            kept = np.fromiter((key not in taken for key in keys.tolist()), bool, len(keys))
            taken.update(keys.tolist())
            parts.append((points[kept], normals[kept]))
        self.points, self.normals = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
        self.scan = np.repeat(np.arange(len(scans)), [len(part[0]) for part in parts])
        self.colours = colours

    def draw(self, view, size, centre, count=None) -> Image.Image:
        shown = slice(None) if count is None else self.scan < count
        paint = self.colours[self.scan[shown]]
        return render.draw(
            view, self.points[shown], self.normals[shown], paint, size, centre, 0.017
        )


def fitted(building, size) -> tuple[render.View, np.ndarray]:
    """A view in which all that faces the viewer fills the size."""
    view = render.View(AZIMUTH, ELEVATION, 1)
    points = building.points[render.faces_viewer(view, building.normals)]
    low, high = view.extent(points)
    view.scale = 0.98 * min(np.array(size) / (high - low))
    low, high = view.extent(points)
    return view, (low + high) / 2


def still(every: list[Scan], placed: list[Scan], building: Building) -> Image.Image:
    width, height, top, left = 1560, 860, 70, 640
    page = Image.new("RGB", (width, height), render.BACKGROUND)
    colours = np.full((len(every), 3), 205.0)
    for scan, colour in zip(placed, building.colours, strict=True):
        colours[every.index(scan)] = colour
    page.paste(thumbnails(every, colours, 6, (left, height - top)), (16, top))
    size = (width - left - 70, height - top - 20)
    view, centre = fitted(building, size)
    page.paste(building.draw(view, size, centre), (left + 50, top))
    render.write(page, (24, 20), f"{len(every)} scans, poses unknown", 28, bold=True)
    text = "the map"
    if len(placed) < len(every):
        text += f" of {len(placed)} of them; grey: left out"
    render.write(page, (left + 60, 20), text, 28, bold=True)
    return page


def order_of(edges: list, numbers: list[int]) -> list[int]:
    """From the best connected scan on, always the neighbour with the strongest edge."""
    links: dict[int, dict[int, float]] = {number: {} for number in numbers}
    for a, b, weight in edges:
        if a not in links or b not in links:
            continue
        links[a][b] = links[b][a] = max(weight, links[a].get(b, 0))
    order = [max(numbers, key=lambda n: sum(links[n].values()))]
    while len(order) < len(numbers):
        reachable = [(w, n) for placed in order for n, w in links[placed].items() if n not in order]
        rest = [number for number in numbers if number not in order]
        order.append(max(reachable)[1] if reachable else rest[0])
    return order


def film(building: Building, count: int, path: pathlib.Path) -> None:
    """The scans appear one after the other."""
    size = (720, 560)
    view, centre = fitted(building, size)
    images = []
    for shown in range(1, count + 1):
        image = building.draw(view, size, centre, shown)
        render.write(image, (16, 14), f"{shown} of {count} scans", 20, bold=True)
        images.append(image)
    times = [140] * (count - 1) + [3000]
    images[0].save(
        path, save_all=True, append_images=images[1:], duration=times, loop=0, quality=70, method=6
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scans", type=pathlib.Path)
    parser.add_argument("map", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "docs/images")
    parser.add_argument("--no-film", action="store_true")
    arguments = parser.parse_args()
    document = json.loads((arguments.map / "reconstruction.json").read_text())
    island = document["islands"][0]
    poses = render.numbered_poses(arguments.map / "poses.txt")
    places = cameras(arguments.scans / "cameras.txt")
    every = {number: Scan(arguments.scans, number, places[number]) for number in sorted(places)}
    edges = [
        (edge["i"], edge["j"], edge["confidence"])
        for edge in document["edges"]
        if edge["state"] == "accepted"
    ]
    placed = [every[number] for number in order_of(edges, island)]
    turn = upright(poses, placed)
    poses = {number: turn @ pose for number, pose in poses.items()}
    building = Building(placed, poses, render.palette(len(placed)))
    picture = still(list(every.values()), placed, building)
    picture.quantize(200, dither=Image.Dither.NONE).save(
        arguments.output / "building.png", optimize=True
    )
    if not arguments.no_film:
        film(building, len(placed), arguments.output / "building.webp")


if __name__ == "__main__":
    main()
