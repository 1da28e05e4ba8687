#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Errors of a map against the truth: for each island, RMSE of positions and rotations after alignment (Horn 1987).

    map_rmse.py OUT TRUTH [PAIRS.json]     OUT of `gpureg reconstruct`; TRUTH/poses.txt, gt_all.log, gt_all.info

Rotations are aligned by positions, and by themselves (the chordal mean): positions hardly determine a rotation where scans are close.
An accepted edge is wrong where its error by Redwood's measure is above 0.2 m, and far off where its pose is off by more than
0.35 m or 8 degrees, or its scans are of different scenes. Pairs with an overlap below 5 % are not in
gt_all: their truth is that of the poses, their information that of the result, or else of points 2 m around the source.
"""

import json
import pathlib
import sys

import numpy as np

SURE = 0.9  # confidence
MAX_EDGE_METRES = 0.2
FAR_METRES, FAR_DEGREES = 0.35, 8


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


def read_truth(folder):
    """Poses, and of all pairs with overlap their poses and information matrices."""
    folder = pathlib.Path(folder)
    return (
        read_poses(folder / "poses.txt"),
        read_blocks(folder / "gt_all.log", 4),
        read_blocks(folder / "gt_all.info", 6),
    )


# Without information of a pair: points on a sphere of 2 m around the source's origin.
NO_INFORMATION = np.diag([1, 1, 1, *(3 * [8 / 3 * 2**2])])


def edge_error(pair, pose, truth, information, scene_of):
    """Metres; infinite where the truth has no such scan or the scans are of different scenes."""
    poses, log, info = truth
    if pair in log:
        return redwood_error(log[pair], pose, info[pair])
    if not {*pair} <= poses.keys() or scene_of(pair[0]) != scene_of(pair[1]):
        return np.inf
    relative = np.linalg.inv(poses[pair[0]]) @ poses[pair[1]]
    return redwood_error(relative, pose, information.get(pair, NO_INFORMATION))


def is_far_off(pair, pose, truth_poses, scene_of):
    i, j = pair
    if not {i, j} <= truth_poses.keys() or scene_of(i) != scene_of(j):
        return True
    error = np.linalg.inv(truth_poses[j]) @ truth_poses[i] @ pose
    return bool(np.linalg.norm(error[:3, 3]) > FAR_METRES or angle(error[:3, :3]) > FAR_DEGREES)


def information_of(pairs):
    """Of the pairs of a result."""
    return {
        (p["i"], p["j"]): np.reshape(p["information"], (6, 6))
        for p in pairs
        if p.get("information")
    }


def measure(out, truth, information, scene_of=lambda scan: 0):
    """Figures of a map; truth as read_truth() returns it, information as information_of().
    Positions in centimetres. scene_of: of scans whose true poses have no common frame.
    """
    truth_poses = truth[0]
    poses = {}
    for path in out.glob("poses*.txt"):  # of each island
        poses.update(read_poses(path))
    document = json.loads((out / "reconstruction.json").read_text())
    islands = []
    for island in document["islands"]:
        known = [k for k in island if k in truth_poses]
        if len(known) < 3:
            islands.append({"scans": island})
            continue
        metres, degrees, own = errors(poses, truth_poses, known)
        islands.append(
            {
                "scans": island,
                "rmse_cm": 100 * rms(metres),
                "rmse_degrees": rms(degrees),
                "rmse_degrees_own": rms(own),
                "worst_cm": 100 * metres.max(),
                "worst_scan": known[metres.argmax()],
            }
        )
    wrong, far, accepted = [], [], [e for e in document["edges"] if e["state"] == "accepted"]
    for edge in accepted:
        pair = (edge["i"], edge["j"])
        pose = np.array(edge["T_ij"]).reshape(4, 4)
        if is_far_off(pair, pose, truth_poses, scene_of):
            far.append(pair)
        error = edge_error(pair, pose, truth, information, scene_of)
        if error > MAX_EDGE_METRES:
            wrong.append(
                {
                    "pair": pair,
                    "metres": float(error) if np.isfinite(error) else None,
                    "confidence": edge["confidence"],
                }
            )
    sure = {}
    for name in ("pair_confidence", "map_confidence"):
        errors_of_sure = [
            edge_error(
                (edge["i"], edge["j"]),
                np.reshape(edge["T_ij"], (4, 4)),
                truth,
                information,
                scene_of,
            )
            for edge in document["edges"]
            if edge.get(name, 0) > SURE
        ]
        right = int(sum(error <= MAX_EDGE_METRES for error in errors_of_sure))
        sure[name] = {"edges": len(errors_of_sure), "right": right}
    return {
        "scans": len(document["scans"]),
        "placed": len(poses),
        "islands": islands,
        "accepted": len(accepted),
        "wrong": wrong,
        "far_off": far,
        "sure": sure,
    }


def main():
    out = pathlib.Path(sys.argv[1])
    results = pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else out / "pairs.json"
    pairs = json.loads(results.read_text())["pairs"] if results.exists() else []
    figures = measure(out, read_truth(sys.argv[2]), information_of(pairs))
    sizes = [len(island["scans"]) for island in figures["islands"]]
    print(f"placed {figures['placed']} of {figures['scans']}, islands {sizes}")
    for island in figures["islands"]:
        if "rmse_cm" in island:
            print(
                f"island of {len(island['scans'])}: RMSE {island['rmse_cm']:.2f} cm, {island['rmse_degrees']:.2f} degrees "
                f"by positions, {island['rmse_degrees_own']:.2f} by rotations; "
                f"worst {island['worst_cm']:.2f} cm (scan {island['worst_scan']})"
            )
    print(
        f"edges: {figures['accepted']} accepted, {len(figures['wrong'])} wrong, "
        f"{len(figures['far_off'])} far off"
    )
    for edge in figures["wrong"]:
        far = "no overlap" if edge["metres"] is None else f"{edge['metres']:.3f} m"
        print(f"    {edge['pair']}: {far}, confidence {edge['confidence']:.3f}")


if __name__ == "__main__":
    main()
