#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What `gpureg calibrate` does to the confidence outside of the rooms that it was fitted on.

For each kind of data two folders of the same sensor: the calibration is made from the first one,
without truth, and its error is measured by truth on the pairs of both. Kinds: rooms3 (generated
rooms, three times the errors of the depth camera), street, hall, parts (domain_scenes.py). Error:
expected calibration error of the most confident pose of each pair, ten equal bins. expected_error: what
it would be if every confidence were the true probability.

usage: calibrate.py WORK [--kinds rooms3,street,hall,parts] [--gpureg COMMAND] [-o RECORD]
Folders and results in WORK are used again. Needs numpy, and what domain_scenes.py needs."""

import json
import pathlib
import sys

import numpy as np
import record

ROOM_SEEDS = {"first": [21], "second": [22]}
SCENES = {  # numbers of scenes in each folder, and the seed of the first one
    "street": (4, 1001, 2001),
    "hall": (8, 1001, 2001),
    "parts": (5, 1001, 2001),
}
PART_SIZE = 0.3  # metres: parts of one folder have one size, as one sensor sees
KINDS = ("rooms3", "street", "hall", "parts")
NOISE = 3  # of the depth camera in rooms3


def write_ply(path, points):
    points = np.ascontiguousarray(points, "<f4")
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    head += "property float x\nproperty float y\nproperty float z\nend_header\n"
    path.write_bytes(head.encode() + points.tobytes())


def simulated(kind, which, folder):
    """Scenes of domain_scenes.py as one folder, with pairs.json: pairs, truths and tolerances."""
    import domain_scenes

    count, *firsts = SCENES[kind]
    first = firsts[which == "second"]
    folder.mkdir(parents=True)
    number, listed, cameras = 0, [], []
    for seed in range(first, first + count):
        scene = domain_scenes.SCENES[kind](seed)
        models = [s.model for s in scene.scans if s.model is not None]
        scale = PART_SIZE / max(np.ptp(m.vertices, axis=0).max() for m in models) if models else 1.0

        def scaled(pose, scale=scale):
            out = np.array(pose, np.float64)
            out[:3, 3] *= scale
            return out

        for k, scan in enumerate(scene.scans):
            name = folder / f"cloud_bin_{number + k}"
            if scan.model is None:
                write_ply(name.with_suffix(".ply"), scan.points * scale)
                cameras.append(f"{number + k} 0 0 0 0 0 0 0 1")
            else:
                model = scan.model.copy()
                model.apply_scale(scale)
                model.export(name.with_suffix(".stl"))
        for source, target in scene.pairs:
            s, t = scene.scans[source], scene.scans[target]
            truths = [
                scaled(pose).ravel().tolist()
                for pose in domain_scenes.truths(scene, source, target)
            ]
            cloud = s if s.model is None else t
            middle = (cloud.points if cloud is s else s.model.vertices).mean(0) * scale
            listed.append(
                {
                    "source": number + source,
                    "target": number + target,
                    "truths": truths,
                    "middle": middle.tolist(),
                    "degrees": scene.degrees,
                    "distance": scene.distance * scale,
                }
            )
        number += len(scene.scans)
    (folder / "cameras.txt").write_text("\n".join(cameras) + "\n")
    (folder / "pairs.json").write_text(json.dumps(listed))


def make(arguments, kind, which):
    folder = arguments.work / f"{kind}_{which}"
    if folder.exists():
        return folder
    if kind in SCENES:
        simulated(kind, which, folder)
    else:
        (seed,) = ROOM_SEEDS[which]
        record.gpureg(
            arguments, "generate", folder, "--seed", seed, "--depth-noise", NOISE, "--quiet"
        )
    return folder


def angle(a, b):
    cosine = (np.trace(a[:3, :3].T @ b[:3, :3]) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def blocks(path, size):
    """Entries of a Redwood log (size 4) or information file (size 6) by pair."""
    rows = [line.split() for line in path.read_text().splitlines() if line.strip()]
    return {
        (int(rows[k][0]), int(rows[k][1])): np.array(rows[k + 1 : k + 1 + size], np.float64)
        for k in range(0, len(rows), size + 1)
    }


def redwood_verdicts(folder):
    """Verdict on a pose by Redwood's measure: 0.2 m, whatever the overlap; None without a pair."""
    truth, weight = blocks(folder / "gt_all.log", 4), blocks(folder / "gt_all.info", 6)

    def verdict(i, j, pose):
        if j - i < 2:
            return None  # neighbours in time do not count
        if (i, j) not in truth:
            return False
        e = np.linalg.inv(truth[i, j]) @ pose
        q = 0.5 * np.array([e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1]])
        w = np.sqrt(max(1e-12, 1 + np.trace(e[:3, :3]))) / 2
        x = np.concatenate([e[:3, 3], q / (2 * w)])
        x[3:] *= -1  # the sign of Redwood's quaternion vector
        information = weight[i, j]
        return bool(x @ information @ x / information[0, 0] <= 0.2**2)

    return verdict


