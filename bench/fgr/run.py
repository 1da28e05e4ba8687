#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The synthetic range benchmark of the Fast Global Registration paper, beside the seven methods
published on it and the peers of bench/peers.

The 25 pairs at noise 0.0025 x diameter (diameter 2), each source under a random pose, drawn anew by
every seed: as published all pairs share one rotation, which would be too easy to hit. RMSE as in
the paper: over the source points whose nearest target point under the ground truth is within
0.0125. Every method, gpureg too, runs as bench/peers runs it, on clouds of --voxel-size with its
lengths in proportion; a method without a pose for a pair counts with RMSE infinity there (median,
shares) and is left out of its mean. usage: run.py [--methods gpureg_default ...] [--voxel-size
0.02] [--seeds 1] [--data DIR] [-o FILE] Needs Python 3 with numpy and gpureg (pip install .), and
what the peers need: bench/peers/requirements.txt."""

import json
import math
import os
import pathlib
import random
import statistics
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path[1:1] = [str(HERE.parent / "accuracy"), str(HERE.parent / "peers")]
import pairs as pairs_of_paper
import record

BOUNDS = (0.01, 0.02, 0.05)
# label, mean, maximum, shares below BOUNDS (None: not published): from the authors' own result
# files, and two runs of Open3D 0.16
PUBLISHED = [
    ("FGR, as published", 0.0104, 0.0193, (0.60, 1, 1)),
    ("CZK", 0.0150, 0.0439, (0.28, 0.84, 1)),
    ("PCL", 0.0173, 0.1220, (0.28, 0.84, 0.96)),
    ("Super4PCS", 0.0272, 0.0572, (0, 0.12, 0.96)),
    ("GoICP", 0.0632, 0.2667, (0, 0.24, 0.52)),
    ("Open3D 0.16 RANSAC, 100,000 iterations", 0.0380, 0.536, (None, 0.72, 0.96)),
    ("Open3D 0.16 FGR", 0.0201, 0.116, (None, 0.80, 0.92)),
]


class Pair:
    """Clouds of one pair, and the points that lie together under the truth."""

    def __init__(self, folder):
        self.name = folder.name
        self.target, self.source = (
            pairs_of_paper.read_ply(folder / "Depth_0000.ply"),
            pairs_of_paper.read_ply(folder / "Depth_0001.ply"),
        )
        self.truth = [
            [float(v) for v in line.split()]
            for line in (folder / "gt.log").read_text().splitlines()[1:4]
        ]
        self.together = pairs_of_paper.together(self.source, self.target, self.truth)

    def rmse(self, target_from_source):
        return math.sqrt(
            statistics.fmean(
                math.dist(pairs_of_paper.apply(target_from_source, p), q) ** 2
                for p, q in self.together
            )
        )


def rows(flat):
    return [flat[0:4], flat[4:8], flat[8:12]]


def product(a, b):
    """Of two motions of three rows."""
    return [
        [sum(a[r][k] * b[k][c] for k in range(3)) + (a[r][3] if c == 3 else 0) for c in range(4)]
        for r in range(3)
    ]


def run_seed(arguments, names, about, pairs, seed, clouds, work, refined):
    """{method: [rmse or None per pair]}, and times."""
    import numpy as np

    generator = random.Random(seed)
    poses = [pairs_of_paper.random_pose(generator) for _ in pairs]
    errors, timings = {}, {}
    with tempfile.TemporaryDirectory() as temporary:
        temporary = pathlib.Path(temporary)
        for k, (pair, pose) in enumerate(zip(pairs, poses)):
            moved = np.array(
                [
                    pairs_of_paper.apply(pose, row) + pairs_of_paper.rotate(pose, row[3:])
                    for row in pair.source
                ],
                np.float32,
            )
            target = np.array(pair.target, np.float32)
            clouds.write_one(temporary, 2 * k, target[:, :3], target[:, 3:], None)
            clouds.write_one(temporary, 2 * k + 1, moved[:, :3], moved[:, 3:], None)
        numbers = [(2 * k, 2 * k + 1) for k in range(len(pairs))]
        starts = {}
        for name in names:
            if about[name]["refines"] and not starts:
                print(f"skipped: {name}: it starts from the poses of {refined}, which did not run")
                continue
            initial = starts if about[name]["refines"] else {}
            results, _, memory, lost = work(
                name,
                numbers,
                initial,
                temporary,
                temporary,
                seed,
                arguments.threads,
                arguments.pair_timeout,
            )
            if results is None:
                print(f"skipped: {name}: {lost}")
                continue
            found = {(line["i"], line["j"]): line for line in results}
            if name == refined:
                starts = {pair: line["pose"] for pair, line in found.items() if line["pose"]}
            errors[name] = []
            for number, pair, pose in zip(numbers, pairs, poses):
                flat = found.get(number, {}).get("pose")
                errors[name].append(pair.rmse(product(rows(flat), pose)) if flat else None)
            timings[name] = statistics.fmean(line["ms"] for line in results)
    return errors, timings


def summary(runs):
    """runs: rmse or None of each pair, over all seeds."""
    known = [e for e in runs if e is not None]
    return {
        "rmse_mean": statistics.fmean(known) if known else None,
        "rmse_max": max(known, default=None),
        "rmse_median": statistics.median([math.inf if e is None else e for e in runs])
        if len(known) > len(runs) / 2
        else None,
        "without_pose": len(runs) - len(known),
        **{f"below_{bound:g}": sum(e < bound for e in known) / len(runs) for bound in BOUNDS},
    }


def main():
    parser = record.parser(__doc__, "fgr.json")
    parser.add_argument("--methods", nargs="+")
    parser.add_argument("--voxel-size", type=float, default=0.02)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument(
        "--update",
        action="store_true",
        help="keep the entries of the record for methods that are not named",
    )
    parser.add_argument("--pair-timeout", type=float, default=120)
    arguments = parser.parse_args()
    os.environ["GPUREG_PEER_VOXEL"] = str(
        arguments.voxel_size
    )  # read when the methods are imported
    import clouds
    import methods
    from runner import check, work

    chosen = arguments.methods or list(methods.METHODS)
    if unknown := [name for name in chosen if name not in methods.METHODS]:
        sys.exit(f"error: there is no method {unknown[0]}, only {', '.join(methods.METHODS)}")
    folder = record.data_folder(arguments, "fgr")
    about = {}
    for name in chosen:
        said, why = check(name)
        if said is None:
            print(f"skipped: {name}: {why}")
        else:
            about[name] = said
    pairs = [Pair(path) for path in sorted(path for path in folder.iterdir() if path.is_dir())]
    errors, timings = {}, {}
    for seed in arguments.seeds:
        found, ms = run_seed(
            arguments, list(about), about, pairs, seed, clouds, work, methods.REFINED
        )
        for name, values in found.items():
            errors.setdefault(name, []).extend(values)
            timings.setdefault(name, []).append(ms[name])
            print(f"seed {seed}: {name} done", flush=True)
    entries = {
        name: {
            **about[name],
            "commit": record.commit(),
            **summary(values),
            "ms_per_pair": statistics.fmean(timings[name]),
            "rmse": values,
        }
        for name, values in errors.items()
    }
    if arguments.update:
        old = json.loads(arguments.output.read_text())
        if (old["voxel_size"], old["seeds"]) != (arguments.voxel_size, arguments.seeds):
            sys.exit(
                f"error: {arguments.output} was made with another voxel size or other seeds, it cannot be updated"
            )
        entries = {**old["methods"], **entries}
        entries = {name: entries[name] for name in methods.METHODS if name in entries}
    truth = statistics.fmean(pair.rmse(pair.truth) for pair in pairs)
    print(
        f"\n{'RMSE (diameter 2)':44}{'mean':>9}{'max':>9}{'<.01':>7}{'<.02':>7}{'<.05':>7}{'ms/pair':>10}"
    )
    for entry in entries.values():
        shares = "".join(f"{entry[f'below_{bound:g}']:7.2f}" for bound in BOUNDS)
        lost = f"  {entry['without_pose']} without pose" if entry["without_pose"] else ""
        print(
            f"{entry['label'].replace('`', '') + ' ' + entry['version']:44}{entry['rmse_mean']:9.4f}{entry['rmse_max']:9.4f}{shares}{entry['ms_per_pair']:10.1f}{lost}"
        )
    for label, mean, largest, shares in PUBLISHED:
        print(
            f"{label:44}{mean:9.4f}{largest:9.4f}"
            + "".join("      -" if share is None else f"{share:7.2f}" for share in shares)
        )
    print(f"{'(the ground truth itself)':44}{truth:9.4f}")
    command = f"bench/fgr/run.py --voxel-size {arguments.voxel_size} --seeds {' '.join(map(str, arguments.seeds))} --threads {arguments.threads}"
    record.write(
        arguments,
        command,
        {
            "kind": "fgr",
            "voxel_size": arguments.voxel_size,
            "seeds": arguments.seeds,
            "pairs": len(pairs),
            "methods": entries,
            "rmse_of_truth": truth,
            "published": [
                {"label": label, "rmse_mean": mean, "rmse_max": largest, "below": shares}
                for label, mean, largest, shares in PUBLISHED
            ],
        },
    )


if __name__ == "__main__":
    main()
