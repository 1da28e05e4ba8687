#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Do places of a set look alike? Log odds by how far its pairs agree (Reconstruction::agreement).

Sets: all scans of a scene, halves, thirds, random two thirds and halves. Places of a scene look alike if more
than a tenth of the poses from a confidence of one half on are wrong. Logistic regression: distinct places and
alike ones, and of each the kinds, have the same weight, a set that of its poses. It prints how many sets, and
poses, a fit on the other kinds calls alike.

    fit_alike.py --gather ROWS.json KIND=SCENE_FOLDER ... [--backend cuda] [--no-viewpoints]    adds rows
    fit_alike.py ROWS.json [--write]    (src/reconstruction/audit/alike_model.hpp, and `kinds` of ROWS.json)

SCENE_FOLDER has cloud_bin_<i>.ply, cameras.txt and poses.txt. Needs the package gpureg, numpy and scipy.
"""

import argparse
import collections
import json
import pathlib
import random
import re

import numpy as np
from record import save
from scipy.optimize import minimize

HEADER = pathlib.Path(__file__).resolve().parents[2] / "src/reconstruction/audit/alike_model.hpp"
VOXEL = 0.05
WRONG = 0.35, 8  # metres, degrees
REPORTED, ALIKE = 0.5, 0.1
PENALTY = 1e-4


def subsets(scans):
    """Names and positions."""
    yield "all", range(scans)
    for step in (2, 3):
        for first in range(step):
            yield f"every {step} from {first}", range(first, scans, step)
    for share, count in ((2 / 3, 3), (1 / 2, 3)):
        for seed in range(count):
            chosen = random.Random(seed).sample(range(scans), int(scans * share))
            yield f"{share:.2f}, seed {seed}", sorted(chosen)


def is_wrong(pose, truth):
    e = np.linalg.inv(truth) @ pose
    turn = np.degrees(np.arccos(np.clip((np.trace(e[:3, :3]) - 1) / 2, -1, 1)))
    return bool(np.linalg.norm(e[:3, 3]) > WRONG[0] or turn > WRONG[1])


def gather(file, places, backend, viewpoints):
    import gpureg
    from map_rmse import read_poses

    out = json.loads(file.read_text())["sets"] if file.exists() else []
    context = getattr(gpureg.Context, backend)()
    options = gpureg.RegistrationOptions(voxel_size=VOXEL)
    for place in places:
        kind, folder = place.split("=")
        folder = pathlib.Path(folder)
        scene = gpureg.FragmentSet.from_directory(folder)
        truth, numbers = read_poses(folder / "poses.txt"), scene.numbers
        rows = [(s, t) for t in range(len(scene)) for s in range(t + 1, len(scene))]
        paths = [folder / name for name in scene.names]
        cameras = gpureg.read_cameras(folder / "cameras.txt") if viewpoints else {}
        scene = gpureg.FragmentSet(numbers, paths, cameras, scene.names)
        clouds = [
            gpureg.prepare(path, viewpoints=cameras.get(n), options=options, context=context)
            for path, n in zip(paths, numbers)
        ]
        results = gpureg.align_batch(clouds, rows, options=options, context=context)
        wrong = [
            r.has_pose
            and is_wrong(r.target_from_source, np.linalg.inv(truth[numbers[t]]) @ truth[numbers[s]])
            for (s, t), r in zip(rows, results)
        ]
        for name, kept in subsets(len(scene)):
            left = set(range(len(scene))) - set(kept)
            chosen = [k for k, pair in enumerate(rows) if left.isdisjoint(pair)]
            reported = [k for k in chosen if results[k].confidence >= REPORTED]
            made = gpureg.reconstruct(
                scene.without(left) if left else scene,
                [(numbers[rows[k][0]], numbers[rows[k][1]]) for k in chosen],
                results=[results[k] for k in chosen],
                options=options,
                refine=False,
                context=context,
            )
            contradicted, edges_per_scan, jumps = made.agreement
            out.append(
                {
                    "kind": kind,
                    "scene": folder.name,
                    "subset": name,
                    "viewpoints": viewpoints,
                    "contradicted": round(contradicted, 5),
                    "edges_per_scan": round(edges_per_scan, 3),
                    "jumps": round(jumps, 4),
                    "reported": len(reported),
                    "wrong": sum(wrong[k] for k in reported),
                }
            )
        print(kind, folder.name, flush=True)
        save(file, {"sets": out})


def features(rows):
    """Where places differ, the share that contradicts falls with the square of the edges per scan."""
    q = [max(r["contradicted"], 1e-3) * max(r["edges_per_scan"], 0.1) ** 2 for r in rows]
    return np.column_stack([np.ones(len(rows)), np.log(q), [r["jumps"] for r in rows]])


def alike_scenes(rows):
    return {r["scene"] for r in rows if r["subset"] == "all" and r["wrong"] > ALIKE * r["reported"]}


def fit(rows):
    alike = alike_scenes(rows)
    x, y = features(rows), np.array([1.0 if r["scene"] in alike else -1.0 for r in rows])
    poses, kinds = collections.Counter(), {1: set(), -1: set()}
    for row, label in zip(rows, y):
        poses[row["kind"], label] += row["reported"]
        kinds[label].add(row["kind"])
    weight = np.array(
        [r["reported"] / poses[r["kind"], k] / len(kinds[k]) for r, k in zip(rows, y)]
    )

    def loss(p):
        margin = y * (x @ p)
        slope = -weight * y / (1 + np.exp(margin)) / 2
        return (weight * np.logaddexp(0, -margin)).sum() / 2 + PENALTY * (p[1:] ** 2).sum() / 2, (
            x.T @ slope + PENALTY * np.r_[0, p[1:]]
        )

    return minimize(loss, np.zeros(3), jac=True, method="BFGS").x


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("rows", type=pathlib.Path)
    parser.add_argument("places", nargs="*", metavar="KIND=SCENE_FOLDER")
    parser.add_argument("--gather", action="store_true")
    parser.add_argument("--backend", choices=("cpu", "cuda"), default="cpu")
    parser.add_argument("--no-viewpoints", action="store_true", help="gather: points alone")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    if arguments.gather:
        return gather(
            arguments.rows, arguments.places, arguments.backend, not arguments.no_viewpoints
        )
    rows = json.loads(arguments.rows.read_text())["sets"]
    kinds = []
    alike = alike_scenes(rows)
    for kind in dict.fromkeys(r["kind"] for r in rows):
        p = fit([r for r in rows if r["kind"] != kind])
        own = [r for r in rows if r["kind"] == kind]
        called = [r for r in own if features([r])[0] @ p > 0]
        poses = sum(r["reported"] for r in called) / sum(r["reported"] for r in own)
        kinds.append(
            {
                "kind": kind,
                "alike": own[0]["scene"] in alike,
                "sets": len(own),
                "called_alike": len(called),
                "poses_percent": round(100 * poses),
            }
        )
        print(kinds[-1])
    p = fit(rows)
    print("bias, contradicted, jumps:", *p.round(3))
    if arguments.write:
        names = "kBias", "kContradicted", "kJumps"
        values = ", ".join(f"{name} = {value:.3g}" for name, value in zip(names, p))
        text = re.sub(r"kBias = .*;", values + ";", HEADER.read_text())
        HEADER.write_text(text)
        save(arguments.rows, {"kinds": kinds, "sets": rows})


if __name__ == "__main__":
    main()
