#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How often poses under which few points overlap are correct, against the factor on their confidence
in src/confidence/confidence.cpp.

The confidence is fitted to clouds of thousands of points. Coarse voxels leave so few that some pose
of any two clouds makes most of them overlap. Poses are counted by their number of overlapping
points, with the confidence before and after the factor, if it was above one half before. Correct:
Redwood's rule, with a voxel where that is more than 0.2 m.

usage: few_points.py SCENE_FOLDER=RESULT.json... [-o bench/results/few_points.json]
RESULT.json: of `gpureg batch --voxel-size V --json` on a scene whose folder has gt_all.log and
gt_all.info. Needs numpy and the Python package gpureg."""

import json
import pathlib

import numpy as np
from fit_confidence import MAX_ERROR, MIN_SEPARATION, REPORTED, blocks, errors, overlap_factor
from record import commit, plain_parser, save

EDGES = (1, 10, 20, 30, 50, 75, 100, 150, 200, 300, 500)  # overlapping points, of the table's rows


def poses(text):
    """Of the best pose of each pair: overlapping points, confidence before and after the factor,
    correct or not.
    """
    folder, result = text.split("=")
    folder, run = pathlib.Path(folder), json.loads(pathlib.Path(result).read_text())
    truth, information = blocks(folder / "gt_all.log", 5), blocks(folder / "gt_all.info", 7)
    points = {f["number"]: f["points"] for f in run["fragments"]}
    limit = max(MAX_ERROR, run["options"]["voxel_size"])
    out = []
    for pair in run["pairs"]:
        key = pair["i"], pair["j"]
        if key[1] - key[0] < MIN_SEPARATION or not pair.get("modes"):
            continue
        mode, of = pair["modes"][0], (points[key[1]], points[key[0]])
        overlapping = min(share * n for share, n in zip(mode["evidence"]["overlap"], of))
        if overlapping < EDGES[0]:
            continue
        correct = (
            key in truth
            and errors(
                truth[key], information[key], np.array(mode["T_ij"], float).reshape(1, 4, 4)
            )[0]
            <= limit
        )
        out.append(
            (
                overlapping,
                mode["confidence"] / overlap_factor(mode["evidence"]["overlap"], *of),
                mode["confidence"],
                correct,
            )
        )
    return out


def main():
    parser = plain_parser(__doc__)
    parser.add_argument("runs", nargs="+", metavar="SCENE_FOLDER=RESULT.json")
    parser.add_argument("-o", "--output", type=pathlib.Path)
    arguments = parser.parse_args()
    overlapping, before, after, correct = np.array(
        [pose for run in arguments.runs for pose in poses(run)]
    ).T
    record = {"command": "bench/accuracy/few_points.py", "commit": commit(), "bins": []}
    for low, high in zip(EDGES, (*EDGES[1:], np.inf)):
        these = (overlapping >= low) & (overlapping < high) & (before > REPORTED)
        if these.any():
            record["bins"].append(
                {
                    "from": low,
                    "below": None if np.isinf(high) else high,
                    "poses": int(these.sum()),
                    "before": before[these].mean(),
                    "right": correct[these].mean(),
                    "after": after[these].mean(),
                }
            )
            print(
                "from {from} below {below}: {poses} poses, {before:.2f} before, {right:.2f} right, {after:.2f} after".format(
                    **record["bins"][-1]
                )
            )
    if arguments.output:
        save(arguments.output, record)


if __name__ == "__main__":
    main()
