#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whether the scales found between scans of one place are errors of the estimate or scales of the scans.

Each pair is aligned in both directions with a free scale near 1. A biased estimate makes source or target smaller
whichever comes first (`bias`: half the mean of log scale + log scale of the swapped pair). Scans with scales of their
own explain both by one figure each: `found` is the RMS of log scale, `left` what remains after the scans' own scales,
by least squares over all pairs (all in per cent). Pairs whose pose is not that of the truth do not count.

usage: own_scales.py DATA [--sets kitchen,house_a] [--pairs 150] [--backend cpu] [--json OUT]
Needs numpy and the Python package gpureg."""

import json
import pathlib
import sys

import gpureg
import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "accuracy"))
from record import commit, plain_parser, save
from run import rigid_at, scenes_of

NEAR_ONE = (0.9, 1.1)


def figures(scene, context):
    options = gpureg.RegistrationOptions(voxel_size=float(scene.voxel))
    seen = [k for k, cloud in enumerate(scene.clouds) if cloud]
    place = {k: n for n, k in enumerate(seen)}
    asked = [(s, t, truths[0]) for s, t, truths in scene.pairs if truths]
    asked += [(t, s, np.linalg.inv(truth)) for s, t, truth in asked]
    results = gpureg.align_scaled_batch(
        [scene.clouds[k].points for k in seen],
        [(place[s], place[t]) for s, t, _ in asked],
        scale=NEAR_ONE,
        options=options,
        context=context,
    )
    scale = {}
    for (s, t, truth), r in zip(asked, results):
        points = scene.clouds[s].points[::50]
        if r.result.has_pose and scene.right(
            points, rigid_at(points, r.target_from_source), [truth]
        ):
            scale[s, t] = 100 * np.log(r.scale)
    both = [(s, t) for s, t in scale if s > t and (t, s) in scale]
    own = np.array([(scale[p] - scale[p[::-1]]) / 2 for p in both])
    rows = np.zeros((len(both), len(seen)))
    for row, (s, t) in zip(rows, both):
        row[place[t]], row[place[s]] = 1, -1
    left = own - rows @ np.linalg.lstsq(rows, own, rcond=1e-9)[0]
    free = max(1, len(both) - np.linalg.matrix_rank(rows))
    return {
        "pairs": len(both),
        "bias": round(float(np.mean([(scale[p] + scale[p[::-1]]) / 2 for p in both])), 3),
        "found": round(float(np.sqrt(np.mean(own**2))), 3),
        "left": round(float(np.sqrt((left**2).sum() / free)), 3),
        "median": round(float(np.median(np.abs(own))), 3),
    }


def main():
    parser = plain_parser(__doc__)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--sets", default="kitchen,house_a")
    parser.add_argument("--pairs", type=int, default=150)
    parser.add_argument("--backend", choices=("cpu", "cuda"), default="cpu")
    parser.add_argument("--json", type=pathlib.Path)
    arguments = parser.parse_args()
    context = getattr(gpureg.Context, arguments.backend)()
    record = {
        "command": f"bench/scale/own_scales.py --sets {arguments.sets} --pairs {arguments.pairs}",
        "commit": commit(),
        "sets": {},
    }
    for name in arguments.sets.split(","):
        (scene,) = scenes_of(name, arguments.data, arguments.pairs)
        record["sets"][name] = figures(scene, context)
        print(name, json.dumps(record["sets"][name]), flush=True)
        if arguments.json:
            save(arguments.json, record)


if __name__ == "__main__":
    main()
