#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Trajectory and surface errors of slam_demo without loops, and with each kind of loop.

    bench/slam/run.py PROGRAM SEQUENCE... --work FOLDER -o record.json [--name NAME...]
                      [--seeds N] [--evo EVO_APE] [--options NAME=OPTIONS...]

Each sequence is tracked once; the rows share what tracking found (`slam_demo --tracking`), but for
those in one run, where tracking has the depth calibration of the adjustments, and "beside
tracking", the same without --sequential. The registration of the last sequence runs with N seeds. With --evo the absolute errors are compared
with those of PyPI's evo, which runs as a program. Sequences and rows that are in the record already
and not named stay there.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import re
import shlex
import statistics
import subprocess
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))
from rows import dumps

ROWS = {
    "odometry": None,  # the run that tracks: no loop of any kind
    "+ image loops": ["--image-loops", "--no-dense-loops", "--no-bundle"],
    "+ dense loops": ["--image-loops", "--no-bundle"],
    "+ bundle adjustment": ["--image-loops"],
    "without image loops": [],
    "in one run": [],
    "in one run, LoopSmart": ["--loopsmart"],
    "beside tracking": [],
}
IN_ONE_RUN = ("in one run", "in one run, LoopSmart", "beside tracking")
SEEDED = ("+ dense loops", "+ bundle adjustment", "without image loops", "in one run")
# A loop is false where it is this far from the truth: Redwood's bound of a correct pair, and what a
# fragment of 2 m makes of it as an angle.
FALSE_METRES, FALSE_DEGREES = 0.2, 6.0


def run_demo(program: str, sequence: str, output: Path, options: list) -> dict:
    command = [program, sequence, "--quiet", "--output", str(output)]
    subprocess.run([*command, *options], check=True)
    return json.loads((output / "loops.json").read_text())


def path_of(truth: Path) -> float | None:
    """Length of the true trajectory, metres."""
    if not truth.exists():
        return None
    lines = [line.split() for line in truth.read_text().splitlines() if not line.startswith("#")]
    places = [[float(word) for word in words[1:4]] for words in lines]
    return sum(math.dist(a, b) for a, b in itertools.pairwise(places))


def is_false(loop: dict) -> bool:
    error = loop["error"]
    return error["translation_m"] > FALSE_METRES or error["rotation_degrees"] > FALSE_DEGREES


def correlation(truth: Path, found: Path) -> float | None:
    """Of the true offsets of inverse depth and those that were found."""
    if not truth.exists():
        return None
    files = [json.loads(path.read_text()) for path in (truth, found)]
    return statistics.correlation(*(file["inverse_depth_offsets"] for file in files))


def row_of(name: str, seed: int, figures: dict) -> dict:
    accepted = [loop for loop in figures["loops"] if loop["state"] == "accepted"]
    images = [loop for loop in figures["image_loops"] if loop["state"] == "accepted"]
    surface = figures["surface"]
    return {
        "row": name,
        "seed": seed,
        "poses": figures["ate"]["poses"],
        "ate_m": figures["ate"]["rmse_m"],
        "odometry_ate_m": figures["ate_odometry"]["rmse_m"],  # over the same frames
        "surface_mean_m": surface and surface["mean_m"],
        "surface_median_m": surface and surface["median_m"],
        "dense_loops": len(accepted),
        "false_dense_loops": sum(map(is_false, accepted)),
        "image_loops": len(images),
        "false_image_loops": sum(map(is_false, images)),
        "keyframes_per_point": figures["keyframes_per_point"],
        "longest_wait_ms": figures["waits_for_loops"]["longest_ms"],
        "seconds": figures["seconds"],
    }


def evo_difference(evo: str, truth: Path, output: Path, ours: float) -> float:
    """evo's RMSE after a rigid alignment minus ours, metres."""
    command = [evo, "tum", str(truth), str(output / "trajectory.txt"), "-a", "--t_max_diff", "0.01"]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return float(re.search(r"rmse\s+([0-9.e+-]+)", text)[1]) - ours


