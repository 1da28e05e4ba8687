#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Two single pairs: a LiDAR pair with known pose, before and after refinement, and Redwood's two
sample fragments.

usage: other_pairs.py [--voxel-size 0.5] [--seeds 1 2 3] [--backend auto] [--data DIR] [-o FILE]"""

import json
import math
import pathlib
import tempfile

import record

parser = record.parser(__doc__, "other_pairs.json")
parser.add_argument("--voxel-size", type=float, default=0.5, help="of the LiDAR pair, metres")
parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
arguments = parser.parse_args()


def register(source, target, *words):
    with tempfile.TemporaryDirectory() as temporary:
        file = pathlib.Path(temporary) / "result.json"
        record.gpureg(
            arguments,
            "register",
            source,
            target,
            "--backend",
            arguments.backend,
            "--json",
            file,
            *words,
        )
        return json.loads(file.read_text())


def errors(truth, flat):
    """Metres and degrees of inverse(truth) * found."""
    found = [flat[4 * r : 4 * r + 4] for r in range(3)]
    difference = [found[r][3] - truth[r][3] for r in range(3)]
    trace = sum(truth[r][c] * found[r][c] for r in range(3) for c in range(3))
    return math.hypot(*difference), math.degrees(math.acos(max(-1.0, min(1.0, (trace - 1) / 2))))


def summary(report):
    result = report["result"]
    return {
        "status": result["status"],
        "score": result["score"],
        "inlier_rmse": result["inlier_rmse"],
    }


lidar = record.data_folder(arguments, "lidar")
sample = record.data_folder(arguments, "redwood-sample")
truth = [
    [float(v) for v in line.split()]
    for line in (lidar / "T_target_source.txt").read_text().splitlines()[:4]
]
runs, report = {"lidar": [], "redwood_sample": []}, {}
for seed in arguments.seeds:
    for preset in ("loopsmart", "default"):
        report = register(
            lidar / "source.ply",
            lidar / "target.ply",
            "--voxel-size",
            arguments.voxel_size,
            "--preset",
            preset,
            "--seed",
            seed,
        )
        metres, degrees = errors(truth, report["result"]["target_from_source"])
        runs["lidar"].append(
            {
                "seed": seed,
                "preset": preset,
                "refined": preset == "default",
                "metres": metres,
                "degrees": degrees,
                **summary(report),
            }
        )
        print(
            f"lidar, seed {seed}, {preset}: {report['result']['status']}, {metres:.3f} m, {degrees:.3f} deg"
        )
    report = register(sample / "cloud_bin_1.pcd", sample / "cloud_bin_0.pcd", "--seed", seed)
    runs["redwood_sample"].append({"seed": seed, **summary(report)})
    print(
        f"redwood-sample, seed {seed}: {report['result']['status']}, score {report['result']['score']:.3f}"
    )
command = (
    f"bench/accuracy/other_pairs.py --voxel-size {arguments.voxel_size} --seeds {' '.join(map(str, arguments.seeds))} "
    f"--backend {report['environment']['backend']}"
)
record.write(arguments, command, {"environment": report["environment"], **runs})
