#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Time from raw files to an audited map as sets of several buildings grow.

    sets.py --work WORK [--scans 50 100 300 1000] [--prune 20] [--all-pairs 300]

Houses of `gpureg generate` with --fragments scans each, made in WORK where they are not there yet, lie in one
folder. Sets of up to --all-pairs scans are aligned with all pairs, all sets with --prune. `graph` is the audited map: loop
consistency, pose graph and audit. kept: of the pairs that overlap by 30 %, those that were tried.
"""

import json
import pathlib
import resource
import sys
import time

sys.path.insert(1, str(pathlib.Path(__file__).resolve().parents[1] / "accuracy"))
from record import gpureg, parser, write

OFFSET = 1000  # between the numbers of two buildings
FIRST_SEED = 9301


def building(arguments, number):
    folder = arguments.work / "buildings" / f"house_{FIRST_SEED + number}"
    if not (folder / "gt.log").exists():
        gpureg(
            arguments,
            *("generate", folder, "--seed", FIRST_SEED + number, "--quiet"),
            *("--fragments", arguments.fragments, "--frames-per-fragment", arguments.frames),
        )
    return folder


def put_together(arguments, scans):
    """Links to so many scans. Returns the folder and the pairs that overlap."""
    out = arguments.work / "sets" / str(scans)
    out.mkdir(parents=True, exist_ok=True)
    cameras, overlapping = [], set()
    for first in range(0, scans, arguments.fragments):
        number = first // arguments.fragments
        source, count = building(arguments, number), min(arguments.fragments, scans - first)
        offset = OFFSET * number
        for k in range(count):
            link = out / f"cloud_bin_{offset + k}.ply"
            if not link.exists():
                link.symlink_to((source / f"cloud_bin_{k}.ply").resolve())
        for line in (source / "cameras.txt").read_text().splitlines():
            if line.strip() and not line.startswith("#") and int(line.split()[0]) < count:
                fragment, rest = line.split(maxsplit=1)
                cameras.append(f"{int(fragment) + offset} {rest}\n")
        # A line of numbers of scans, then four of the pose.
        for line in (source / "gt.log").read_text().splitlines()[::5]:
            i, j, _ = map(int, line.split())
            if max(i, j) < count:
                overlapping.add((i + offset, j + offset))
    (out / "cameras.txt").write_text("".join(cameras))
    return out, overlapping


def processor_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(arguments, scans, prune):
    folder, overlapping = put_together(arguments, scans)
    out = arguments.work / "maps" / f"{scans}_{prune}"
    limit = ["--prune", prune] if prune else []
    wall, processor = time.perf_counter(), processor_seconds()
    gpureg(
        arguments,
        *("reconstruct", folder, "-o", out, "--no-refine", "--no-map", "--restart", "--quiet"),
        *("--backend", arguments.backend, "--voxel-size", 0.05, *limit),
    )
    wall, processor = time.perf_counter() - wall, processor_seconds() - processor
    document = json.loads((out / "reconstruction.json").read_text())
    pairs = json.loads((out / "pairs.json").read_text())["pairs"]
    tried = {(min(p["i"], p["j"]), max(p["i"], p["j"])) for p in pairs}
    row = {
        "scans": scans,
        "prune": prune,
        "pairs": len(pairs),
        "kept_percent": round(100 * len(overlapping & tried) / max(1, len(overlapping)), 1),
        "placed": sum(scan["placed"] for scan in document["scans"]),
        "islands": len(document["islands"]),
        "seconds": {
            "all": round(wall, 2),
            "processor": round(processor, 2),
            **{key: round(value, 3) for key, value in document["seconds"].items()},
        },
        "peak_memory_mib": document["peak_memory_mib"],
    }
    print(json.dumps(row), flush=True)
    return row


def main():
    arguments = parser(__doc__, "sets.json")
    arguments.add_argument("--work", type=pathlib.Path, required=True)
    arguments.add_argument("--scans", type=int, nargs="+", default=[50, 100, 200, 300, 500, 1000])
    arguments.add_argument("--prune", type=int, default=20)
    arguments.add_argument("--all-pairs", type=int, default=300, help="up to so many scans")
    arguments.add_argument("--fragments", type=int, default=50, help="of a building")
    arguments.add_argument("--frames", type=int, default=50, help="of a fragment")
    arguments = arguments.parse_args()
    arguments.work = arguments.work.resolve()
    rows = [
        run(arguments, scans, prune)
        for scans in arguments.scans
        for prune in ((0, arguments.prune) if scans <= arguments.all_pairs else (arguments.prune,))
    ]
    write(arguments, "python3 bench/pipeline/sets.py --work WORK", {"runs": rows})


if __name__ == "__main__":
    main()
