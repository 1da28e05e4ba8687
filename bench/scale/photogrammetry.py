#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Photogrammetric clouds, of an unknown scale, against laser scans of the same place.

Pictures of a generated place (places.py) are rendered: `room`, furnished; `flat`: two rooms and a doorway; `corner`: a
flat, 25 pictures of a part of one room; `house`: from outside. COLMAP finds cameras and lens from the pictures alone.
Semi-global matching of rectified pairs makes the points: with noise, wrong surfaces, and holes where a surface has no
texture. The target is a terrestrial scan of the place.
The true similarity is that from COLMAP's camera centres to the true ones. `truth`: its `residual` (m), the standard
`deviation` of its scale (jackknife, %), `surface`: by how much the cloud's points lie too far from their cameras after it
(median, %), the `noise` of these distances (%), the share that is `off` by 5 % or more, and the share of the scan that
the cloud has `covered`, within 0.1 m. An error of the scale below `deviation` and `surface` says nothing.
Conditions: `known` scale; `free`, both with automatic voxels. Free in one search: `one` in the voxel size of the scan;
`given`: with cameras and scanners as viewpoints, too; `none`: the cloud has no viewpoint; `sized`: in the voxel size that
both clouds suggest at the true scale.
A pose is `found` within 5 degrees and 0.2 m at the cloud's centre. `foreign`: the scan is of the next seed's place.

usage: photogrammetry.py --cache FOLDER [--kinds room,flat,corner,house] [--seeds 1,2,3] [--output ROWS]
       photogrammetry.py --record ROWS
