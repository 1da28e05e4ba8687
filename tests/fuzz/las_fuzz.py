# SPDX-License-Identifier: BSD-3-Clause
"""Fuzzes the reader of LAS and LAZ files by random changes.

    las_fuzz.py --minutes N [--findings DIR]   needs laspy[lazrs]; scripts/check fuzz las runs it

A process of its own reads the files, a hundred each: an abort or more than 512 MiB is a finding,
and so is any exception but IoError.
"""

from __future__ import annotations

import argparse
import importlib
import pathlib
import random
import resource
import subprocess
import sys
import tempfile
import time
import types

FILES_OF_A_PROCESS = 100
MOST_MEMORY = 512 << 20
# Of the header (LAS 1.4): offset and number of VLRs, format, record length, counts, first EVLR.
FIELDS = [(94, 2), (96, 4), (100, 4), (104, 1), (105, 2), (107, 4), (235, 8), (243, 4), (247, 8)]


def import_reader() -> types.ModuleType:
    """The reader of this source tree, which needs of the compiled module only the exception."""
    package, core = types.ModuleType("gpureg"), types.ModuleType("gpureg._core")
    package.__path__ = [str(pathlib.Path(__file__).parents[2] / "python/gpureg")]
    core.IoError = type("IoError", (RuntimeError,), {})
    sys.modules.update({"gpureg": package, "gpureg._core": core})
    return importlib.import_module("gpureg._las")


def seed_files(folder: pathlib.Path) -> list[bytes]:
    import laspy
    import numpy as np

    rng = np.random.default_rng(1)
    out = []
    for version, format_id, count in (("1.2", 3, 500), ("1.4", 6, 500), ("1.2", 0, 51000)):
        file = laspy.create(point_format=format_id, file_version=version)
        file.header.scales, file.header.offsets = [0.001] * 3, [5e5, 5.4e6, 300]
        file.x, file.y, file.z = (rng.integers(0, 50, (count, 3)) + file.header.offsets).T
        for name in ("seed.las", "seed.laz"):
            file.write(str(folder / name))
            out.append((folder / name).read_bytes())
    return out


def mutate(content: bytes, rng: random.Random) -> bytes:
    data = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        kind = rng.randrange(5)
        if kind == 0 and len(data) > 400:  # a field of the header, to a value near a limit
            at, size = rng.choice(FIELDS)
            value = rng.choice([0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1, len(data)])
            data[at : at + size] = (value % 256**size).to_bytes(size, "little")
        elif kind == 1:  # a byte of the header, the VLRs or the start of the points
            if data:
                data[rng.randrange(min(len(data), 600))] = rng.randrange(256)
        elif kind == 2 and data:
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        elif kind == 3:
            del data[rng.randrange(len(data) + 1) :]
        elif data:  # LAZ ends in its table of chunks
            data[rng.randrange(max(0, len(data) - 64), len(data))] = rng.randrange(256)
    return bytes(data)


def work(seed: int, path: pathlib.Path) -> None:
    reader = import_reader()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    rng = random.Random(seed)
    seeds = seed_files(path.parent)
    read = 0
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    resource.setrlimit(resource.RLIMIT_AS, (before + 2 * MOST_MEMORY, before + 2 * MOST_MEMORY))
    for _ in range(FILES_OF_A_PROCESS):
        path.write_bytes(mutate(rng.choice(seeds), rng))
        try:
            points = reader.read_las(path)
            read += 1
            assert points.ndim == 2 and points.shape[1] == 3
        except reader.IoError as error:
            assert str(path) in str(error)
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 < before + MOST_MEMORY
    print(read)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1)
    parser.add_argument("--findings", default="build/fuzz/findings")
    parser.add_argument("--work", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--path", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.work is not None:
        work(arguments.work, pathlib.Path(arguments.path))
        return 0
    found, read, seed, end = 0, 0, 0, time.monotonic() + 60 * arguments.minutes
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "input.laz"
        while seed == 0 or time.monotonic() < end:
            command = [sys.executable, __file__, "--work", str(seed), "--path", str(path)]
            done = subprocess.run(command, capture_output=True, text=True, timeout=600)
            if done.returncode == 0:
                read += int(done.stdout.split()[-1])
            else:
                found += 1
                findings = pathlib.Path(arguments.findings)
                findings.mkdir(parents=True, exist_ok=True)
                (findings / f"las-{seed}").write_bytes(path.read_bytes())
                print(f"las-{seed}: exit {done.returncode}: {done.stderr.strip()[-300:]}")
            seed += 1
    print(f"las: {seed * FILES_OF_A_PROCESS} inputs, {read} read, {found} findings")
    return min(found, 1)


if __name__ == "__main__":
    sys.exit(main())
