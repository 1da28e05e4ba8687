#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Share of the overlapping pairs that pruning keeps against the share of the pairs that it tries.

    PYTHONPATH=python python3 bench/pruning/run.py --data DATA --generated FOLDER... [--shares 2 5 10]

One set is the red kitchen, the houses A and B, hospital E and folders of `gpureg generate` in one folder; the
other is a generated country (python/tests/country.py). Pairs overlap by 30 % or more at the true poses, in
the country by a third of the area. A and B are two walks through one house: two of their scans overlap where
30 % of the points of one have points of the other in the same or a neighbouring cell of --cell. Needs the
Python package.
"""

import pathlib
import sys
import tempfile

import gpureg
import numpy as np
from gpureg import pruning

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[1:1] = [str(ROOT / "bench/accuracy"), str(ROOT / "python/tests")]
from country import make_fragments
from locate import moved, read_points, read_poses
from map_rmse import read_blocks
from record import data_folder, parser, write

SCENES = {
    "kitchen": "redkitchen/fragments",
    "house A": "house/A",
    "house B": "house/B",
    "hospital E": "hospital/E",
}
ONE_HOUSE = ("house A", "house B")
OFFSET = 1000  # between the numbers of two scenes
OVERLAP = 0.3
COUNTRY_VOXEL = 0.12


def cells_of(points, size):
    x, y, z = np.floor(points / size).astype(np.int64).T
    return np.unique(x << 42 ^ y << 21 ^ z)


def across(first, second, size):
    """Pairs of scans of two folders with a common frame that overlap."""

    def scans(folder):
        poses = read_poses(folder / "poses.txt")
        for number, pose in poses.items():
            points = moved(read_points(folder / f"cloud_bin_{number}.ply"), pose)
            steps = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3), -1).reshape(-1, 3) * size
            around = np.unique(np.concatenate([cells_of(points + s, size) for s in steps]))
            yield number, cells_of(points, size), around

    others = list(scans(second))
    for i, cells, around in scans(first):
        for j, others_cells, others_around in others:
            shares = np.isin(cells, others_around).mean(), np.isin(others_cells, around).mean()
            if max(shares) >= OVERLAP:
                yield i, j


def put_together(scenes, folder, cell):
    """Links to all scans in one folder. Returns the overlapping pairs of each scene."""
    cameras, overlapping = [], {}
    for place, (name, source) in enumerate(scenes.items()):
        offset = OFFSET * place
        for cloud in source.glob("cloud_bin_*.ply"):
            number = int(cloud.stem.removeprefix("cloud_bin_")) + offset
            (folder / f"cloud_bin_{number}.ply").symlink_to(cloud.resolve())
        for line in (source / "cameras.txt").read_text().splitlines():
            if line.strip() and not line.startswith("#"):
                number, *rest = line.split()
                cameras.append(" ".join([str(int(number) + offset), *rest]))
        overlapping[name] = [(i + offset, j + offset) for i, j in read_blocks(source / "gt.log", 4)]
    (folder / "cameras.txt").write_text("\n".join(cameras) + "\n")
    a, b = (list(scenes).index(name) for name in ONE_HOUSE)
    overlapping["houses A and B"] = [
        (i + OFFSET * a, j + OFFSET * b)
        for i, j in across(*(scenes[name] for name in ONE_HOUSE), cell)
    ]
    return overlapping


def rows_of(name, fragments, overlapping, shares, options=None):
    """A row for each share. overlapping: pairs of each part of the set."""
    summaries = pruning.summarize_all(fragments, options=options)
    numbers = np.array(fragments.numbers)
    count = len(numbers)
    every = [pair for pairs in overlapping.values() for pair in pairs]
    for share in shares:
        neighbors = max(1, round(share / 100 * (count - 1)))
        chosen = numbers[pruning.likely_pairs(summaries, neighbors)]
        report = pruning.measure(chosen, every, count)
        parts = {
            part: round(100 * pruning.measure(chosen, pairs, count).recall, 1)
            for part, pairs in overlapping.items()
        }
        row = {
            "set": name,
            "scans": count,
            "pairs": report.pairs,
            "overlapping": report.overlapping,
            "neighbors": neighbors,
            "tried": report.tried,
            "tried_percent": round(100 * report.tried / report.pairs, 2),
            "kept_percent": round(100 * report.recall, 1),
            "kept_percent_of": parts if len(parts) > 1 else {},
        }
        print(row, flush=True)
        yield row


def main():
    arguments = parser(__doc__, "pruning.json")
    arguments.add_argument("--generated", type=pathlib.Path, nargs="*", default=[])
    arguments.add_argument("--shares", type=float, nargs="+", default=[2, 5, 10], help="percent")
    arguments.add_argument("--country", type=int, default=2000, help="fragments; 0: none")
    arguments.add_argument("--cell", type=float, default=0.05, help="metres")
    arguments = arguments.parse_args()
    scenes = {name: data_folder(arguments, folder) for name, folder in SCENES.items()}
    scenes |= {folder.name: folder for folder in arguments.generated}
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        overlapping = put_together(scenes, pathlib.Path(folder), arguments.cell)
        fragments = gpureg.FragmentSet.from_directory(folder)
        rows += rows_of("scenes", fragments, overlapping, arguments.shares)
    if arguments.country:
        clouds, pairs = make_fragments(arguments.country, seed=1)
        rows += rows_of(
            "country",
            gpureg.FragmentSet.from_clouds(clouds),
            {"country": pairs},
            arguments.shares,
            gpureg.RegistrationOptions.loopsmart(COUNTRY_VOXEL),
        )
    generated = "".join(f" {folder.name}" for folder in arguments.generated)
    shares = " ".join(f"{share:g}" for share in arguments.shares)
    write(
        arguments,
        f"python3 bench/pruning/run.py --data DATA --generated{generated} --shares {shares}",
        {"rows": rows},
    )


if __name__ == "__main__":
    main()