def measure(args, sequence: str, name: str, seeds: int) -> dict:
    work = Path(args.work) / name
    work.mkdir(parents=True, exist_ok=True)
    tracking = work / "tracking"
    own = shlex.split(args.options.get(name, ""))
    shared = ["--sequential", "--tracking", str(tracking)]
    tracked = None
    if not tracking.exists() and not set(args.rows) <= set(IN_ONE_RUN):
        run_demo(args.program, sequence, work / "tracked", [*own, *shared])
    if tracking.exists():
        tracked = json.loads((work / "tracked/loops.json").read_text())
    rows = []
    for row in args.rows:
        options = ROWS[row]
        for seed in range(1, (seeds if row in SEEDED else 1) + 1):
            output = work / f"{list(ROWS).index(row)}_{seed}"
            if options is None:
                output, figures = work / "tracked", tracked
            else:
                more = ["--sequential"] if row in IN_ONE_RUN else shared
                if row == "beside tracking":
                    more = []
                figures = run_demo(
                    args.program, sequence, output, [*own, *options, *more, "--seed", str(seed)]
                )
                tracked = tracked or figures
            rows.append(row_of(row, seed, figures))
            rows[-1]["calibration_correlation"] = correlation(
                Path(sequence) / "true_depth_calibration.json", output / "depth_calibration.json"
            )
            truth = Path(sequence) / "groundtruth.txt"
            if args.evo and truth.exists():
                difference = evo_difference(args.evo, truth, output, rows[-1]["ate_m"])
                rows[-1]["evo_difference_m"] = difference
            print(name, json.dumps(rows[-1]), flush=True)
    return {
        "name": name,
        "frames": tracked["frames_done"],
        "frames_lost": tracked["frames_lost"],
        "frames_by_all_pixels": tracked["frames_tracked_densely"],
        "worlds": tracked["worlds"],
        "keyframes": tracked["keyframes"],
        "path_m": path_of(Path(sequence) / "groundtruth.txt"),
        "generated_by": args.generated.get(name),
        "options": args.options.get(name),
        "tracking_seconds": tracked["seconds"],
        "rows": rows,
    }


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program")
    parser.add_argument("sequences", nargs="+")
    parser.add_argument("--work", required=True, help="folder of the runs")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--name", nargs="*", help="of the sequences; otherwise their folders'")
    parser.add_argument(
        "--generated", nargs="*", default=[], help="NAME=OPTIONS of gpureg generate"
    )
    parser.add_argument("--options", nargs="*", default=[], help="NAME=OPTIONS of slam_demo")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--rows", nargs="*", default=list(ROWS), choices=list(ROWS))
    parser.add_argument("--evo", help="evo_ape of PyPI's evo")
    args = parser.parse_args()
    args.generated = dict(item.split("=", 1) for item in args.generated)
    args.options = dict(item.split("=", 1) for item in args.options)
    names = args.name or [Path(s).name for s in args.sequences]
    path = Path(args.output)
    record = json.loads(path.read_text()) if path.exists() else {"sequences": []}
    for place, (sequence, name) in enumerate(zip(args.sequences, names, strict=True)):
        last = place == len(names) - 1
        result = measure(args, sequence, name, args.seeds if last else 1)
        for old in record["sequences"]:
            if old["name"] == name:
                old_rows = [row for row in old["rows"] if row["row"] not in args.rows]
                result["rows"] = old_rows + result["rows"]
                result["rows"].sort(key=lambda row: (list(ROWS).index(row["row"]), row["seed"]))
        kept = [s for s in record["sequences"] if s["name"] != name]
        record = {"program": "bench/slam/run.py", "sequences": [*kept, result]}
        path.write_text(dumps(record) + "\n")


if __name__ == "__main__":
    main()
