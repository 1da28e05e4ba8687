#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Maps of scans of which each has an unknown scale of its own, beside the map of the same scans with known scales.

`kitchen`, `house_a`: scans of the data folder, each divided by a random factor: 0.05 to 20 (`free`), or 0.8 to 1.25
(`drift`), of which the range is then given. `chunks`: a generated room (photogrammetry.py); its laser scan, and three
clouds that COLMAP and semi-global matching make of three halves of its pictures, each with a scale and noise of its own.
Figures: scans `placed` in the largest island; `error`: RMS distance of points from their true places after one similarity
(Umeyama 1991) of the island, in the unit of the truth (m); `scales`: RMS and largest error of the scans' scales to each
other (%); `wrong` edges: accepted, off by more than 0.35 m or 8 degrees.

usage: maps.py [--data DATA] [--cache FOLDER] [--sets kitchen,house_a,chunks] [--seeds 1 2 3] [--conditions free,drift]
               [--every 1] [--json OUT]
Needs numpy and the Python package gpureg; `chunks` what photogrammetry.py needs."""

import json
import os
import pathlib
import sys
import time

import gpureg
import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "accuracy"))
from map_rmse import FAR_DEGREES, FAR_METRES, angle, read_poses
from photogrammetry import cameras_of, dense, umeyama
from record import commit, plain_parser, processor, save

FOLDERS = {"kitchen": "redkitchen/fragments", "house_a": "house/A"}
FACTORS = {"free": (0.05, 20), "drift": (0.8, 1.25)}
CHUNKS, PICTURES = 3, 18


def scans_of(folder, every):
    """Clouds and world_from_scan."""
    fragments = gpureg.FragmentSet.from_directory(folder)
    truth, options = read_poses(folder / "poses.txt"), gpureg.RegistrationOptions()
    chosen = range(0, len(fragments), every)
    clouds = [np.asarray(fragments.load(k, options)[0], np.float64) for k in chosen]
    return clouds, [truth[fragments.numbers[k]] for k in chosen]


def chunks_of(cache, seed):
    """The laser scan and the chunks, and world_from_scan with the scale in it."""
    import cv2
    import places

    path = cache / f"chunks_{seed}.npz"
    if not path.exists():
        rng = np.random.default_rng([list(places.KINDS).index("room"), seed])
        place = places.KINDS["room"](rng)
        scene = place.scene()
        out = {"cloud_0": places.laser(place, scene, rng), "pose_0": np.eye(4)}
        pictures = list(places.pictures(place, scene, rng))
        for chunk in range(CHUNKS):
            folder = cache / f"chunk_{seed}_{chunk}"
            folder.mkdir(parents=True, exist_ok=True)
            first, images = chunk * len(pictures) // CHUNKS, {}
            for k in (np.arange(first, first + PICTURES) % len(pictures)).tolist():
                images[f"{k:03}.png"] = pictures[k]
                cv2.imwrite(str(folder / f"{k:03}.png"), pictures[k])
            views, lens, points = cameras_of(folder, sorted(images))
            cloud, _ = dense(images, views, lens, points)
            kept = np.random.default_rng(chunk).permutation(len(cloud))[:200_000]
            found = np.array([-turn.T @ shift for _, turn, shift, _ in views])
            true = np.array([place.cameras[int(name[:3])][1] for name, *_ in views])
            scale, turn, shift = umeyama(found, true)
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = scale * turn, shift
            out |= {f"cloud_{chunk + 1}": cloud[kept], f"pose_{chunk + 1}": pose}
        np.savez(path, **out)
    data = np.load(path)
    numbers = range(CHUNKS + 1)
    return [data[f"cloud_{k}"] for k in numbers], [data[f"pose_{k}"] for k in numbers]


def figures(found, clouds, poses, scales):
    """Of the largest island. clouds as given to the map; poses: true world_from_cloud, with scales."""
    out = {"scans": len(clouds), "placed": 0, "islands": [len(i) for i in found.islands]}
    if not found.islands:
        return out
    island = found.islands[0]
    points = {k: clouds[k][:: max(1, len(clouds[k]) // 300)] for k in island}
    at = {
        k: scales[k] * points[k] @ found.poses[k, :3, :3].T + found.poses[k, :3, 3] for k in island
    }
    true = {k: points[k] @ poses[k][:3, :3].T + poses[k][:3, 3] for k in island}
    a, b = (np.concatenate([of[k] for k in island]) for of in (at, true))
    scale, turn, shift = umeyama(a, b)
    error = np.linalg.norm(scale * a @ turn.T + shift - b, axis=1)
    size = np.array([np.cbrt(np.linalg.det(poses[k][:3, :3])) for k in range(len(clouds))])
    ratio = np.log(scales[island] * scale / size[island])
    wrong = 0
    for edge in found.edges:
        if not edge.accepted:
            continue
        s, t = edge.source, edge.target
        truth = np.linalg.inv(poses[t]) @ poses[s]
        pose = edge.target_from_source.copy()
        pose[:3, :3] *= scales[s]
        pose[:3] /= scales[t]
        centre = np.append(clouds[s].mean(0), 1)
        metres = np.linalg.norm(((pose - truth) @ centre)[:3]) * size[t]
        turned = angle((truth[:3, :3] * size[t] / size[s]).T @ pose[:3, :3] * scales[t] / scales[s])
        wrong += bool(metres > FAR_METRES or turned > FAR_DEGREES)
    return out | {
        "placed": len(island),
        "edges": sum(edge.accepted for edge in found.edges),
        "wrong": wrong,
        "error": round(float(np.sqrt((error**2).mean())), 4),
        "scales": [round(100 * float(v), 3) for v in (ratio.std(), np.abs(ratio).max())],
    }


def run(clouds, poses, condition, seed, context):
    rng = np.random.default_rng(seed)
    factors = np.exp(rng.uniform(*np.log(FACTORS[condition]), len(clouds)))
    factors[0] = 1  # the unit of the truth
    given = [(cloud / f).astype(np.float32) for cloud, f in zip(clouds, factors)]
    moved = []
    for pose, factor in zip(poses, factors):
        scale = np.eye(4)
        scale[:3, :3] *= factor
        moved.append(pose @ scale)
    least, most = FACTORS[condition]
    sizes = np.array([np.cbrt(np.linalg.det(pose[:3, :3])) for pose in moved])
    searched, steps = [0], []
    begin = time.perf_counter()

    def told(done, total):
        steps.append((done, total))

    found = gpureg.reconstruct(
        given,
        scale="free" if condition == "free" else (least / most, most / least),
        context=context,
        progress=told,
    )
    seconds = time.perf_counter() - begin
    pairs = len(clouds) * (len(clouds) - 1) // 2
    searched = next(k for k, step in enumerate(steps) if step == (pairs, pairs))
    entry = {"condition": condition, "seed": seed, "searched": searched, "pairs": pairs}
    entry |= figures(found, given, moved, found.scales) | {"seconds": round(seconds, 1)}
    begin = time.perf_counter()
    known = sizes / sizes[0]
    plain = gpureg.reconstruct([c * s for c, s in zip(given, known)], context=context)
    entry["known"] = figures(plain, given, moved, known)
    entry["known"]["seconds"] = round(time.perf_counter() - begin, 1)
    return entry


def main():
    parser = plain_parser(__doc__)
    parser.add_argument("--data", type=pathlib.Path, default=os.environ.get("GPUREG_DATA_DIR"))
    parser.add_argument("--cache", type=pathlib.Path, help="folder of pictures and clouds")
    parser.add_argument("--sets", default="kitchen,house_a")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--conditions", default="free,drift")
    parser.add_argument("--every", type=int, default=1, help="only every so many scans")
    parser.add_argument("--json", type=pathlib.Path)
    arguments = parser.parse_args()
    context = gpureg.Context.cpu()
    record = {"rows": []}
    if arguments.json and arguments.json.exists():
        record = json.loads(arguments.json.read_text())
    for name in arguments.sets.split(","):
        for seed in arguments.seeds:
            if name == "chunks":
                clouds, poses = chunks_of(arguments.cache, seed)
            else:
                clouds, poses = scans_of(arguments.data / FOLDERS[name], arguments.every)
            for condition in arguments.conditions.split(","):
                row = {"set": name, "every": 1 if name == "chunks" else arguments.every}
                row |= run(clouds, poses, condition, seed, context)
                row |= {"commit": commit(), "processor": processor()}
                print(json.dumps(row), flush=True)
                key = ("set", "every", "condition", "seed")
                record["rows"] = [r for r in record["rows"] if any(r[k] != row[k] for k in key)] + [
                    row
                ]
                if arguments.json:
                    save(arguments.json, record)


if __name__ == "__main__":
    main()
