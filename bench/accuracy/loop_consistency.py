#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Gain of loop consistency over the confidences of single pairs: `gpureg consistency` on results of
all pairs of a scene.

A run is SCENE_FOLDER=RESULT.json: the JSON of `gpureg batch` on a scene whose folder has gt.log and
gt.info, perhaps gt_all.log and gt_all.info. The record has `gpureg evaluate`'s geometric figures
before and after, the expected calibration error and how many of the reports above 0.9 are correct.
SCENE_FOLDER is relative to the data's folder. Where it has poses.txt, the record also has how often
loops of three reported poses close (within twice the default tolerances), by whether all three are
correct: LoopConsistencyOptions' chance and miss.

usage: loop_consistency.py RUN... [--data DIR] [-o FILE]
Needs numpy."""

import itertools
import json
import pathlib
import tempfile

import numpy as np
import record

MIN_CONFIDENCE = 0.3  # of a pose that takes part in the loops that are counted
# Degrees and metres within which a loop closes: twice the default tolerances.
ANGLE, DISTANCE = 6.0, 0.3
CORRECT = 1.4  # times these: bound of the error of a correct pose, a little more than of a loop
AHEAD = np.array([0, 0, 2.0, 1])  # point whose shift counts: two metres before the first camera
CALIBRATION_BINS = 10
SURE = 0.9  # a confidence of little risk

parser = record.parser(__doc__, "loop_consistency.json")
parser.add_argument("runs", nargs="+", metavar="RUN")
arguments = parser.parse_args()


def figures(folder, result, temporary):
    file = temporary / "scores.json"
    record.gpureg(arguments, "evaluate", result, "--ground-truth", folder, "--json", file)
    scene = json.loads(file.read_text())["scenes"][0]
    # Without gt_all.log the strict rule is the only one.
    rule = "geometric" if "geometric" in scene else "strict"
    score = scene[rule]
    pairs = [(pair["confidence"] or 0.0, pair[rule]) for pair in scene["pairs"] if pair["tried"]]
    error = 0.0
    for k in range(CALIBRATION_BINS):
        inside = [
            (c, right)
            for c, right in pairs
            if min(int(CALIBRATION_BINS * c), CALIBRATION_BINS - 1) == k
        ]
        error += abs(sum(c for c, _ in inside) - sum(right for _, right in inside)) / len(pairs)
    sure = [right for c, right in pairs if c > SURE]
    return {
        "rule": rule,
        "raw_recall": 100 * score["raw_recall"],
        "R@P95": 100 * score["recall_at_precision"]["95"],
        "R@P99": 100 * score["recall_at_precision"]["99"],
        "AP": 100 * score["average_precision"],
        "calibration_error": error,
        "above_0.9": len(sure),
        "right_above_0.9": 100 * sum(sure) / len(sure) if sure else None,
    }


def off(motion):
    """Degrees and metres by which a motion that should be none moves the point ahead."""
    return np.degrees(
        np.arccos(np.clip((np.trace(motion[:3, :3]) - 1) / 2, -1, 1))
    ), np.linalg.norm((motion @ AHEAD - AHEAD)[:3])


def closing(folder, result):
    """[loops, how many close] of loops whose poses are all correct, and of the others."""
    path = folder / "poses.txt"
    if not path.exists():
        return None
    rows = [line.split() for line in path.read_text().splitlines()]
    world = {int(rows[k][0]): np.array(rows[k + 1 : k + 5], float) for k in range(0, len(rows), 5)}
    poses, correct = {}, {}
    for pair in json.loads(pathlib.Path(result).read_text())["pairs"]:
        if (pair["confidence"] or 0.0) > MIN_CONFIDENCE:
            key = pair["i"], pair["j"]
            poses[key] = np.array(pair["T_ij"], float).reshape(4, 4)
            turn, shift = off(poses[key] @ np.linalg.inv(world[key[1]]) @ world[key[0]])
            correct[key] = turn < CORRECT * ANGLE and shift < CORRECT * DISTANCE
    counts = {True: [0, 0], False: [0, 0]}
    for a, b, c in itertools.combinations(sorted({k for key in poses for k in key}), 3):
        if not {(a, b), (b, c), (a, c)} <= poses.keys():
            continue
        turn, shift = off(poses[a, b] @ poses[b, c] @ np.linalg.inv(poses[a, c]))
        count = counts[correct[a, b] and correct[b, c] and correct[a, c]]
        count[0] += 1
        count[1] += int(turn < ANGLE and shift < DISTANCE)
    return {"right": counts[True], "wrong": counts[False]}


def text(f):
    right = "none" if f["right_above_0.9"] is None else f"{f['right_above_0.9']:.1f} %"
    return (
        f"raw {f['raw_recall']:.1f}, R@P95 {f['R@P95']:.1f}, R@P99 {f['R@P99']:.1f}, AP {f['AP']:.1f}, calibration error "
        f"{f['calibration_error']:.3f}, {f['above_0.9']} above 0.9: {right} right"
    )


scenes = []
with tempfile.TemporaryDirectory() as temporary:
    temporary = pathlib.Path(temporary)
    for run in arguments.runs:
        name, result = run.split("=")
        folder = record.data_folder(arguments, name)
        consistent = temporary / "consistent.json"
        record.gpureg(arguments, "consistency", result, "--json", consistent)
        before, after = figures(folder, result, temporary), figures(folder, consistent, temporary)
        scenes.append(
            {
                "scene": name,
                "loops": closing(folder, result),
                "options": json.loads(pathlib.Path(result).read_text())["options"],
                "before": before,
                "after": after,
            }
        )
        print(f"{name}\n  alone             {text(before)}\n  loop consistency  {text(after)}")
record.write(
    arguments,
    "bench/accuracy/loop_consistency.py "
    + " ".join(f"{run.split('=')[0]}=RESULT.json" for run in arguments.runs),
    {"scenes": scenes},
)
