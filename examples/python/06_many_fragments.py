# SPDX-License-Identifier: BSD-3-Clause
"""Thousands of fragments: tries only the pairs that look alike, and measures what that loses.

    python 06_many_fragments.py scans/ --output run/ --neighbors 20 --check 100

The folder holds cloud_bin_<i>.ply. All pairs of the first --check fragments are aligned as well, and
those that are aligned stand for the pairs that overlap. Needs pyarrow.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import gpureg
from gpureg import pruning


def aligned_pairs(run: gpureg.BatchRun) -> list[tuple[int, int]]:
    table = run.table()
    columns = (table[name].to_pylist() for name in ("i", "j", "status"))
    return [(i, j) for i, j, status in zip(*columns) if status == "aligned"]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder")
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--neighbors", type=int, default=20)
    parser.add_argument("--check", type=int, default=100, help="fragments of the complete run")
    parser.add_argument("--voxel-size", type=float, default=0.05)
    parser.add_argument("--quality", type=int, default=5)
    arguments = parser.parse_args()

    options = gpureg.RegistrationOptions(voxel_size=arguments.voxel_size, quality=arguments.quality)
    nearest = pruning.Nearest(k=arguments.neighbors, options=options)
    fragments = gpureg.FragmentSet.from_directory(arguments.folder)

    # A part of the set, completely: its aligned pairs are what pruning should keep.
    numbers = fragments.numbers[: arguments.check]
    part = [(i, j) for i in numbers for j in numbers if i < j]
    complete = gpureg.register_all(
        fragments, part, output=arguments.output / "part", options=options
    )
    pairs = nearest(fragments)
    kept = [(i, j) for i, j in pairs.tolist() if j <= numbers[-1]]
    print(f"summaries and search in {nearest.seconds:.1f} s")
    print(pruning.measure(kept, aligned_pairs(complete), len(numbers)))

    # All fragments, pruned. An interrupted run goes on where it stopped.
    run = gpureg.register_all(fragments, pairs, output=arguments.output / "all", options=options)
    print(run)


if __name__ == "__main__":
    main()