Needs numpy, scipy, open3d, opencv-python, pycolmap and the Python package gpureg."""

import argparse
import itertools
import json
import pathlib
import sys
import time

import numpy as np
import scipy.spatial

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "bench/accuracy"))
from record import commit, processor, save

RECORD = ROOT / "bench/results/photogrammetry.json"
EXIF_ERROR = 1.03  # of the focal length that the pictures say
POINTS = 300_000  # of a photogrammetric cloud, at most
CONDITIONS = ("known", "free", "given", "sized", "none", "one")
DEGREES, METRES = 5, 0.2  # of a pose that is found


def cameras_of(folder, names):
    """Names, poses (rotation, translation) of the largest model, its lens, and the points that each picture sees."""
    import pycolmap
    from places import FOCAL, SIZE

    pycolmap.logging.minloglevel = 2
    database = folder / "database.db"
    database.unlink(missing_ok=True)
    reader = pycolmap.ImageReaderOptions()
    reader.camera_params = f"{FOCAL * EXIF_ERROR},{SIZE[0] / 2},{SIZE[1] / 2},0"
    extraction = pycolmap.FeatureExtractionOptions(num_threads=1, use_gpu=False)
    extraction.sift.max_num_features = 3000
    matching = pycolmap.FeatureMatchingOptions(num_threads=1, use_gpu=False)
    pycolmap.extract_features(
        database, folder, names, pycolmap.CameraMode.SINGLE, reader, extraction
    )
    pycolmap.match_exhaustive(database, matching)
    mapping = pycolmap.IncrementalPipelineOptions(num_threads=1, random_seed=1)
    models = pycolmap.incremental_mapping(database, folder, folder, mapping)
    model = max(models.values(), key=lambda m: m.num_reg_images())
    out = []
    for image in model.images.values():
        if image.has_pose:
            pose = image.cam_from_world().matrix()
            ids = {p.point3D_id for p in image.points2D if p.has_point3D()}
            out.append((image.name, pose[:, :3], pose[:, 3], ids))
    lens = next(iter(model.cameras.values())).params
    return sorted(out, key=lambda o: o[0]), lens, {k: p.xyz for k, p in model.points3D.items()}


def partner(views, k, points):
    """The picture that makes the best pair with views[k]: beside it, about 4 degrees apart, or none."""
    _, turn, shift, ids = views[k]
    best = None
    for j, (_, other, moved, seen) in enumerate(views):
        shared = list(ids & seen)
        if j == k or len(shared) < 40:
            continue
        at = np.array([points[i] for i in shared])
        to = turn @ (-other.T @ moved) + shift  # of the other's centre
        if abs(to[0]) < 2 * np.hypot(*to[1:]) or (turn @ other.T)[2, 2] < np.cos(np.radians(25)):
            continue
        a, b = at + turn.T @ shift, at + other.T @ moved
        cosine = (a * b).sum(1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
        angle = np.degrees(np.median(np.arccos(np.clip(cosine, -1, 1))))
        if 1 < angle < 10 and (best is None or abs(angle - 4) < best[0]):
            best = abs(angle - 4), j
    return None if best is None else best[1]


def depth_map(images, views, k, j, lens, points):
    """Depths by semi-global matching, checked from left to right, and the rectified camera."""
    import cv2

    left, right = views[k], views[j]
    turn = right[1] @ left[1].T
    shift = right[2] - turn @ left[2]
    mirrored = shift[0] > 0  # the other is on the left
    if mirrored:
        left, right, turn, shift = right, left, turn.T, -turn.T @ shift
    matrix = np.array([[lens[0], 0, lens[1] - 0.5], [0, lens[0], lens[2] - 0.5], [0, 0, 1]])
    bend, size = np.array([lens[3], 0, 0, 0]), images[left[0]].shape[::-1]
    r1, r2, p1, p2, *_ = cv2.stereoRectify(matrix, bend, matrix, bend, size, turn, shift[:, None])
    pair = [
        cv2.remap(
            images[v[0]], *cv2.initUndistortRectifyMap(matrix, bend, r, p, size, cv2.CV_32FC1), 1
        )
        for v, r, p in ((left, r1, p1), (right, r2, p2))
    ]
    product = -p2[0, 3]  # focal length times baseline
    known = np.array([points[i] for i in left[3] & right[3]])
    z = ((known @ left[1].T + left[2]) @ r1.T)[:, 2]
    low, high = np.percentile(product / z[z > 0], [1, 99])
    least = int(0.7 * low)
    count = int(np.ceil((1.4 * high - least) / 16)) * 16
    matcher = cv2.StereoSGBM_create(
        least, count, 5, 200, 800, 1, 31, 10, 100, 2, cv2.STEREO_SGBM_MODE_SGBM_3WAY
    )
    one = matcher.compute(*pair).astype(np.float32) / 16
    two = matcher.compute(*(np.ascontiguousarray(p[:, ::-1]) for p in pair[::-1]))
    two = two[:, ::-1].astype(np.float32) / 16
    v, u = np.indices(one.shape)
    opposite = two[v, np.clip(np.round(u - one).astype(int), 0, size[0] - 1)]
    good = (one > max(least, 1)) & (np.abs(one - opposite) <= 1)
    depth = np.where(good, product / np.maximum(one, 1e-3), np.nan)
    return depth, r1 @ left[1], r1 @ left[2], p1, left[0]


def dense(images, views, lens, points):
    """Points that a second depth map confirms within 2 %, and the number of the view of each."""
    maps = []
    for k in range(len(views)):
        j = partner(views, k, points)
        if j is not None:
            maps.append(depth_map(images, views, k, j, lens, points))
    centres = np.array([-m[1].T @ m[2] for m in maps])
    names = [v[0] for v in views]
    out, owner = [], []
    for k, (depth, turn, shift, p, name) in enumerate(maps):
        v, u = np.nonzero(np.isfinite(depth))
        keep = (u % 3 == 0) & (v % 3 == 0)
        u, v = u[keep], v[keep]
        z = depth[v, u]
        local = np.c_[(u - p[0, 2]) / p[0, 0] * z, (v - p[1, 2]) / p[1, 1] * z, z]
        world = (local - shift) @ turn
        agree = np.zeros(len(world), bool)
        near = np.argsort(np.linalg.norm(centres - centres[k], axis=1))
        for j in [j for j in near if maps[j][4] != name][:5]:
            other, r, t, q, _ = maps[j]
            x = world @ r.T + t
            with np.errstate(divide="ignore", invalid="ignore"):
                pixel = x[:, :2] / x[:, 2:] * q[0, 0] + q[:2, 2]
            inside = (x[:, 2] > 0) & (pixel > 0).all(1)
            inside &= (pixel < np.array(other.shape[::-1]) - 1).all(1)
            a, b = np.round(pixel[inside]).astype(int).T
            agree[np.nonzero(inside)[0]] |= np.abs(other[b, a] / x[inside, 2] - 1) < 0.02
        out.append(world[agree])
        owner.append(np.full(agree.sum(), names.index(name)))
    return np.concatenate(out), np.concatenate(owner)


def umeyama(a, b):
    """Scale, rotation, translation from a to b by least squares."""
    ca, cb = a.mean(0), b.mean(0)
    u, d, vt = np.linalg.svd((b - cb).T @ (a - ca))
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    turn = (u * sign) @ vt
    scale = (d * sign).sum() / ((a - ca) ** 2).sum()
    return scale, turn, cb - scale * turn @ ca


def made(cache, kind, seed):
    """Cloud and cameras of a place from its pictures, and its laser scan, from the cache or made."""
    import cv2
    import places

    path = cache / f"{kind}_{seed}.npz"
    if path.exists():
        return dict(np.load(path))
    rng = np.random.default_rng([list(places.KINDS).index(kind), seed])
    place = places.KINDS[kind](rng)
    scene = place.scene()
    scan = places.laser(place, scene, rng)
    folder = cache / f"{kind}_{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    images = {}
    for k, image in enumerate(places.pictures(place, scene, rng)):
        name = f"{k:03}.png"
        cv2.imwrite(str(folder / name), image)
        images[name] = image
    begin = time.perf_counter()
    views, lens, points = cameras_of(folder, list(images))
    cloud, owner = dense(images, views, lens, points)
    seconds = time.perf_counter() - begin
    kept = rng.permutation(len(cloud))[:POINTS]
    cloud, owner = cloud[kept], owner[kept]
    found = np.array([-turn.T @ shift for _, turn, shift, _ in views])
    true = np.array([place.cameras[int(name[:3])][1] for name, *_ in views])
    scale, turn, shift = umeyama(found, true)
    at = scale * cloud @ turn.T + shift
    direction = at - true[owner]
    length = np.linalg.norm(direction, axis=1)
    far, *_ = places.hits(scene, place, true[owner], direction / length[:, None])
    out = {
        "cloud": cloud,
        "cameras": found,
        "true_cameras": true,
        "scan": scan,
        "scanners": np.array(place.scanners),
        "error": length / far - 1,
        "pictures": len(images),
        "seconds": seconds,
        "focal": lens[0],
    }
    np.savez(path, **out)
    return out


def truth_of(data):
    """The true similarity as (scale, rotation, translation), and its errors."""
    a, b = data["cameras"], data["true_cameras"]
    scale, turn, shift = umeyama(a, b)
    each = np.log([umeyama(np.delete(a, k, 0), np.delete(b, k, 0))[0] for k in range(len(a))])
    error = data["error"][np.abs(data["error"]) < 0.2]
    residual = np.linalg.norm(scale * a @ turn.T + shift - b, axis=1)
    tree = scipy.spatial.cKDTree(scale * data["cloud"] @ turn.T + shift)
    gap = tree.query(data["scan"][:: len(data["scan"]) // 20000])[0]
    return (scale, turn, shift), {
        "residual": round(float(np.sqrt((residual**2).mean())), 4),
        "deviation": round(100 * float(np.sqrt((len(a) - 1) * each.var())), 3),
        "surface": round(100 * float(np.median(error)), 3),
        "noise": round(100 * 1.4826 * float(np.median(np.abs(error - np.median(error)))), 3),
        "covered": round(100 * float((gap < 0.1).mean()), 1),
        "off": round(100 * float((~(np.abs(data["error"]) < 0.05)).mean()), 2),
    }


def registered(gpureg, context, data, scan_of, rng, condition, truth):
    """One registration; data and scan are moved at random, and the scale of data is drawn, too."""
    from viewpoints import moved, random_pose

    factor = float(np.exp(rng.uniform(*np.log([0.05, 20]))))
    poses = [random_pose(rng, 5.0) for _ in range(2)]
    size = np.linalg.norm(np.ptp(data["cloud"], axis=0))
    source, cameras = (moved(poses[0], data[k] / size * factor) for k in ("cloud", "cameras"))
    target, scanners = (moved(poses[1], scan_of[k]) for k in ("scan", "scanners"))
    views = {
        "given": {"source_viewpoint": cameras, "target_viewpoint": scanners},
        "none": {"source_viewpoint": "none"},
    }
    scale, turn, shift = truth
    true_scale = scale * size / factor
    voxel = None
    if condition in ("one", "given", "none"):
        voxel = gpureg.suggest_voxel_size([target]).voxel_size
    if condition == "sized":
        voxel = gpureg.suggest_voxel_size([source * true_scale, target]).voxel_size
    begin = time.perf_counter()
    r = gpureg.register(
        source,
        target,
        voxel,
        scale=true_scale if condition == "known" else "free",
        context=context,
        **views.get(condition, {}),
    )
    row = {
        "condition": condition,
        "confidence": round(r.confidence, 4),
        "reported": bool(r.aligned),
        "status": r.scale_status,
        "seconds": round(time.perf_counter() - begin, 2),
        "scale_error": round(100 * (r.scale / true_scale - 1), 3) if r.scale > 0 else None,
        "deviation": round(100 * r.scale_deviation / r.scale, 3) if r.scale > 0 else None,
        "voxel": round(r.result.voxel_size, 4),
        "candidates": len(r.candidates),
        "viewpoints": f"{r.result.source_viewpoint}, {r.result.target_viewpoint}",
    }
    if r.result.has_pose:
        found = np.linalg.inv(poses[1]) @ r.target_from_source @ poses[0]
        rotation = found[:3, :3] / np.cbrt(np.linalg.det(found[:3, :3])) @ turn.T
        centre = data["cloud"].mean(0)
        at = found[:3, :3] @ (centre / size * factor) + found[:3, 3]
        angle = np.degrees(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))
        row["degrees"] = round(float(angle), 3)
        row["metres"] = round(float(np.linalg.norm(at - scale * turn @ centre - shift)), 4)
    row["found"] = row.get("degrees", 180) < DEGREES and row["metres"] < METRES
    return row


def median(values, digits=2):
    values = [v for v in values if v is not None]
    return round(float(np.median(values)), digits) if values else None


def record_of(rows):
    """Counts of each kind and condition, and every row."""
    out = {
        "command": "bench/scale/photogrammetry.py --record",
        "commit": ", ".join(sorted({r["commit"] for r in rows})),
        "processor": rows[0]["processor"],
        "groups": [],
        "rows": rows,
    }
    for kind in dict.fromkeys(r["kind"] for r in rows):
        for condition in CONDITIONS:
            of = [r for r in rows if r["kind"] == kind and r["condition"] == condition]
            own, foreign = ([r for r in of if r["foreign"] == f] for f in (False, True))
            found = [r for r in own if r["found"]]
            errors = [abs(r["scale_error"]) for r in found]
            entry = {
                "kind": kind,
                "condition": condition,
                "pairs": len(own),
                "found": len(found),
                "reported": sum(r["found"] and r["reported"] for r in own),
                "reported_wrong": sum(r["reported"] and not r["found"] for r in own),
                "within_1_percent": sum(e < 1 for e in errors),
                "scale_error": median(errors),
                "largest_scale_error": max(errors, default=None),
                "least_confidence": min((r["confidence"] for r in found), default=None),
                "foreign": len(foreign),
                "foreign_reported": sum(r["reported"] for r in foreign),
                "foreign_confidence": max((r["confidence"] for r in foreign), default=None),
                "covered": median([r["truth"]["covered"] for r in own], 1),
                "surface": median([abs(r["truth"]["surface"]) for r in own]),
                "noise": median([r["truth"]["noise"] for r in own]),
                "seconds": median([r["seconds"] for r in own]),
            }
            out["groups"].append(entry)
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kinds", default="room,flat,corner,house")
    parser.add_argument("--seeds", default="1,2,3")
    parser.add_argument("--draws", type=int, default=3, help="of scale and poses, for each pair")
    parser.add_argument("--cache", type=pathlib.Path, help="folder of pictures and clouds")
    parser.add_argument("--threads", type=int, default=1, help="of the registration")
    parser.add_argument("--output", type=pathlib.Path, help="a row a line; rows that it has stay")
    parser.add_argument(
        "--record",
        type=pathlib.Path,
        metavar="ROWS",
        help=f"write {RECORD.relative_to(ROOT)} from these rows; nothing is run",
    )
    arguments = parser.parse_args()
    if arguments.record:
        lines = arguments.record.read_text().splitlines()
        return save(RECORD, record_of([json.loads(line) for line in lines]))
    import gpureg

    context = gpureg.Context.cpu(arguments.threads)
    seeds, path = [int(s) for s in arguments.seeds.split(",")], arguments.output
    lines = path.read_text().splitlines() if path and path.exists() else []
    keys = ("kind", "seed", "draw", "foreign", "condition")
    done = {tuple(json.loads(line)[k] for k in keys) for line in lines}
    for kind in arguments.kinds.split(","):
        for place, seed in enumerate(seeds):
            data = made(arguments.cache, kind, seed)
            truth, errors = truth_of(data)
            print(
                f"{kind} {seed}: {len(data['cameras'])} of {data['pictures']} pictures, {len(data['cloud'])} points, "
                f"{float(data['seconds']):.0f} s; truth {json.dumps(errors)}",
                flush=True,
            )
            for foreign in (False, True):
                other = seeds[(place + 1) % len(seeds)] if foreign else seed
                if foreign and other == seed:
                    continue
                scan_of = made(arguments.cache, kind, other) if foreign else data
                for n, draw in itertools.product(range(len(CONDITIONS)), range(arguments.draws)):
                    condition = CONDITIONS[n]
                    if (kind, seed, draw, foreign, condition) in done:
                        continue
                    if foreign and condition == "known":
                        continue
                    draws_of = CONDITIONS.index("free") if condition == "one" else n
                    rng = np.random.default_rng([seed, other, draws_of, draw])
                    row = {"kind": kind, "seed": seed, "draw": draw, "foreign": foreign}
                    row |= registered(gpureg, context, data, scan_of, rng, condition, truth)
                    row["found"] &= not foreign
                    row |= {
                        "pictures": int(data["pictures"]),
                        "registered_pictures": len(data["cameras"]),
                        "points": len(data["cloud"]),
                        "truth": errors,
                        "commit": commit(),
                        "processor": processor(),
                    }
                    print(json.dumps({k: row[k] for k in list(row)[1:-6]}), flush=True)
                    if path:
                        with path.open("a") as file:
                            file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
