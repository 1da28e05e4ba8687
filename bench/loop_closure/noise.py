#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Odometry of independent noise without covariances: is the map better than odometry alone?

    bench/loop_closure/noise.py BUILD_FOLDER --data DATA [--results FOLDER] [--seeds 3] [-o record.json]

Noise of each step: 1 % of its length and 0.3 degrees, or 3 % and 1 degree (RMS). The pairs of every scene are registered once
(`gpureg batch`): of each fragment the six earlier ones that overlap most by the truth, in view of what odometry does not know, and one
that does not overlap. --results names a folder that keeps scenes and results.
"""

import argparse
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

import run

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
from rows import dumps

# The constants of src/loop_closure/noise.cpp were chosen on these.
CHOSEN_ON = ("house_A", "house_B", "hospital_E", "house_9101")
GIVEN = {"house_A": "house/A", "house_B": "house/B", "hospital_E": "hospital/E"}
# By `gpureg generate`, arguments.
GENERATED = {
    "house_9101": ("--fragments", "40", "--seed", "9101"),
    "house_9103": ("--fragments", "40", "--seed", "9103"),
    "house_9104": ("--fragments", "40", "--seed", "9104"),
    "office_9102": ("--fragments", "40", "--seed", "9102", "--building", "office"),
}
PROPOSED, FOREIGN = 6, 1  # pairs of a fragment with earlier ones
OVERLAP = 0.2
STEP, LOOP = 0.016, 0.03  # metres: standard deviations of a step and of a loop


def folder_of(build, scene, data, results):
    if scene in GIVEN:
        return data / GIVEN[scene]
    folder = results / "scenes" / scene
    if not (folder / "gt_overlap.txt").exists():
        command = [build / "bin/gpureg", "generate", folder, *GENERATED[scene], "--quiet"]
        subprocess.run(list(map(str, command)), check=True)
    return folder


def pairs_of(folder):
    overlap = {}
    for line in (folder / "gt_overlap.txt").read_text().splitlines():
        if not line.startswith("#"):
            i, j, largest, _ = line.split()
            overlap[int(i), int(j)] = float(largest)
    draw = random.Random(1)
    lines = []
    for late in range(len(run.poses_of(folder))):
        gains, foreign = [], []
        for early in range(late - 1):
            share = overlap.get((early, late), 0)
            variance = STEP**2 * (late - early)
            if share >= OVERLAP:
                gains.append((-share * math.log1p(variance / LOOP**2), early))
            else:
                foreign.append(early)
        draw.shuffle(foreign)
        chosen = [early for _, early in sorted(gains)[:PROPOSED]] + foreign[:FOREIGN]
        lines += [f"{early} {late}\n" for early in chosen]
    return "".join(lines)


def batch_of(build, scene, folder, results):
    out = results / scene
    if not out.with_suffix(".json").exists():
        out.with_suffix(".pairs").write_text(pairs_of(folder))
        command = [
            build / "bin/gpureg",
            "batch",
            folder,
            "-o",
            f"{out}.log",
            "--info",
            f"{out}.info",
        ]
        command += ["--pairs", f"{out}.pairs", "--json", f"{out}.json", "--quiet"]
        command += ["--voxel-size", "0.05"]
        subprocess.run(list(map(str, command)), check=True)
    return json.loads(out.with_suffix(".json").read_text())


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--results", type=pathlib.Path)
    parser.add_argument("--scenes", nargs="+", default=[*GIVEN, *GENERATED])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        results = arguments.results or pathlib.Path(temporary)
        for scene in arguments.scenes:
            folder = folder_of(arguments.build, scene, arguments.data, results)
            sequence = pathlib.Path(temporary) / f"{scene}.txt"
            run.write_sequence(folder, batch_of(arguments.build, scene, folder, results), sequence)
            program = arguments.build / "bin/gpureg_loop_closure_noise"
            command = [str(program), str(sequence), scene, str(arguments.seeds)]
            output = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
            print(output, end="", flush=True)
            rows += [json.loads(line) for line in output.splitlines()]
    worse = sum(row["rmse"] > 1.05 * row["odometry_rmse"] for row in rows)
    print(f"{worse} of {len(rows)} worse than odometry by more than 5 %", file=sys.stderr)
    if arguments.output:
        record = {
            "program": "bench/loop_closure/noise.py",
            "scenes_used_for_choices": list(CHOSEN_ON),
            "rows": rows,
        }
        arguments.output.write_text(dumps(record) + "\n")


if __name__ == "__main__":
    main()
