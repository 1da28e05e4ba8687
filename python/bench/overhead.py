#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What align_batch costs more from Python than from C++, on the same pairs, in turns; and how
threads scale.

cmake --build build/python/<tag> --target gpureg_python_reference
python python/bench/overhead.py scans/ --reference build/python/<tag>/bin/gpureg_python_reference
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import threading
import time

import gpureg


def overhead(arguments: argparse.Namespace) -> None:
    options = gpureg.RegistrationOptions.loopsmart()
    options.quadruples.count = arguments.quadruples
    clouds = [
        gpureg.prepare(scan[1]) for scan in gpureg._core.list_scans(arguments.folder, False)[0]
    ]
    pairs = [(j, i) for i in range(len(clouds)) for j in range(i + 1, len(clouds))]
    reference = subprocess.Popen(
        [arguments.reference, arguments.folder, str(arguments.quadruples)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert reference.stdin and reference.stdout
    seconds: dict[str, list[float]] = {"C++": [], "Python": []}
    for k in range(arguments.rounds + 1):
        reference.stdin.write("again\n")
        reference.stdin.flush()
        cpp = float(reference.stdout.readline())
        begin = time.perf_counter()
        results = gpureg.align_batch(
            clouds, pairs, options=options, progress=lambda done, total: None
        )
        python = time.perf_counter() - begin
        assert len(results) == len(pairs)
        if k > 0:  # the first warms up
            seconds["C++"].append(cpp)
            seconds["Python"].append(python)
    reference.stdin.close()
    reference.wait()
    cpp, python = statistics.median(seconds["C++"]), statistics.median(seconds["Python"])
    print(
        f"{gpureg.default_context().description}: {len(pairs)} pairs, {arguments.quadruples} quadruples, {arguments.rounds} rounds in turns"
    )
    for name, values in seconds.items():
        print(
            f"{name:7s} median {1e3 * statistics.median(values):.2f} ms, least {1e3 * min(values):.2f} ms"
        )
    print(
        f"overhead of the binding: {100 * (python / cpp - 1):+.2f} % (median), {100 * (min(seconds['Python']) / min(seconds['C++']) - 1):+.2f} % (least)"
    )


def scaling(arguments: argparse.Namespace) -> None:
    """The same work by one thread and by n, each with a context of one CPU thread."""
    options = gpureg.RegistrationOptions.loopsmart()
    options.quadruples.count = arguments.quadruples
    paths = [scan[1] for scan in gpureg._core.list_scans(arguments.folder, False)[0][:2]]
    contexts = [gpureg.Context.cpu(1) for _ in range(arguments.threads)]
    a, b = (gpureg.prepare(path, context=contexts[0]) for path in paths)
    results: list[list[float]] = [[] for _ in contexts]

    def work(k: int, times: int) -> None:
        for _ in range(times):
            results[k] = gpureg.align(
                b, a, options=options, context=contexts[k]
            ).target_from_source.tolist()

    def seconds(threads: int) -> float:
        workers = [
            threading.Thread(target=work, args=(k, 2 * arguments.threads // threads))
            for k in range(threads)
        ]
        begin = time.perf_counter()
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
        return time.perf_counter() - begin

    work(0, 1)
    one, many = seconds(1), seconds(arguments.threads)
    assert all(result == results[0] for result in results)
    print(f"{arguments.threads} threads: {one / many:.2f} times as fast as one, results equal")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder")
    parser.add_argument("--reference")
    parser.add_argument("--quadruples", type=int, default=gpureg.QuadrupleOptions().count)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=4)
    arguments = parser.parse_args()
    if arguments.reference:
        overhead(arguments)
    scaling(arguments)


if __name__ == "__main__":
    main()
