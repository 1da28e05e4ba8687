# SPDX-License-Identifier: BSD-3-Clause
"""Shared by the benchmarks: arguments, the command gpureg, cameras of a scene, and a JSON record with
the command and the commit that made it.
"""

import argparse
import os
import pathlib
import platform
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "bench"))
import rows

RAW = ("curve",)  # a row for each threshold: too much for a record


def plain_parser(description):
    return argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )


def parser(description, output):
    result = plain_parser(description)
    result.add_argument(
        "--gpureg", type=pathlib.Path, default=ROOT / "build/cpu/bin/gpureg", help="the command"
    )
    result.add_argument("--backend", default="auto", choices=["auto", "cpu", "cuda"])
    result.add_argument(
        "--data",
        type=pathlib.Path,
        default=os.environ.get("GPUREG_DATA_DIR"),
        help="folder of the real data sets (default: GPUREG_DATA_DIR)",
    )
    result.add_argument(
        "-o",
        "--output",
        type=pathlib.Path,
        default=ROOT / "bench/results" / output,
        help="the JSON record",
    )
    return result


def data_folder(arguments, name):
    if arguments.data is None:
        sys.exit("error: say where the data is, with --data or GPUREG_DATA_DIR")
    folder = pathlib.Path(arguments.data) / name
    if not folder.is_dir():
        sys.exit(f"error: there is no folder {folder}")
    return folder


def gpureg(arguments, *words):
    """Runs the command. Exit status 1, no alignment, is a result; any other failure ends the
    benchmark.
    """
    if not arguments.gpureg.exists():
        sys.exit(
            f"error: there is no command {arguments.gpureg}: build it, or name it with --gpureg"
        )
    done = subprocess.run([arguments.gpureg, *map(str, words)], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(f"error: gpureg {words[0]}: {done.stderr.strip()}")
    return done.stdout


def commit():
    """The commit of the working tree; with a plus sign where the library or the command differ from
    it. GPUREG_COMMIT: where git does not know.
    """

    def git(*words):
        return subprocess.run(
            ["git", "-C", ROOT, *words], capture_output=True, text=True
        ).stdout.strip()

    changed = git(
        "status",
        "--porcelain",
        "--untracked-files=no",
        "--",
        "include",
        "src",
        "cuda",
        "apps",
        "cmake",
        "CMakeLists.txt",
    )
    known = git("rev-parse", "--short=12", "HEAD")
    return known + ("+" if changed else "") if known else os.environ.get("GPUREG_COMMIT", "")


def processor():
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return f"{names[0]}, {len(names)} threads" if names else platform.processor()


def aggregates(value):
    """The value without its raw parts."""
    if isinstance(value, dict):
        return {key: aggregates(item) for key, item in value.items() if key not in RAW}
    return [aggregates(item) for item in value] if isinstance(value, list) else value


def save(path, content):
    """One row a line."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(rows.dumps(aggregates(content)) + "\n")


def write(arguments, command, content):
    """`command` is the line that makes this record again, free of this machine's paths."""
    record = {"command": command, "commit": commit(), "processor": processor(), **content}
    save(arguments.output, record)
    print(f"written: {arguments.output}")


def cameras(path):
    """Positions in each fragment's frame, in the order of the frames, by fragment; path: a scene's
    cameras.txt, which need not exist.
    """
    out = {}
    for values in map(str.split, path.read_text().splitlines() if path.exists() else []):
        if values:
            out.setdefault(int(values[0]), []).append([float(v) for v in values[2:5]])
    return out
