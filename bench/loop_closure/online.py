#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The closer as a SLAM system uses it: one fragment after the other, process() after each; everything is proposed, registered and
verified by the closer itself.

    bench/loop_closure/online.py --data DATA [-o record.json]

Odometry drifts by 2 % and 0.2 degrees per metre, as the options say by default, and by five times as much. A loop is correct within
0.35 m and 8 degrees. Needs the package gpureg.
"""

import argparse
import pathlib
import sys
import time

import gpureg
import numpy as np
from walk import SCENES, correct, drifting_steps, prepare, read_poses, rmse

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
from rows import dumps

DRIFTS = (0.02, 0.1)


def run(context, scene, data, drift):
    folder = data / SCENES[scene]
    truth = read_poses(folder / "poses.txt")
    numbers = sorted(truth)
    clouds = prepare(context, folder, numbers)
    steps = drifting_steps(truth, numbers, drift)
    closer = gpureg.LoopCloser(context=context)
    odometry = [truth[numbers[0]]]
    registered = retracted = 0
    start = time.perf_counter()
    for k in range(len(numbers)):
        if k > 0:
            odometry.append(odometry[-1] @ steps[k - 1])
        closer.add(k, clouds[k], odometry[-1], time=float(k))
        if k > 0:
            closer.add_odometry(k, k - 1, steps[k - 1])
        update = closer.process()
        registered += update.registered
        retracted += sum(loop.state == "retracted" for loop in update.changed)
    accepted = [loop for loop in closer.loops if loop.state == "accepted"]
    right = sum(
        correct(
            np.linalg.inv(truth[numbers[loop.target]]) @ truth[numbers[loop.source]],
            loop.target_from_source,
        )
        for loop in accepted
    )
    true_poses = [truth[number] for number in numbers]
    row = {
        "scene": scene,
        "metres": float(sum(np.linalg.norm(step[:3, 3]) for step in steps)),
        "drift": drift,
        "odometry_rmse": rmse(odometry, true_poses),
        "rmse": rmse([closer.poses[k] for k in range(len(numbers))], true_poses),
        "accepted": len(accepted),
        "correct": right,
        "retracted": retracted,
        "registered": registered,
        "seconds": time.perf_counter() - start,
    }
    print(row, flush=True)
    return row


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    arguments = parser.parse_args()
    context = gpureg.Context.best()
    rows = [run(context, scene, arguments.data, drift) for scene in SCENES for drift in DRIFTS]
    if arguments.output:
        arguments.output.write_text(dumps({"rows": rows}) + "\n")


if __name__ == "__main__":
    main()
