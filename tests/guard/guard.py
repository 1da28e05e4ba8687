#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The regression guard: a small fixed benchmark that fails when accuracy or work got worse than the
committed baseline.

Scene: `gpureg generate` with a fixed seed, so that the bytes are the same everywhere. Margins:
  found, right    of the true pairs reported right, and right whatever is reported: at most one pair
  fewer than the baseline false           reports that the geometric rule calls wrong: at most one
  more instructions    of one whole `gpureg register` (read, prepare, align) on one thread, counted
  by valgrind: at most 5 % more;
                  compared only where compiler, flags and processor architecture are those of the
                  baseline. The wall clock is never asked.
Better is never an error; after an improvement, --update moves the baseline.
usage: guard.py accuracy|instructions --gpureg COMMAND --work FOLDER [--compiler NAME] [--baseline
FILE] [--update] Exit status 77: skipped, with the reason."""

import argparse
import json
import pathlib
import platform
import re
import shutil
import subprocess
import sys

SCENE = ["--fragments", 14, "--frames-per-fragment", 12, "--seed", 7]
VOXEL = 0.1
RUNS = {
    "default": ["--preset", "default"],
    "loopsmart": ["--preset", "loopsmart", "--set", "quadruples=400000"],
}
# Coarse and with little to try: valgrind is some fifty times slower than the processor.
COUNTED = {
    "default": ["--preset", "default", "--quality", 0],
    "loopsmart": ["--preset", "loopsmart", "--set", "quadruples=40000"],
}
COUNTED_PAIR, COUNTED_VOXEL = (0, 2), 0.2
PAIRS, MORE_INSTRUCTIONS = 1, 0.05


def gpureg(arguments, *words):
    done = subprocess.run([str(arguments.gpureg), *map(str, words)], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(f"error: gpureg {words[0]}: {done.stderr.strip()}")
    return done.stdout


def scene(arguments):
    folder = arguments.work / "scene"
    if not (folder / "gt_all.info").exists():
        gpureg(arguments, "generate", folder, *SCENE, "--quiet")
    return folder


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


def measure_accuracy(arguments):
    folder, found = scene(arguments), {}
    for name, words in RUNS.items():
        result, scores = arguments.work / f"{name}.json", arguments.work / f"{name}.scores.json"
        gpureg(
            arguments,
            "batch",
            folder,
            "--restart",
            "--backend",
            "cpu",
            "--voxel-size",
            VOXEL,
            *words,
            "-o",
            arguments.work / f"{name}.log",
            "--json",
            result,
            "--quiet",
        )
        gpureg(arguments, "evaluate", result, "--ground-truth", folder, "--json", scores)
        verdict = json.loads(scores.read_text())["scenes"][0]
        geometric = verdict["geometric"]
        found[name] = {
            "pairs": geometric["ground_truth"],
            "found": geometric["good_recall"],
            "right": sum(pair["strict"] for pair in verdict["pairs"]),
            "false": geometric["reported"] - geometric["good"],
        }
    return found


def worse_accuracy(baseline, found):
    complaints = []
    for name, old in baseline.items():
        new = found[name]
        if new["pairs"] != old["pairs"]:
            complaints.append(
                f"{name}: the generated scene has {new['pairs']} true pairs, that of the baseline {old['pairs']}: the generator changed; use --update"
            )
            continue
        for key in ("found", "right"):
            if new[key] < old[key] - PAIRS:
                complaints.append(
                    f"{name}: {key} {new[key]} of {new['pairs']} true pairs, baseline {old[key]}, margin {PAIRS}"
                )
        if new["false"] > old["false"] + PAIRS:
            complaints.append(
                f"{name}: {new['false']} false reports, baseline {old['false']}, margin {PAIRS}"
            )
    return complaints


def measure_instructions(arguments):
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        skip("valgrind is not installed, instructions cannot be counted")
    folder, found = scene(arguments), {}
    i, j = COUNTED_PAIR
    for name, words in COUNTED.items():
        command = [
            valgrind,
            "--tool=cachegrind",
            "--cache-sim=no",
            "--cachegrind-out-file=/dev/null",
            str(arguments.gpureg),
            "register",
            str(folder / f"cloud_bin_{j}.ply"),
            str(folder / f"cloud_bin_{i}.ply"),
            "--backend",
            "cpu",
            "--threads",
            "1",
            "--voxel-size",
            str(COUNTED_VOXEL),
            "--source-viewpoint",
            "0,0,0",
            "--target-viewpoint",
            "0,0,0",
            *map(str, words),
        ]
        done = subprocess.run(command, capture_output=True, text=True)
        count = re.search(r"I\s+refs:\s+([\d,]+)", done.stderr)
        if done.returncode not in (0, 1) or count is None:
            skip(
                f"valgrind cannot run the command here: {(done.stderr.strip().splitlines() or ['?'])[-1]}"
            )
        found[name] = int(count[1].replace(",", ""))
    return found


def worse_instructions(baseline, found):
    return [
        f"{name}: {found[name]:,} instructions, baseline {old:,}: {found[name] / old:.3f} of them, margin {1 + MORE_INSTRUCTIONS:.2f}"
        for name, old in baseline.items()
        if found[name] > old * (1 + MORE_INSTRUCTIONS)
    ]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=["accuracy", "instructions"])
    parser.add_argument("--gpureg", type=pathlib.Path, required=True)
    parser.add_argument(
        "--work", type=pathlib.Path, required=True, help="folder for the scene and results"
    )
    parser.add_argument("--compiler", default="", help="with version and flags")
    parser.add_argument(
        "--baseline", type=pathlib.Path, default=pathlib.Path(__file__).with_name("baseline.json")
    )
    parser.add_argument(
        "--update", action="store_true", help="write the measured figures as the new baseline"
    )
    arguments = parser.parse_args()
    if not arguments.gpureg.exists():
        sys.exit(f"error: there is no command {arguments.gpureg}")
    arguments.work.mkdir(parents=True, exist_ok=True)
    baseline = json.loads(arguments.baseline.read_text()) if arguments.baseline.exists() else {}
    if arguments.what not in baseline and not arguments.update:
        sys.exit(
            f"error: {arguments.baseline} says nothing about {arguments.what}; --update writes it"
        )
    built_by = f"{arguments.compiler}, {platform.machine()}"
    if (
        arguments.what == "instructions"
        and not arguments.update
        and baseline["instructions"]["built_by"] != built_by
    ):
        skip(
            f"instructions are compared only for '{baseline['instructions']['built_by']}', this is '{built_by}'"
        )
    found = (
        measure_accuracy(arguments)
        if arguments.what == "accuracy"
        else measure_instructions(arguments)
    )
    print(json.dumps(found))
    if arguments.update:
        baseline[arguments.what] = (
            found if arguments.what == "accuracy" else {"built_by": built_by, "counts": found}
        )
        arguments.baseline.write_text(json.dumps(baseline, indent=1) + "\n")
        return
    old = baseline[arguments.what]
    complaints = (
        worse_accuracy(old, found)
        if arguments.what == "accuracy"
        else worse_instructions(old["counts"], found)
    )
    for complaint in complaints:
        print(f"worse: {complaint}")
    sys.exit(1 if complaints else 0)


if __name__ == "__main__":
    main()
