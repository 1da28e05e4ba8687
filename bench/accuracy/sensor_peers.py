#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""gpureg beside KISS-Matcher and Open3D's RANSAC on data of other sensors than a depth camera in rooms.

Sets: kitti, lidar, dragon, cad_mesh of DATA (viewpoints.py); street16, street32, street64: simulated
LiDAR of so many rings; hall: a simulated terrestrial scanner (domain_scenes.py), without the true pairs
whose clouds do not overlap. A name that ends in
`_thinned`: of every cloud a random quarter of the points. Every cloud is turned about its sensor by a
random rotation and has points alone, a model its faces.

gpureg runs as it is, with `--voxel-size auto`; on LiDAR also with `--up`, on clouds that are turned about
the vertical, and with voxels of 0.8 m; on the other sets also with the viewpoints given. The peers run
by bench/peers with the parameters that their own documentation recommends, at the voxel size that gpureg
chose and at other ones: for LiDAR 0.8 m and, KISS-Matcher's own, 0.3 m, else twice that of gpureg. Their
clouds are downsampled by gpureg and have normals turned to the sensor, of models outward ones. `_thinned`
sets have no runs at 0.3 m. Times are processor time of preparation and alignment, for each pair; gpureg's
includes the reading of files.

The record keeps the sets that are not named.
usage: sensor_peers.py [--sets kitti,street16,...] [--seeds 1 2 3] [--scenes 2] [-o FILE]
Needs what bench/peers and domain_scenes.py need."""

import collections
import json
import os
import pathlib
import resource
import sys
import tempfile

import gpureg
import numpy as np
import record
import viewpoints

sys.path.append(str(record.ROOT / "bench/peers"))

SETS = (
    "kitti,kitti_thinned,lidar,street16,street16_thinned,street32,street32_thinned,"
    "street64,street64_thinned,hall,dragon,cad_mesh"
)
PEERS = ("kiss_matcher_005", "open3d_ransac")
# KISS-Matcher refuses voxels of 5 mm and less: the peers get smaller clouds in another unit.
SMALL_VOXEL, SMALL_UNIT = 0.02, 100.0
LIDAR_VOXELS = {"fine": 0.3, "coarse": 0.8}  # metres
FIRST_SEED = 101  # of the simulated scenes; no figure of the docs had chosen anything by them
THINNED = 0.25
MIN_OVERLAP, NEAR = 0.1, 0.5  # share of the points of both clouds, metres


def overlapping(scene):
    """Without the true pairs whose clouds have no place in common, as of a sensor inside a machine."""
    from scipy.spatial import cKDTree

    trees = [cKDTree(cloud.points) for cloud in scene.clouds]

    def share(source, target, pose):
        points = viewpoints.moved(pose, scene.clouds[source].points[::3])
        return np.isfinite(trees[target].query(points, distance_upper_bound=NEAR)[0]).mean()

    kept = [
        (s, t, truths)
        for s, t, truths in scene.pairs
        if not truths
        or min(share(s, t, truths[0]), share(t, s, np.linalg.inv(truths[0]))) >= MIN_OVERLAP
    ]
    return scene._replace(pairs=kept)


def scenes_of(name, data, count):
    base, thinned = name.removesuffix("_thinned"), name.endswith("_thinned")
    if base.startswith("street") or base == "hall":
        import domains

        kind = "hall" if base == "hall" else "street"
        fixed = {"scanner": True} if base == "hall" else {"rings": int(base.removeprefix("street"))}
        count, first = (1, FIRST_SEED + 50) if thinned else (count, FIRST_SEED)
        seeds = range(first, first + count)
        scenes = [overlapping(domains.simulated(kind, seed, **fixed)) for seed in seeds]
    else:
        scenes = getattr(viewpoints, base)(data, 100, np.random.default_rng(0))
    if thinned:
        rng = np.random.default_rng(7)
        for scene in scenes:
            scene.clouds[:] = [
                c._replace(points=c.points[rng.random(len(c.points)) < THINNED])
                for c in scene.clouds
            ]
    return scenes


def processor_time():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def upside_down(pose, truth):
    return viewpoints.angle(pose, truth) > 90 and (pose[:3, 2] @ truth[:3, 2]) < -0.7


def before_false(scored):
    """Correct poses with a higher score than every false one, of any pair: reports without a false one, by the best
    threshold.
    """
    highest = max((score for score, good in scored if not good), default=-np.inf)
    return sum(bool(good and score > highest) for score, good in scored)


def of_gpureg(command, scenes, condition, seed, extra):
    """Counts over all scenes, and the voxel size of each."""
    total, voxels, scored = collections.Counter(flips=0), [], []
    begin = processor_time()
    for number, scene in enumerate(scenes):
        rng = np.random.default_rng([seed, number])
        voxel, outcomes = viewpoints.run(command, scene, seed, rng, condition, total, extra)
        voxels.append(voxel)
        for (_, _, truths), (pose, good, score) in zip(scene.pairs, outcomes):
            scored.append((score, good))
            if truths and not good and pose is not None:
                total["flips"] += int(upside_down(pose, truths[0]))
    pairs = total["pairs"] + total["negatives"]
    total = {k: v for k, v in total.items() if ": " not in k}
    total["before_false"] = before_false(scored)
    return {"seed": seed, **total, "ms": 1e3 * (processor_time() - begin) / pairs}, voxels


def of_peer(method, threshold, scenes, voxels, seed):
    from clouds import write_one
    from runner import work

    total, used, lost_pairs = collections.Counter(), 0.0, 0
    scored = []
    for number, (scene, voxel) in enumerate(zip(scenes, voxels)):
        rng = np.random.default_rng([seed, number])
        poses = viewpoints.poses_of("turned", scene.clouds, rng)
        unit = SMALL_UNIT if voxel < SMALL_VOXEL else 1.0
        with tempfile.TemporaryDirectory() as temporary:
            folder = pathlib.Path(temporary)
            viewpoints.write(folder, scene.clouds, poses, False)
            for k, cloud in enumerate(scene.clouds):
                file = folder / f"cloud_bin_{k}.{'ply' if cloud.triangles is None else 'stl'}"
                read = gpureg.read_point_cloud(file)
                view = None if cloud.viewpoints is None else np.zeros((1, 3), np.float32)
                normals = None if cloud.triangles is None else read.normals
                write_one(folder, k, unit * read.points, normals, view, unit * voxel)
            os.environ["GPUREG_PEER_VOXEL"] = repr(unit * voxel)
            listed = [(t, s) for s, t, _ in scene.pairs]
            lines, prepared, _, lost = work(method, listed, {}, folder, folder, seed, 1, 120)
        if lines is None:
            sys.exit(f"error: {method}: {lost}")
        lost_pairs += len(lost)
        used += sum(line["processor_ms"] for line in [*lines, *prepared])
        found = {(line["i"], line["j"]): line for line in lines}
        for source, target, truths in scene.pairs:
            line = found.get((target, source), {"pose": None, "score": 0.0})
            good = False
            if line["pose"] is not None and truths:
                pose = np.array(line["pose"]).reshape(4, 4)
                pose[:3, 3] /= unit
                pose = np.linalg.inv(poses[target]) @ pose @ poses[source]
                good = bool(scene.right(scene.clouds[source].points[::50], pose, truths))
            scored.append((line["score"], good))
            reported = line["pose"] is not None and line["score"] >= threshold
            total["negatives" if not truths else "pairs"] += 1
            total["right"] += good
            total["reported"] += reported and good
            total["reported_wrong"] += reported and not good
    pairs = total["pairs"] + total["negatives"]
    total["before_false"] = before_false(scored)
    return {"seed": seed, **total, "lost": lost_pairs, "ms": used / pairs}


def main():
    parser = record.parser(__doc__, "sensor_peers.json")
    parser.add_argument("--sets", default=SETS)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="of gpureg")
    parser.add_argument(
        "--peers", nargs="*", choices=PEERS, default=list(PEERS), help="methods of bench/peers"
    )
    parser.add_argument(
        "--no-fine", action="store_true", help="skip Open3D at 0.3 m, its slowest run"
    )
    parser.add_argument("--scenes", type=int, default=2, help="of each simulated set")
    arguments = parser.parse_args()
    from runner import check

    content = {"sets": {}}
    if arguments.output.exists():
        content["sets"] = json.loads(arguments.output.read_text())["sets"]
    data = pathlib.Path(arguments.data)
    seeds = " ".join(map(str, arguments.seeds))
    for name in arguments.sets.split(","):
        scenes = scenes_of(name, data, arguments.scenes)
        lidar = not name.startswith(("dragon", "cad", "hall"))
        runs = {"gpureg": ("turned", [], "auto")}
        if lidar:
            runs["gpureg_up"] = ("upright", ["--up", "0,0,1"], "auto")
            runs["gpureg_coarse"] = ("turned", [], repr(LIDAR_VOXELS["coarse"]))
        else:
            runs["gpureg_viewpoints"] = ("turned_said", [], "auto")
        methods, sizes = {}, {}
        for label, (condition, extra, size) in runs.items():
            chosen = [scene._replace(voxel=size) for scene in scenes]
            methods[label] = []
            for seed in arguments.seeds:
                counts, voxels = of_gpureg(arguments.gpureg, chosen, condition, seed, extra)
                methods[label].append(counts)
                print(name, label, counts, voxels, flush=True)
                if label == "gpureg":
                    sizes["auto"] = voxels
        if lidar:
            sizes |= {which: [size] * len(scenes) for which, size in LIDAR_VOXELS.items()}
        else:
            sizes["double"] = [2 * v for v in sizes["auto"]]
        if name.endswith("_thinned"):
            del sizes["fine"]
        versions = {}
        for method in arguments.peers:
            about, why = check(method)
            if about is None:
                sys.exit(f"error: {method}: {why}")
            versions[method] = about["version"]
            for which, voxels in sizes.items():
                if arguments.no_fine and (method, which) == ("open3d_ransac", "fine"):
                    continue
                counts = of_peer(method, about["threshold"], scenes, voxels, arguments.seeds[0])
                methods[f"{method}_{which}"] = [counts]
                print(name, method, which, counts, voxels, flush=True)
        content["sets"][name] = {
            "command": f"bench/accuracy/sensor_peers.py --sets {name} --seeds {seeds} --scenes {arguments.scenes}"
            + (" --no-fine" if arguments.no_fine else "")
            + ("" if arguments.peers == list(PEERS) else f" --peers {' '.join(arguments.peers)}"),
            "commit": record.commit(),
            "voxel_sizes": sizes,
            "versions": versions,
            "methods": methods,
        }
        record.write(arguments, "bench/accuracy/sensor_peers.py", content)


if __name__ == "__main__":
    main()
