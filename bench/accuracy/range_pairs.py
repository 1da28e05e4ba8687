#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The 25 synthetic range pairs of the Fast Global Registration paper (noise 0.0025 x diameter),
each moved by a random pose.

RMSE as in that paper: over the source points whose nearest target point under the ground truth is
within 0.0125, the root mean square distance to that point under the estimate, in data units.
`gpureg register` with its default options, refinement on; the voxel is the one that `gpureg info`
suggests. Every seed gives other poses. usage: range_pairs.py [--voxel-size 0.02] [--seeds 1 2 3]
[--backend auto] [--data DIR] [-o FILE]"""

import array
import json
import math
import pathlib
import random
import statistics
import sys
import tempfile

import record

WITHIN = 0.0125


def read_ply(path):
    """Rows of six floats, x y z nx ny nz, of a binary little-endian PLY."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode().split("\n")
    count = next(int(line.split()[2]) for line in header if line.startswith("element vertex"))
    if (
        "format binary_little_endian 1.0" not in header
        or sum(line.startswith("property float") for line in header) != 6
    ):
        sys.exit(f"error: {path}: expected binary x y z nx ny nz")
    values = array.array("f", data[end : end + 24 * count])
    if sys.byteorder == "big":
        values.byteswap()
    return [values[k : k + 6] for k in range(0, len(values), 6)]


def write_ply(path, rows):
    values = array.array("f", (value for row in rows for value in row))
    if sys.byteorder == "big":
        values.byteswap()
    properties = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}end_header\n"
    path.write_bytes(header.encode() + values.tobytes())


def rotate(pose, p):
    return [sum(pose[r][c] * p[c] for c in range(3)) for r in range(3)]


def apply(pose, p):
    return [value + pose[r][3] for r, value in enumerate(rotate(pose, p))]


def random_pose(generator):
    """Any rotation, uniformly; a translation of about a diameter."""
    q = [generator.gauss(0, 1) for _ in range(4)]
    w, x, y, z = (value / math.hypot(*q) for value in q)
    t = [generator.gauss(0, 2) for _ in range(3)]
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), t[0]],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), t[1]],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), t[2]],
    ]


def together(source, target, truth):
    """Pairs of a source point and its nearest target point within WITHIN under the truth."""
    cells = {}
    for q in target:
        cells.setdefault(tuple(math.floor(v / WITHIN) for v in q[:3]), []).append(q[:3])
    pairs = []
    for p in source:
        moved = apply(truth, p)
        i, j, k = (math.floor(v / WITHIN) for v in moved)
        near = [
            (math.dist(moved, q), q)
            for a in (i - 1, i, i + 1)
            for b in (j - 1, j, j + 1)
            for c in (k - 1, k, k + 1)
            for q in cells.get((a, b, c), ())
        ]
        distance, nearest = min(near, key=lambda entry: entry[0], default=(math.inf, None))
        if distance <= WITHIN:
            pairs.append((p[:3], nearest))
    return pairs


def register_all(arguments, folder, seed):
    """One dictionary per pair, and gpureg's report of the last one."""
    generator = random.Random(seed)
    results, report = [], {}
    with tempfile.TemporaryDirectory() as temporary:
        moved_file, result_file = (
            pathlib.Path(temporary) / "source.ply",
            pathlib.Path(temporary) / "result.json",
        )
        for pair in sorted(path for path in folder.iterdir() if path.is_dir()):
            target, source = read_ply(pair / "Depth_0000.ply"), read_ply(pair / "Depth_0001.ply")
            truth = [
                [float(v) for v in line.split()]
                for line in (pair / "gt.log").read_text().splitlines()[1:4]
            ]
            pose = random_pose(generator)
            write_ply(moved_file, [apply(pose, row) + rotate(pose, row[3:]) for row in source])
            record.gpureg(
                arguments,
                "register",
                moved_file,
                pair / "Depth_0000.ply",
                "--voxel-size",
                arguments.voxel_size,
                "--backend",
                arguments.backend,
                "--seed",
                seed,
                "--json",
                result_file,
            )
            report = json.loads(result_file.read_text())
            flat = report["result"]["target_from_source"]
            found = [flat[0:4], flat[4:8], flat[8:12]]
            pairs = together(source, target, truth)
            rmse = math.sqrt(
                statistics.fmean(math.dist(apply(found, apply(pose, p)), q) ** 2 for p, q in pairs)
            )
            lower = math.sqrt(
                statistics.fmean(math.dist(apply(truth, p), q) ** 2 for p, q in pairs)
            )
            results.append(
                {
                    "pair": pair.name,
                    "status": report["result"]["status"],
                    "rmse": rmse,
                    "rmse_of_truth": lower,
                }
            )
    return results, report


def main():
    parser = record.parser(__doc__, "range_pairs.json")
    parser.add_argument("--voxel-size", type=float, default=0.02)
    parser.add_argument(
        "--seeds",
        type=int,
        nargs="+",
        default=[1, 2, 3],
        help="of the random poses and of the registration",
    )
    arguments = parser.parse_args()
    folder = record.data_folder(arguments, "fgr")
    runs, report = [], {}
    for seed in arguments.seeds:
        results, report = register_all(arguments, folder, seed)
        errors = [result["rmse"] for result in results]
        runs.append(
            {
                "seed": seed,
                "rmse_mean": statistics.fmean(errors),
                "rmse_max": max(errors),
                "rmse_mean_of_truth": statistics.fmean(
                    result["rmse_of_truth"] for result in results
                ),
                **{
                    f"below_{bound}": sum(e < bound for e in errors) / len(errors)
                    for bound in (0.01, 0.02, 0.05)
                },
                "pairs": results,
            }
        )
        print(
            f"seed {seed}: mean {runs[-1]['rmse_mean']:.4f}, max {runs[-1]['rmse_max']:.4f}, "
            f"under the ground truth {runs[-1]['rmse_mean_of_truth']:.4f}",
            flush=True,
        )
    options = report["options"]
    options.pop("seed", None)
    command = (
        f"bench/accuracy/range_pairs.py --voxel-size {arguments.voxel_size} --seeds {' '.join(map(str, arguments.seeds))} "
        f"--backend {report['environment']['backend']}"
    )
    record.write(
        arguments, command, {"environment": report["environment"], "options": options, "runs": runs}
    )


if __name__ == "__main__":
    main()
