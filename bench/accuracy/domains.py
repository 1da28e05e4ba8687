#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Evidence of pairs of many kinds of data: what fit_models.py fits and domains_record.py tests the confidence with.

A domain is a kind of sensor in a kind of place. Simulated ones: parts, figures, objects, street, blocks,
hall (domain_scenes.py). Real ones, in DATA (its README.md has origins and licences): kitchen, dragon, cad,
cad_mesh, kitti, lidar, fgr (viewpoints.py). One file DOMAIN.json each: every pair with the evidence of
its modes and which of them are correct, under one of the conditions of viewpoints.py (`said`,
`nothing`, `still`).

A seed is that of the random poses and of gpureg; the file has the pairs of all seeds, and is written after
each of them.

usage: domains.py DATA OUT [--domains parts,street] [--scenes 12] [--conditions said,nothing] [--seeds 1 2 3]
       [--gpureg COMMAND]
Needs numpy, the Python package gpureg and what domain_scenes.py needs."""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import fit_confidence
import numpy as np
import viewpoints
from viewpoints import Cloud, Set

SIMULATED = ("parts", "figures", "objects", "street", "blocks", "hall")
REAL = ("kitchen", "dragon", "cad", "cad_mesh", "kitti", "lidar", "fgr")
SCENE_STEP = 1000


def simulated(name, seed, **fixed):
    """A Set of viewpoints.py from a scene of domain_scenes.py; fixed: parameters of the scene."""
    import domain_scenes

    scene = domain_scenes.SCENES[name](seed, **fixed)
    rng = np.random.default_rng([seed, 1])
    as_mesh = rng.random() < 0.5
    extent = max(
        float(np.ptp(s.points if s.model is None else s.model.vertices, axis=0).max())
        for s in scene.scans
    )
    clouds = []
    for scan in scene.scans:
        if scan.model is None:
            clouds.append(Cloud(scan.points, np.zeros((1, 3)), extent))
            continue
        triangles = np.asarray(scan.model.triangles)
        points, _ = viewpoints.sampled(triangles, rng, scene.model_points)
        clouds.append(Cloud(points, None, extent, triangles if as_mesh else None))
    pairs = [(s, t, domain_scenes.truths(scene, s, t)) for s, t in scene.pairs]

    def right(points, pose, truths):
        middle = points.mean(0)
        return any(
            viewpoints.angle(pose, t) < scene.degrees
            and np.linalg.norm((pose - t)[:3, :3] @ middle + (pose - t)[:3, 3]) < scene.distance
            for t in truths
        )

    return Set(clouds, pairs, scene.voxel_size, right)


def inverse_if(swap, pose):
    return np.linalg.inv(pose) if swap else pose


def evidence_of(command, scene, condition, seed, extra=()):
    """Every pair of the set with its modes, and which are correct."""
    rng = np.random.default_rng(seed)
    poses = [
        np.eye(4) if condition == "still" else viewpoints.random_pose(rng, cloud.reach)
        for cloud in scene.clouds
    ]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        viewpoints.write(folder, scene.clouds, poses, condition == "said")
        (folder / "pairs.txt").write_text("".join(f"{t} {s}\n" for s, t, _ in scene.pairs))
        words = [command, "batch", name, "--pairs", folder / "pairs.txt", "-o", folder / "out.log"]
        words += ["--json", folder / "out.json", "--voxel-size", scene.voxel]
        words += ["--seed", str(seed), "--threads", "1", "--backend", "cpu", "--quiet", *extra]
        finished = subprocess.run(words, capture_output=True, text=True)
        if finished.returncode not in (0, 1):
            sys.exit(f"error: {command}: {finished.stderr}")
        document = json.loads((folder / "out.json").read_text())
    fragments = document["fragments"]
    found = {(p["i"], p["j"]): p for p in document["pairs"]}
    out = []
    for source, target, truths in scene.pairs:
        i, j = min(source, target), max(source, target)
        modes = found[i, j].get("modes", [])
        points = scene.clouds[source].points[::50]
        correct = []
        for mode in modes:
            j_to_i = np.array(mode["T_ij"], np.float64).reshape(4, 4)
            pose = inverse_if(source < target, j_to_i)
            pose = np.linalg.inv(poses[target]) @ pose @ poses[source]
            correct.append(bool(truths) and bool(scene.right(points, pose, truths)))
        out.append(
            {
                "condition": condition,
                "seed": seed,
                "pair": [i, j],
                "positive": bool(truths),
                "status": found[i, j]["status"],
                "points": [fragments[i]["points"], fragments[j]["points"]],
                "viewpoints": [fragments[i]["viewpoint"], fragments[j]["viewpoint"]],
                "refined": fit_confidence.refined_modes(document["options"]),
                "voxel_size": document["options"]["voxel_size"],
                "modes": [
                    {k: m[k] for k in ("evidence", "confidence", "equivalent") if k in m}
                    for m in modes
                ],
                "correct": correct,
            }
        )
    return out


def summary(pairs):
    """positive, first correct, any mode correct, reported, reported and wrong."""
    positive = [p for p in pairs if p["positive"]]
    first = sum(p["correct"][:1] == [True] for p in positive)
    reported = [p for p in pairs if p["status"] == "aligned"]
    return {
        "pairs": len(pairs),
        "positive": len(positive),
        "first": first,
        "any": sum(any(p["correct"]) for p in positive),
        "reported": sum(p["correct"][:1] == [True] for p in reported),
        "wrong": sum(p["correct"][:1] != [True] for p in reported),
    }


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--domains", default=",".join(SIMULATED + REAL))
    parser.add_argument("--conditions", default="said,nothing")
    parser.add_argument("--scenes", type=int, default=12, help="of each simulated domain")
    parser.add_argument("--first", type=int, default=1, help="seed of the first simulated scene")
    parser.add_argument("--pairs", type=int, default=100, help="at most so many of a real domain")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--gpureg", default="gpureg", help="the command")
    parser.add_argument("--extra", default="", help="more options of gpureg batch")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in arguments.domains.split(","):
        if name in SIMULATED:
            places = range(arguments.first, arguments.first + arguments.scenes)
            # Poses differ between scenes, too.
            scenes = [(SCENE_STEP * place, simulated(name, place)) for place in places]
        else:
            made = getattr(viewpoints, name)(
                arguments.data, arguments.pairs, np.random.default_rng(0)
            )
            scenes = [(0, scene) for scene in made]
        pairs = []
        for seed in arguments.seeds:
            for number, (step, scene) in enumerate(scenes):
                conditions = arguments.conditions.split(",")
                if name in SIMULATED:  # one after the other
                    conditions = [conditions[number % len(conditions)]]
                for condition in conditions:
                    new = evidence_of(
                        arguments.gpureg, scene, condition, step + seed, arguments.extra.split()
                    )
                    for pair in new:
                        pair["scene"] = number
                    pairs += new
                print(name, seed, number, summary(pairs), flush=True)
            (arguments.out / f"{name}.json").write_text(json.dumps({"pairs": pairs}) + "\n")


if __name__ == "__main__":
    main()
