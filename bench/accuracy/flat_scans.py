#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Scans of 2-D scanners: recall, precision and calibration over all pairs of folders of scans.

Generates buildings (`gpureg generate --scan-step`), some to fit the confidence, others to measure, and
measures real scans, where FOLDERs are given: cloud_bin_<i>.ply and poses.txt (carmen_scans.py makes them of
a log of CARMEN). A pair counts as overlapping where 30 % of the points of a scan have a point of the other
one within 0.15 m under the true poses. A pose is correct where it moves the source by at most 0.2 m RMS
(real scans: 0.3 m, as their poses are estimates).

usage: flat_scans.py [FOLDER...] [--seeds 1 2 3] [--scans 16] [--work DIR] [-o FILE]
       flat_scans.py --header src/confidence/confidence_model.hpp [--work DIR]    fits only
Needs numpy; --header: what fit_confidence.py needs."""

import functools
import json
import pathlib
import shutil
import sys
import tempfile

import numpy as np
import record

# name: building, seed, degrees between readings, field of view, range in metres, sigma in metres
FIT = {
    "house 11": ("", 11, 0.5, 360, 12, 0.01),
    "house 12": ("", 12, 0.25, 270, 30, 0.01),
    "house 13": ("", 13, 1.0, 360, 12, 0.02),
    "house 14": ("", 14, 0.5, 270, 10, 0.02),
    "office 15": ("office", 15, 0.5, 360, 12, 0.01),
    "office 16": ("office", 16, 0.25, 270, 20, 0.01),
    "warehouse 17": ("warehouse", 17, 0.5, 360, 20, 0.01),
}
MEASURED = {
    "house 21": ("", 21, 0.5, 360, 12, 0.01),
    "house 22": ("", 22, 0.25, 270, 30, 0.01),
    "house 23": ("", 23, 1.0, 360, 12, 0.02),
    "office 24": ("office", 24, 0.5, 360, 12, 0.01),
    "warehouse 25": ("warehouse", 25, 0.25, 270, 30, 0.01),
}
FRAMES = 200  # of a walk between scans: about 3 m
NEAR, OVERLAP = 0.15, 0.3
CORRECT, CORRECT_REAL = 0.2, 0.3  # metres


def read_ply(path):
    raw = path.read_bytes()
    end = raw.find(b"end_header\n") + len(b"end_header\n")
    return np.frombuffer(raw, "<f4", offset=end).reshape(-1, 3).astype(float)


def read_poses(path):
    rows = [line.split() for line in path.read_text().splitlines() if line.strip()]
    return {int(rows[k][0]): np.array(rows[k + 1 : k + 5], float) for k in range(0, len(rows), 5)}


def moved(pose, points):
    return points @ pose[:3, :3].T + pose[:3, 3]


def share_near(a, b):
    """Share of the points of a with a point of b within NEAR."""
    near = 0
    for part in np.array_split(a, len(a) // 500 + 1):
        squared = ((part[:, None, :2] - b[None, :, :2]) ** 2).sum(-1)
        near += (squared.min(1) <= NEAR**2).sum()
    return near / len(a)


@functools.cache
def truth_of(folder):
    """Scans, and (i_from_j, overlap) of all pairs i < j."""
    poses = read_poses(folder / "poses.txt")
    scans = {k: read_ply(folder / f"cloud_bin_{k}.ply") for k in poses}
    world = {k: moved(poses[k], scans[k]) for k in poses}
    pairs = {}
    for i in poses:
        for j in poses:
            if i < j:
                overlap = max(share_near(world[i], world[j]), share_near(world[j], world[i]))
                pairs[i, j] = np.linalg.inv(poses[i]) @ poses[j], overlap
    return scans, pairs


def batch(arguments, folder, seed, result, *words):
    """All pairs of a folder into a JSON file, with every best candidate."""
    with tempfile.TemporaryDirectory() as temporary:
        log = pathlib.Path(temporary) / "pairs.log"
        record.gpureg(
            arguments, "batch", folder, "-o", log, "--json", result,
            "--voxel-size", arguments.voxel_size, "--seed", seed, "--min-score", 0, "--quiet",
            "--backend", arguments.backend, *words,
        )  # fmt: skip


def results(arguments, folder, seed, *words):
    """All pairs of a folder, as rows: confidence, correct, overlapping, log odds of the confidence."""
    limit = CORRECT_REAL if folder in arguments.folders else CORRECT
    scans, truth = truth_of(folder)
    with tempfile.TemporaryDirectory() as temporary:
        result = pathlib.Path(temporary) / "pairs.json"
        batch(arguments, folder, seed, result, *words)
        pairs = json.loads(result.read_text())["pairs"]
    rows = []
    for pair in pairs:
        i_from_j, overlap = truth[pair["i"], pair["j"]]
        correct = False
        if pair["T_ij"] is not None:
            found = np.array(pair["T_ij"]).reshape(4, 4)
            points = scans[pair["j"]]
            error = moved(found, points) - moved(i_from_j, points)
            correct = np.sqrt((error**2).sum(1).mean()) <= limit
        rows.append((pair["score"], correct, overlap >= OVERLAP, pair["ms"]["total"]))
    return rows


def figures(rows):
    score, correct, positive, ms = np.array(rows, float).T
    correct, positive = correct > 0, positive > 0
    # What is correct with less overlap is neither counted for nor against.
    judged = positive | ~correct
    order = np.argsort(-score[judged], kind="stable")
    hits = np.cumsum((correct & positive)[judged][order])
    precision = hits / np.arange(1, len(hits) + 1)
    enough = np.flatnonzero(precision >= 0.95)
    reported, sure = score >= 0.5, score > 0.9

    def within(low, high):
        return (score > low) & (score <= high)

    return {
        "pairs": len(score),
        "overlapping": int(positive.sum()),
        "best_candidate_correct": float((correct & positive).sum() / positive.sum()),
        "recall": float((correct & positive & reported).sum() / positive.sum()),
        "precision": float(correct[reported].mean()) if reported.any() else None,
        "recall_at_95": float(hits[enough[-1]] / positive.sum()) if len(enough) else 0.0,
        "above_0.9": int(sure.sum()),
        "correct_above_0.9": float(correct[sure].mean()) if sure.any() else None,
        "calibration": [
            [high, int(within(low, high).sum()), float(score[within(low, high)].mean()),
             float(correct[within(low, high)].mean())]
            for low, high in ((-1, 0.1), (0.1, 0.3), (0.3, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1))
            if within(low, high).any()
        ],
        "median_ms": float(np.median(ms)),
    }  # fmt: skip


def fit(arguments, generated):
    """Fits the regressions of 2-D scans to buildings, and prints figures of each by a fit on the others."""
    import fit_confidence

    every = {name: [] for name in fit_confidence.FLAT_MODELS}
    for name, how in FIT.items():
        folder = generated(name, *how)
        for model in every:
            result = folder / f"{model}.json"
            if result.exists():
                pass
            elif model == "flat":
                batch(arguments, folder, 1, result)
            else:
                with tempfile.TemporaryDirectory() as temporary:
                    unknown = pathlib.Path(temporary) / "scans"
                    shutil.copytree(folder, unknown, ignore=shutil.ignore_patterns("cameras.txt"))
                    batch(arguments, unknown, 1, result, "--viewpoint", "none")
            every[model].append(fit_confidence.Run(name, folder, result))
    models = {}
    for name, runs in every.items():
        model = fit_confidence.FLAT_MODELS[name]
        for run in runs:
            others = [other for other in runs if other is not run]
            found = fit_confidence.figures(run, model, fit_confidence.fit(others, [], model))
            print(name, run.name, fit_confidence.text_of(found), flush=True)
        models[name] = fit_confidence.fit(runs, [], model)
    fit_confidence.write_header(arguments.header, models)


def main():
    parser = record.parser(__doc__, "flat_scans.json")
    parser.add_argument("folders", nargs="*", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--scans", type=int, default=16, help="of each building")
    parser.add_argument("--voxel-size", default="auto")
    parser.add_argument("--work", type=pathlib.Path, help="folder of the generated scans, kept")
    parser.add_argument("--header", type=pathlib.Path)
    arguments = parser.parse_args()
    work = arguments.work or pathlib.Path(tempfile.mkdtemp())

    def generated(name, building, seed, step, field, distance, noise):
        folder = work / name.replace(" ", "_")
        if not (folder / "gt.log").exists():
            words = ["--building", building] if building else []
            record.gpureg(
                arguments, "generate", folder, "--fragments", arguments.scans, "--seed", seed,
                "--frames-per-fragment", FRAMES, "--scan-step", step, "--scan-field", field,
                "--scan-range", distance, "--scan-noise", noise, "--quiet", *words,
            )  # fmt: skip
        return folder

    if arguments.header:
        fit(arguments, generated)
        return
    folders = {name: generated(name, *how) for name, how in MEASURED.items()}
    folders.update({folder.name: folder for folder in arguments.folders})
    rows = {name: [] for name in folders}
    real = [name for name, folder in folders.items() if folder in arguments.folders]
    command = " ".join(["bench/accuracy/flat_scans.py", *real])
    for k, seed in enumerate(arguments.seeds):
        for name, folder in folders.items():
            rows[name] += results(arguments, folder, seed)
            print(seed, name, json.dumps(figures(rows[name])), flush=True)
        sets = [{"set": name, "real": name in real, **figures(rows[name])} for name in rows]
        every = [row for name in rows if name not in real for row in rows[name]]
        content = {"seeds": arguments.seeds[: k + 1], "sets": sets, "generated": figures(every)}
        record.write(arguments, command, content)


if __name__ == "__main__":
    sys.exit(main())
