#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""gpureg beside Open3D's feature-matching RANSAC: the same pairs, the same machine, one run.

Open3D gets its own preparation (voxels of 5 cm, normals from 10 cm, FPFH from 25 cm), 400,000 iterations, the edge-length checker with
0.9 and the distance checker with 7.5 cm; its time is that of registration_ransac_based_on_feature_matching alone. gpureg runs the paper's
preset (4,000,000 hypotheses) through its command; its time is that of all stages of a prepared pair. The two take turns in blocks of
pairs, so that a busy machine slows both.

usage: open3d_ransac.py FRAGMENTS_DIR --gpureg build/cpu/bin/gpureg [--blocks 5] [--json FILE]
Needs Python 3 with open3d (Debian: python3-open3d).
"""
import argparse
import json
import os
import pathlib
import subprocess
import tempfile
import time

import numpy as np
import open3d as o3d

VOXEL, DISTANCE = 0.05, 0.075


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
        registration.RANSACConvergenceCriteria(400000, 0.999))
    return result, time.perf_counter() - begin


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fragments", type=pathlib.Path)
    parser.add_argument("--gpureg", required=True, type=pathlib.Path)
    parser.add_argument("--blocks", type=int, default=5)
    parser.add_argument("--json", type=pathlib.Path)
    arguments = parser.parse_args()

    count = len(list(arguments.fragments.glob("cloud_bin_*.ply")))
    clouds = [prepare(arguments.fragments / f"cloud_bin_{i}.ply") for i in range(count)]
    pairs = [(i, j) for i in range(count) for j in range(i + 1, count)]
    ours, theirs, log, entries = [], [], [], []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for block in np.array_split(np.arange(len(pairs)), arguments.blocks):
            part = [pairs[k] for k in block]
            for i, j in part:
                result, seconds = register(clouds[j], clouds[i])
                theirs.append(1e3 * seconds)
                rows = "\n".join("\t".join(f"{v:.10f}" for v in row) for row in result.transformation)
                if result.fitness >= 0.3:
                    log.append(f"{i}\t{j}\t{count}\n{rows}\n")
            (folder / "pairs.txt").write_text("".join(f"{i} {j}\n" for i, j in part))
            subprocess.run([arguments.gpureg, "batch", arguments.fragments, "--preset", "loopsmart", "--backend", "cpu", "--quiet", "--pairs",
                            folder / "pairs.txt", "-o", folder / "part.log", "--json", folder / "part.json"], check=True)
            report = json.loads((folder / "part.json").read_text())
            ours += [sum(pair["ms"].values()) for pair in report["pairs"]]
            entries += report["pairs"]
        report["pairs"] = entries
        (folder / "gpureg.json").write_text(json.dumps(report))
        (folder / "open3d.log").write_text("".join(log))
        for name, result in (("Open3D, fitness >= 0.30", "open3d.log"), ("gpureg, inlier ratio >= 0.30", "gpureg.json")):
            print(f"--- {name}", flush=True)
            subprocess.run([arguments.gpureg, "evaluate", folder / result, "--ground-truth", arguments.fragments], check=True)
    summary = {
        "fragments": str(arguments.fragments.name), "pairs": len(pairs), "cpus": os.cpu_count(), "open3d": o3d.__version__,
        "open3d_ms": {"mean": float(np.mean(theirs)), "median": float(np.median(theirs))},
        "gpureg_ms": {"mean": float(np.mean(ours)), "median": float(np.median(ours))},
        "ratio_of_means": float(np.mean(ours) / np.mean(theirs)),
    }
    print(f"time per prepared pair, mean: Open3D {np.mean(theirs):.1f} ms, gpureg {np.mean(ours):.1f} ms, ratio {summary['ratio_of_means']:.3f}")
    if arguments.json:
        arguments.json.write_text(json.dumps(summary, indent=1) + "\n")


main()
