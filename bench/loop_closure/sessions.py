#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Sessions without a common origin: two walks through one building merge, walks through two buildings do not.

    bench/loop_closure/sessions.py --data DATA [--every 2] [-o record.json]

Same building: the even fragments of a scene are one session, the odd ones another. Two buildings: one session each. Every session is in
a frame of its own, with odometry that drifts by 1 % and 0.1 degrees per metre. The closer proposes, registers and verifies everything
itself. Needs the package gpureg.
"""

import argparse
import pathlib
import sys
import time

import gpureg
import numpy as np
from walk import SCENES, about_up, drifting_steps, prepare, read_poses, rmse

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1]))
from rows import dumps

CASES = [
    ("house_A", "house_A"),
    ("hospital_E", "hospital_E"),
    ("house_A", "hospital_E"),
    ("house_B", "hospital_E"),
]
DRIFT = 0.01
FIRST_ID = 1000  # of the second session


def add_session(context, closer, folder, numbers, session, random):
    """Fragments with drifting odometry; ids FIRST_ID * session + k. Returns the true poses by id."""
    truth = read_poses(folder / "poses.txt")
    clouds = prepare(context, folder, numbers)
    steps = drifting_steps(truth, numbers, DRIFT)
    pose = about_up(np.eye(4), random.uniform(0, 360)) @ truth[numbers[0]]
    pose[:2, 3] += random.uniform(-50, 50, 2)
    ids = [FIRST_ID * session + k for k in range(len(numbers))]
    for k, here in enumerate(ids):
        if k > 0:
            pose = pose @ steps[k - 1]
        closer.add(here, clouds[k], pose, session=session, time=float(k))
        if k > 0:
            closer.add_odometry(here, here - 1, steps[k - 1])
    return {here: truth[number] for here, number in zip(ids, numbers, strict=True)}


def run(context, first, second, data, every):
    random = np.random.default_rng(1)
    closer = gpureg.LoopCloser(context=context)
    same = first == second
    numbers = [sorted(read_poses(data / SCENES[s] / "poses.txt")) for s in (first, second)]
    if same:
        numbers = [numbers[0][0::2], numbers[0][1::2]]
    else:
        numbers = [n[::every] for n in numbers]
    start = time.perf_counter()
    poses = [
        add_session(context, closer, data / SCENES[scene], n, session, random)
        for session, (scene, n) in enumerate(zip((first, second), numbers, strict=True))
    ]
    registered = closer.process().registered
    between = [
        loop for loop in closer.loops if (loop.source < FIRST_ID) != (loop.target < FIRST_ID)
    ]
    accepted = [loop for loop in between if loop.state == "accepted"]
    row = {
        "sessions": [first, second],
        "fragments": [len(n) for n in numbers],
        "registered": registered,
        "between": len(between),
        "confident_between": sum(loop.confidence > 0.9 for loop in between),
        "accepted_between": len(accepted),
        "merged": len(set(closer.frames.values())) == 1,
        "seconds": time.perf_counter() - start,
    }
    if same:
        truth = {**poses[0], **poses[1]}
        row["rmse"] = rmse([closer.poses[k] for k in truth], list(truth.values()))
    print(row, flush=True)
    return row


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--every", type=int, default=2, help="of the fragments of two buildings")
    parser.add_argument("-o", "--output", type=pathlib.Path)
    arguments = parser.parse_args()
    context = gpureg.Context.best()
    rows = [run(context, *case, arguments.data, arguments.every) for case in CASES]
    if arguments.output:
        arguments.output.write_text(dumps({"rows": rows}) + "\n")


if __name__ == "__main__":
    main()
