#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Scans of 2-D scanners: recall, precision and calibration over all pairs of folders of scans.

Generates buildings (`gpureg generate --scan-step`), and tests each by a fit of the confidence on the others, with
the viewpoints of the scanner and without any; a pose is correct by Redwood's 0.2 m rule, and pairs that overlap by
30 % count. Then real scans, by the command's own confidence, where FOLDERs are given: cloud_bin_<i>.ply and poses.txt
(carmen_scans.py makes them of a log of CARMEN); without, those of the record stay, with their commit. There a pair overlaps where 30 % of the points of a scan have a point of the other one within
0.15 m, and a pose is correct where it moves the source by at most 0.3 m RMS, as the true poses are estimates.

usage: run.py [FOLDER...] [--seeds 1 2 3] [--work DIR] [--header FILE] [-o FILE]
--header: src/confidence/confidence_model.hpp gets a fit on all buildings. Needs what fit_confidence.py needs."""

import functools
import json
import pathlib
import shutil
import sys
import tempfile

import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "accuracy"))
import record

# name: building, seed, degrees between readings, field of view, range in metres, sigma in metres
BUILDINGS = {
    "house 11": ("", 11, 0.5, 360, 12, 0.01),
    "house 12": ("", 12, 0.25, 270, 30, 0.01),
    "house 13": ("", 13, 1.0, 360, 12, 0.02),
    "house 14": ("", 14, 0.5, 270, 10, 0.02),
    "office 15": ("office", 15, 0.5, 360, 12, 0.01),
    "office 16": ("office", 16, 0.25, 270, 20, 0.01),
    "warehouse 17": ("warehouse", 17, 0.5, 360, 20, 0.01),
}
FRAMES = 200  # of a walk between scans: about 3 m
NEAR, OVERLAP, CORRECT = 0.15, 0.3, 0.3  # metres, share, metres


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
            "--voxel-size", arguments.voxel_size, "--seed", seed, "--min-confidence", 0, "--quiet",
            "--backend", arguments.backend, *words,
        )  # fmt: skip


def results(arguments, folder, seed, *words):
    """All pairs of a folder, as rows: confidence, correct, overlapping, log odds of the confidence."""
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
            correct = np.sqrt((error**2).sum(1).mean()) <= CORRECT
        rows.append((pair["confidence"], correct, overlap >= OVERLAP, pair["ms"]["total"]))
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


def left_out(run, model, regressions):
    """Rows of a building by regressions that were not fitted to it."""
    import fit_confidence

    best, confidence, _ = fit_confidence.confidences(run, model, regressions)
    rows = {pair: (0.0, False, overlap, 0.0) for pair, overlap in enumerate(run.in_truth)}
    for mode, score in zip(best, confidence):
        pair = run.pair[mode]
        rows[pair] = (score, run.correct[mode], run.in_truth[pair], 0.0)
    return list(rows.values())


def generated_sets(arguments, work):
    """Figures of every generated building by a fit on the others, of every kind of building, and the fits on all.
    A fit takes the runs of the first seed.
    """
    import fit_confidence

    from confidence import regressions

    every = {name: {} for name in regressions.FLAT_MODELS}
    for name, (building, seed, step, field, distance, noise) in BUILDINGS.items():
        folder = work / name.replace(" ", "_")
        if not (folder / "gt.log").exists():
            words = ["--building", building] if building else []
            record.gpureg(
                arguments, "generate", folder, "--fragments", arguments.scans, "--seed", seed,
                "--frames-per-fragment", FRAMES, "--scan-step", step, "--scan-field", field,
                "--scan-range", distance, "--scan-noise", noise, "--quiet", *words,
            )  # fmt: skip
        for model in every:
            for seed in arguments.seeds:
                result = folder / f"{model}_{seed}.json"
                if result.exists():
                    pass
                elif model == "flat":
                    batch(arguments, folder, seed, result)
                else:
                    with tempfile.TemporaryDirectory() as temporary:
                        unknown = pathlib.Path(temporary) / "scans"
                        ignored = shutil.ignore_patterns("cameras.txt")
                        shutil.copytree(folder, unknown, ignore=ignored)
                        batch(arguments, unknown, seed, result, "--viewpoint", "none")
                run = fit_confidence.Run(name, folder, result)
                every[model].setdefault(name, []).append(run)
    sets, kinds, models = [], [], {}
    for name, buildings in every.items():
        model = regressions.FLAT_MODELS[name]
        known = "given" if name == "flat" else "none"
        of_kind = {}
        for building, runs in buildings.items():
            others = [of[0] for other, of in buildings.items() if other != building]
            fitted = fit_confidence.fit(others, [], model)
            rows = [row for run in runs for row in left_out(run, model, fitted)]
            sets.append({"set": building, "viewpoints": known, "real": False, **figures(rows)})
            print(json.dumps(sets[-1]), flush=True)
            of_kind.setdefault(building.split()[0], []).append(rows)
        for kind, each in of_kind.items():
            text = f"{len(each)} {kind}s" if len(each) > 1 else kind
            kinds.append(
                {
                    "set": text,
                    "viewpoints": known,
                    **figures([row for rows in each for row in rows]),
                }
            )
        models[name] = fit_confidence.fit([of[0] for of in buildings.values()], [], model)
    return sets, kinds, models


def recorded(path):
    """The real sets of a record, with the commit that made them."""
    if not path.exists():
        return []
    record = json.loads(path.read_text())
    return [{"commit": record["commit"], **of} for of in record["sets"] if of["real"]]


def main():
    parser = record.parser(__doc__, "flat_scans.json")
    parser.add_argument("folders", nargs="*", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="of the alignments")
    parser.add_argument("--scans", type=int, default=24, help="of each building")
    parser.add_argument("--voxel-size", default="0.1")
    parser.add_argument("--work", type=pathlib.Path, help="folder of the generated scans, kept")
    parser.add_argument("--header", type=pathlib.Path, help="confidence_model.hpp to write")
    arguments = parser.parse_args()
    work = arguments.work or pathlib.Path(tempfile.mkdtemp())
    sets, kinds, models = generated_sets(arguments, work)
    if arguments.header:
        from confidence import model_header

        model_header.write_header(arguments.header, models)
    for folder in arguments.folders:
        of = [row for seed in arguments.seeds for row in results(arguments, folder, seed)]
        sets.append({"set": folder.name, "real": True, **figures(of)})
        print(json.dumps(sets[-1]), flush=True)
    if not arguments.folders:
        sets += recorded(arguments.output)
    command = ["bench/flat_scans/run.py", *(folder.name for folder in arguments.folders)]
    command += ["--seeds", *map(str, arguments.seeds)]
    content = {"seeds": arguments.seeds, "sets": sets, "generated": kinds}
    record.write(arguments, " ".join(command), content)


if __name__ == "__main__":
    sys.exit(main())