def listed_verdicts(folder):
    pairs = {}
    for p in json.loads((folder / "pairs.json").read_text()):
        i, j = sorted((p["source"], p["target"]))
        pairs[i, j] = p

    def verdict(i, j, pose):  # pose: j into i
        p = pairs[i, j]
        if p["source"] == i:
            pose = np.linalg.inv(pose)
        middle = np.array(p["middle"])
        for t in p["truths"]:
            t = np.array(t).reshape(4, 4)
            moved = (pose - t)[:3, :3] @ middle + (pose - t)[:3, 3]
            if angle(pose, t) < p["degrees"] and np.linalg.norm(moved) < p["distance"]:
                return True
        return False

    return verdict


def results_of(arguments, kind, folder, voxel_size, calibration):
    """Confidence of the most confident pose of each pair, and whether it is correct."""
    name = folder.name + ("_calibrated" if calibration else "_plain")
    output = arguments.work / f"{name}.json"
    if not output.exists():
        words = ["batch", folder, "--voxel-size", voxel_size, "--quiet", "-o", f"{output}.log"]
        words += ["--json", output, "--backend", arguments.backend, "--restart"]
        if kind in SCENES:
            listed = json.loads((folder / "pairs.json").read_text())
            lines = [f"{p['target']} {p['source']}\n" for p in listed]
            (arguments.work / f"{folder.name}.pairs").write_text("".join(lines))
            words += ["--pairs", arguments.work / f"{folder.name}.pairs"]
        if calibration:
            words += ["--calibration", calibration]
        record.gpureg(arguments, *words)
    verdict_of = (listed_verdicts if kind in SCENES else redwood_verdicts)(folder)
    out = []
    for pair in json.loads(output.read_text())["pairs"]:
        if pair["T_ij"] is None:
            continue
        verdict = verdict_of(pair["i"], pair["j"], np.array(pair["T_ij"]).reshape(4, 4))
        if verdict is not None:
            out.append((pair["confidence"], verdict))
    return np.array(out, np.float64)


def calibration_error(results):
    confidence, correct = results[:, 0], results[:, 1]
    bins = np.minimum((confidence * 10).astype(int), 9)
    return sum(abs((confidence - correct)[bins == b].sum()) for b in range(10)) / len(results)


def expected_error(results):
    """Mean error that the same confidences would have if each were the true probability: so few
    pairs have an error even then.
    """
    rng = np.random.default_rng(1)
    confidence = results[:, 0]
    draws = (rng.random(len(confidence)) < confidence for _ in range(1000))
    return np.mean([calibration_error(np.column_stack([confidence, d])) for d in draws])


def measured(results):
    reported = results[:, 0] >= 0.5
    correct = results[:, 1] > 0
    return {
        "pairs": len(results),
        "correct": int(correct.sum()),
        "reported": int((reported & correct).sum()),
        "reported_false": int((reported & ~correct).sum()),
        "error": round(float(calibration_error(results)), 4),
        "expected_error": round(float(expected_error(results)), 4),
    }


def main():
    parser = record.parser(__doc__, "calibration.json")
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--kinds", default=",".join(KINDS))
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    kinds = {}
    for kind in arguments.kinds.split(","):
        if kind not in KINDS:
            sys.exit(f"error: there is no kind {kind}")
        folders = {which: make(arguments, kind, which) for which in ("first", "second")}
        calibration = arguments.work / f"{kind}_calibration.json"
        if not calibration.exists():
            voxel = 0.05 if kind == "rooms3" else "auto"
            words = ["calibrate", folders["first"], "-o", calibration, "--voxel-size", voxel]
            record.gpureg(arguments, *words, "--backend", arguments.backend, "--quiet")
        document = json.loads(calibration.read_text())
        kinds[kind] = {
            "calibration": {
                k: document[k]
                for k in ("slope", "offset", "voxel_size", "samples", "calibration_error")
            }
        }
        for which, folder in folders.items():
            plain = results_of(arguments, kind, folder, document["voxel_size"], None)
            scaled = results_of(arguments, kind, folder, document["voxel_size"], calibration)
            kinds[kind][which] = {"before": measured(plain), "after": measured(scaled)}
            before, after = kinds[kind][which].values()
            print(
                f"{kind:8} {which:7} {before['pairs']:4} pairs, {before['correct']:4} correct: error "
                f"{before['error']:.3f} -> {after['error']:.3f}, reported {before['reported']} + "
                f"{before['reported_false']} false -> {after['reported']} + {after['reported_false']}",
                flush=True,
            )
    record.write(arguments, "bench/accuracy/calibrate.py WORK", {"kinds": kinds})


if __name__ == "__main__":
    main()
