#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""gpureg beside Open3D's feature-matching RANSAC: the same pairs, the same machine, one run.

Open3D gets its own preparation (voxels of 5 cm, normals from 10 cm, FPFH from 25 cm), 400,000 iterations, the edge-length checker with
0.9 and the distance checker with 7.5 cm; its time is that of registration_ransac_based_on_feature_matching alone. gpureg runs the paper's
preset (4,000,000 hypotheses) through its command; its time is that of all stages of a prepared pair. The two take turns in blocks of
pairs, so that a busy machine slows both.

Afterwards the command registers all pairs at once, which gives its peak memory.
usage: open3d_ransac.py [--blocks 5] [--backend cpu] [--scene redkitchen/fragments] [--data DIR] [-o FILE]
Needs Python 3 with open3d (Debian: python3-open3d).
"""
import json
import pathlib
import sys
import tempfile
import time

import numpy as np
import open3d as o3d

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "accuracy"))
import record  # noqa: E402

VOXEL, DISTANCE, ITERATIONS = 0.05, 0.075, 400_000


def prepare(path):
    cloud = o3d.io.read_point_cloud(str(path)).voxel_down_sample(VOXEL)
    oriented = cloud.has_normals()
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(2 * VOXEL, 30))
    if not oriented:
        cloud.orient_normals_towards_camera_location(np.zeros(3))
    feature = o3d.pipelines.registration.compute_fpfh_feature(cloud, o3d.geometry.KDTreeSearchParamHybrid(5 * VOXEL, 100))
    return cloud, feature


def register(source, target):
    registration = o3d.pipelines.registration
    begin = time.perf_counter()
    result = registration.registration_ransac_based_on_feature_matching(
        source[0], target[0], source[1], target[1], False, DISTANCE, registration.TransformationEstimationPointToPoint(False), 4,
        [registration.CorrespondenceCheckerBasedOnEdgeLength(0.9), registration.CorrespondenceCheckerBasedOnDistance(DISTANCE)],
        registration.RANSACConvergenceCriteria(ITERATIONS, 0.999))
    return result, time.perf_counter() - begin


def block_of_pairs(arguments, folder, temporary, part):
    """gpureg's report on some pairs of the folder; None: on all of them."""
    words = []
    if part is not None:
        (temporary / "pairs.txt").write_text("".join(f"{i} {j}\n" for i, j in part))
        words = ["--pairs", temporary / "pairs.txt"]
    record.gpureg(arguments, "batch", folder, "--preset", "loopsmart", "--backend", arguments.backend, "--quiet", *words,
                  "-o", temporary / "result.log", "--json", temporary / "result.json")
    return json.loads((temporary / "result.json").read_text())


def scores(arguments, folder, temporary, result):
    output = temporary / "scores.json"
    record.gpureg(arguments, "evaluate", result, "--ground-truth", folder, "--json", output)
    strict = json.loads(output.read_text())["scenes"][0]["strict"]
    return {key: strict[key] for key in ("good", "ground_truth", "reported", "recall", "precision")}


def times(milliseconds, points):
    return {"ms_mean": float(np.mean(milliseconds)), "ms_median": float(np.median(milliseconds)), "points_mean": float(np.mean(points))}


def main():
    parser = record.parser(__doc__, "open3d_ransac.json")
    parser.set_defaults(backend="cpu")
    parser.add_argument("--scene", default="redkitchen/fragments", help="a folder of the data with fragments and their ground truth")
    parser.add_argument("--blocks", type=int, default=5)
    arguments = parser.parse_args()
    folder = record.data_folder(arguments, arguments.scene)

    count = len(list(folder.glob("cloud_bin_*.ply")))
    clouds = [prepare(folder / f"cloud_bin_{i}.ply") for i in range(count)]
    pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]
    ours, theirs, log = [], [], []
    with tempfile.TemporaryDirectory() as temporary:
        temporary = pathlib.Path(temporary)
        for block in np.array_split(np.arange(len(pairs)), arguments.blocks):
            part = [pairs[k] for k in block]
            for i, j in part:
                result, seconds = register(clouds[j], clouds[i])
                theirs.append(1e3 * seconds)
                rows = "\n".join("\t".join(f"{v:.10f}" for v in row) for row in result.transformation)
                if result.fitness >= 0.3:
                    log.append(f"{i}\t{j}\t{count}\n{rows}\n")
            report = block_of_pairs(arguments, folder, temporary, part)
            ours += [pair["ms"]["total"] for pair in report["pairs"]]
        report = block_of_pairs(arguments, folder, temporary, None)
        memory = report["peak_memory_mib"]
        (temporary / "open3d.log").write_text("".join(log))
        ratio = float(np.mean(ours) / np.mean(theirs))
        content = {
            "environment": report["environment"], "scene": arguments.scene, "pairs": len(pairs), "ratio_of_means": ratio,
            "gpureg": {**times(ours, [fragment["points"] for fragment in report["fragments"]]), "peak_memory_mib": round(memory),
                       "hypotheses": report["options"]["hypothesis"]["count"],
                       **scores(arguments, folder, temporary, temporary / "result.json")},
            "open3d": {"version": o3d.__version__, **times(theirs, [len(cloud.points) for cloud, _ in clouds]), "iterations": ITERATIONS,
                       **scores(arguments, folder, temporary, temporary / "open3d.log")},
        }
    for name in ("open3d", "gpureg"):
        own = content[name]
        print(f"{name}: {own['ms_mean']:.1f} ms per prepared pair (median {own['ms_median']:.1f}), recall {100 * own['recall']:.1f} % at precision "
              f"{100 * own['precision']:.1f} %, {own['points_mean']:.0f} points per cloud")
    print(f"{len(pairs)} pairs; gpureg takes {ratio:.3f} of Open3D's time; its peak memory is {memory:.0f} MiB")
    record.write(arguments, f"bench/peers/open3d_ransac.py --blocks {arguments.blocks} --backend {report['environment']['backend']} "
                 f"--scene {arguments.scene}", content)


main()
