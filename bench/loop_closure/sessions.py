#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Sessions without a common origin: two walks through one building merge, walks through two buildings do not.

    bench/loop_closure/sessions.py --data DATA [--every 2] [-o record.json]

Same building: the even fragments of a scene are one session, the odd ones another. Two buildings: one session each. Every session is in
a frame of its own, with odometry that drifts by 1 % and 0.1 degrees per metre. The closer proposes, registers and verifies everything
itself. Needs the package gpureg.
"""

import argparse
import json
import pathlib
import time

import gpureg
import numpy as np

SCENES = {"house_A": "house/A", "house_B": "house/B", "hospital_E": "hospital/E"}
CASES = [
    ("house_A", "house_A"),
    ("hospital_E", "hospital_E"),
    ("house_A", "hospital_E"),
    ("house_B", "hospital_E"),
]
SCALE, DEGREES_PER_METRE = 1.01, 0.1
FIRST_ID = 1000  # of the second session


def read_poses(path):
    rows = [line.split() for line in path.read_text().splitlines() if line.strip()]
    return {
        int(rows[k][0]): np.array(rows[k + 1 : k + 5], float) for k in range(0, len(rows), 5)
    }


def yaw(degrees):
    turn = np.eye(4)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn[:2, :2] = [[c, -s], [s, c]]
    return turn


def add_session(context, closer, folder, numbers, session, random):
    """Fragments with drifting odometry; ids FIRST_ID * session + k. Returns the true poses by id."""
    fragments = gpureg.FragmentSet.from_directory(folder)
    options = gpureg.RegistrationOptions()
    truth = read_poses(folder / "poses.txt")
    loaded = [
        fragments.load(fragments.numbers.index(number), options.prepare) for number in numbers
    ]
    clouds = gpureg._core.prepare_batch(context, loaded, options.prepare)
    frame = yaw(random.uniform(0, 360))
    frame[:3, 3] = random.uniform(-50, 50, 3) * [1, 1, 0]
    pose, poses = frame @ truth[numbers[0]], {}
    for k, (number, cloud) in enumerate(zip(numbers, clouds, strict=True)):
        here = FIRST_ID * session + k
        if k > 0:
            step = np.linalg.inv(truth[numbers[k - 1]]) @ truth[number]
            length = np.linalg.norm(step[:3, 3])
            step[:3, 3] *= SCALE
            step = step @ yaw(DEGREES_PER_METRE * length)
            pose = pose @ step
        closer.add(here, cloud, pose, session=session, time=float(k))
        if k > 0:
            closer.add_odometry(here, here - 1, step)
        poses[here] = truth[number]
    return poses


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
        found = closer.poses
        ids = sorted(truth)
        a = np.array([found[k][:3, 3] for k in ids])
        b = np.array([truth[k][:3, 3] for k in ids])
        u, _, vt = np.linalg.svd((b - b.mean(0)).T @ (a - a.mean(0)))
        turn = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
        error = np.linalg.norm((a - a.mean(0)) @ turn.T + b.mean(0) - b, axis=1)
        row["rmse"] = float(np.sqrt(np.mean(error**2)))
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
        arguments.output.write_text(json.dumps({"rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
