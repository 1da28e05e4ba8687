#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Errors of a map against the truth: for each island, RMSE of positions and rotations after alignment (Horn 1987).

    map_rmse.py OUT TRUTH      OUT of `gpureg reconstruct`, TRUTH/poses.txt; also counts wrong accepted edges.
"""
import json
import pathlib
import sys

import numpy as np

MAX_EDGE_METRES, MAX_EDGE_DEGREES = 0.3, 15.0  # beyond one of them an edge is wrong, as in 3DMatch's registration recall


def read_poses(path):
    numbers = [line.split() for line in pathlib.Path(path).read_text().splitlines() if line.strip()]
    return {int(numbers[k][0]): np.array(numbers[k + 1 : k + 5], float) for k in range(0, len(numbers), 5)}


def angle(rotation):
    return np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))


def errors(poses, truth, ids):
    a = np.array([poses[k][:3, 3] for k in ids])
    b = np.array([truth[k][:3, 3] for k in ids])
    u, _, vt = np.linalg.svd((b - b.mean(0)).T @ (a - a.mean(0)))
    turn = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    metres = np.linalg.norm((a - a.mean(0)) @ turn.T + b.mean(0) - b, axis=1)
    degrees = np.array([angle(truth[k][:3, :3].T @ turn @ poses[k][:3, :3]) for k in ids])
    return metres, degrees


def main():
    out, truth = pathlib.Path(sys.argv[1]), read_poses(pathlib.Path(sys.argv[2]) / "poses.txt")
    poses, document = read_poses(out / "poses.txt"), json.loads((out / "reconstruction.json").read_text())
    print(f"placed {len(poses)} of {len(document['scans'])}, islands {[len(i) for i in document['islands']]}")
    for island in document["islands"]:
        metres, degrees = errors(poses, truth, island)
        print(f"island of {len(island)}: RMSE {100 * np.sqrt((metres**2).mean()):.2f} cm, "
              f"{np.sqrt((degrees**2).mean()):.2f} degrees; worst {100 * metres.max():.2f} cm "
              f"(scan {island[metres.argmax()]}), {degrees.max():.2f} degrees (scan {island[degrees.argmax()]})")
    wrong, accepted = [], [e for e in document["edges"] if e["state"] == "accepted"]
    for edge in accepted:
        true_pose = np.linalg.inv(truth[edge["i"]]) @ truth[edge["j"]]
        error = np.linalg.inv(true_pose) @ np.array(edge["T_ij"]).reshape(4, 4)
        if np.linalg.norm(error[:3, 3]) > MAX_EDGE_METRES or angle(error[:3, :3]) > MAX_EDGE_DEGREES:
            wrong.append((edge["i"], edge["j"], round(float(np.linalg.norm(error[:3, 3])), 3), round(edge["confidence"], 3)))
    print(f"edges: {len(accepted)} accepted, {len(wrong)} wrong {wrong}")


if __name__ == "__main__":
    main()
