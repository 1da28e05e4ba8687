#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Errors of a map against the truth: for each island, RMSE of positions and rotations after alignment (Horn 1987).

    map_rmse.py OUT TRUTH      OUT of `gpureg reconstruct`; TRUTH/poses.txt, gt_all.log, gt_all.info

Rotations are aligned by positions, and by themselves (the chordal mean): positions hardly determine a rotation where scans are close.
An accepted edge is wrong where its pair is not in gt_all or its error by Redwood's measure is above 0.2 m.
"""

import json
import pathlib
import sys

import numpy as np

MAX_EDGE_METRES = 0.2


def read_poses(path):
    numbers = [line.split() for line in pathlib.Path(path).read_text().splitlines() if line.strip()]
    return {
        int(numbers[k][0]): np.array(numbers[k + 1 : k + 5], float)
        for k in range(0, len(numbers), 5)
    }


def read_blocks(path, rows):
    lines = [line.split() for line in pathlib.Path(path).read_text().splitlines() if line.strip()]
    return {
        (int(lines[k][0]), int(lines[k][1])): np.array(lines[k + 1 : k + 1 + rows], float)
        for k in range(0, len(lines), rows + 1)
    }


def redwood_error(truth, pose, information):
    error = np.linalg.inv(truth) @ pose
    w = np.sqrt(max(0.0, 1 + np.trace(error[:3, :3]))) / 2
    skew = error[:3, :3] - error[:3, :3].T
    vector = np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4 * max(w, 1e-9))
    e = np.concatenate([error[:3, 3], vector])
    return np.sqrt(e @ information @ e / information[0, 0])


def angle(rotation):
    return np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))


def errors(poses, truth, ids):
    a = np.array([poses[k][:3, 3] for k in ids])
    b = np.array([truth[k][:3, 3] for k in ids])
    u, _, vt = np.linalg.svd((b - b.mean(0)).T @ (a - a.mean(0)))
    turn = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    metres = np.linalg.norm((a - a.mean(0)) @ turn.T + b.mean(0) - b, axis=1)
    degrees = np.array([angle(truth[k][:3, :3].T @ turn @ poses[k][:3, :3]) for k in ids])
    relative = [truth[k][:3, :3] @ poses[k][:3, :3].T for k in ids]
    u, _, vt = np.linalg.svd(sum(relative))
    mean = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    own = np.array([angle(mean.T @ r) for r in relative])
    return metres, degrees, own


def rms(values):
    return np.sqrt((values**2).mean())


def main():
    out, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    truth = read_poses(folder / "poses.txt")
    poses, document = (
        read_poses(out / "poses.txt"),
        json.loads((out / "reconstruction.json").read_text()),
    )
    print(
        f"placed {len(poses)} of {len(document['scans'])}, islands {[len(i) for i in document['islands']]}"
    )
    for island in document["islands"]:
        metres, degrees, own = errors(poses, truth, island)
        print(
            f"island of {len(island)}: RMSE {100 * rms(metres):.2f} cm, {rms(degrees):.2f} degrees by positions, "
            f"{rms(own):.2f} by rotations; worst {100 * metres.max():.2f} cm (scan {island[metres.argmax()]})"
        )
    truth_log, truth_info = (
        read_blocks(folder / "gt_all.log", 4),
        read_blocks(folder / "gt_all.info", 6),
    )
    wrong, accepted = [], [e for e in document["edges"] if e["state"] == "accepted"]
    for edge in accepted:
        pair = (edge["i"], edge["j"])
        pose = np.array(edge["T_ij"]).reshape(4, 4)
        error = (
            redwood_error(truth_log[pair], pose, truth_info[pair]) if pair in truth_log else np.inf
        )
        if error > MAX_EDGE_METRES:
            wrong.append((*pair, round(float(error), 3), round(edge["confidence"], 3)))
    print(f"edges: {len(accepted)} accepted, {len(wrong)} wrong {wrong}")


if __name__ == "__main__":
    main()
