#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How often poses are right under which only few points touch: what src/confidence/confidence.cpp leaves
of their confidence.

The confidence is fitted to clouds of thousands of points. Runs with coarse voxels have so few that
some pose of any two clouds lets most of them touch. Poses are counted by how many points touch,
with the confidence before and after that is asked, if it was above one half before. Right:
Redwood's rule, with a voxel where that is more than 0.2 m.

usage: few_points.py SCENE_FOLDER=RESULT.json... [-o bench/results/few_points.json]
RESULT.json: what `gpureg batch --voxel-size V --json` wrote for a scene whose folder has gt_all.log
and gt_all.info. Needs numpy."""

import argparse
import functools
import json
import operator
import pathlib

import numpy as np
from fit_confidence import blocks, errors, with_so_few_points
from record import commit

EDGES = (1, 10, 20, 30, 50, 75, 100, 150, 200, 300, 500)


def poses(text):
    """Touching points, confidence before, right or not: of the best pose of each pair."""
    folder, result = text.split("=")
    folder, run = pathlib.Path(folder), json.loads(pathlib.Path(result).read_text())
    truth, information = blocks(folder / "gt_all.log", 5), blocks(folder / "gt_all.info", 7)
    points = {f["number"]: f["points"] for f in run["fragments"]}
    limit = max(0.2, run["options"]["prepare"]["voxel_size"])
    out = []
    for pair in run["pairs"]:
        key = pair["i"], pair["j"]
        if key[1] - key[0] < 2 or not pair.get("modes"):
            continue
        mode, of = pair["modes"][0], (points[key[1]], points[key[0]])
        touching = min(share * n for share, n in zip(mode["evidence"]["overlap"], of))
        if touching < EDGES[0]:
            continue
        right = (
            key in truth
            and errors(
                truth[key], information[key], np.array(mode["T_ij"], float).reshape(1, 4, 4)
            )[0]
            <= limit
        )
        out.append(
            (
                touching,
                mode["confidence"] / with_so_few_points(mode["evidence"], of),
                mode["confidence"],
                right,
            )
        )
    return out


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("runs", nargs="+", metavar="SCENE_FOLDER=RESULT.json")
    parser.add_argument("-o", "--output", type=pathlib.Path)
    arguments = parser.parse_args()
    touching, before, after, right = np.array(
        functools.reduce(operator.iadd, map(poses, arguments.runs), [])
    ).T
    record = {"command": "bench/accuracy/few_points.py", "commit": commit(), "bins": []}
    for low, high in zip(EDGES, (*EDGES[1:], np.inf)):
        these = (touching >= low) & (touching < high) & (before > 0.5)
        if these.any():
            record["bins"].append(
                {
                    "from": low,
                    "below": None if np.isinf(high) else high,
                    "poses": int(these.sum()),
                    "before": before[these].mean(),
                    "right": right[these].mean(),
                    "after": after[these].mean(),
                }
            )
            print(
                "from {from} below {below}: {poses} poses, {before:.2f} before, {right:.2f} right, {after:.2f} after".format(
                    **record["bins"][-1]
                )
            )
    if arguments.output:
        arguments.output.write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
