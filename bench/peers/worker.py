#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One method in a process of its own: started by run.py, a line of JSON a pair, so that a peer that
hangs or crashes costs one pair.

usage: worker.py METHOD --check                       its description, or exit status 3 and the
reason why it is not installed
       worker.py METHOD CLOUDS PAIRS OUTPUT SEED      PAIRS: JSON list of [i, j, initial pose or
       null]"""

import json
import pathlib
import resource
import sys
import time

import clouds
import methods


def peak_memory():
    """MiB; by the kernel's account of this program alone."""
    for line in pathlib.Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main():
    name = sys.argv[1]
    try:
        method = methods.load(name)()
    except (ImportError, FileNotFoundError) as error:
        print(error, file=sys.stderr)
        sys.exit(3)
    if sys.argv[2] == "--check":
        print(
            json.dumps(
                {
                    "label": method.label,
                    "version": method.version(),
                    "parameters": method.parameters,
                    "threshold": method.threshold,
                    "refines": method.refines,
                }
            )
        )
        return
    import numpy as np

    folder, pairs, output, seed = (
        sys.argv[2],
        json.loads(pathlib.Path(sys.argv[3]).read_text()),
        sys.argv[4],
        int(sys.argv[5]),
    )
    base = peak_memory()
    prepared, elsewhere = {}, 0  # elsewhere: peak memory of a program that does the work
    with open(output, "a", buffering=1) as out:

        def say(record):
            out.write(json.dumps(record) + "\n")

        # The first call of many libraries starts threads and fills caches; it is not counted.
        numbers = sorted({number for i, j, _ in pairs for number in (i, j)})
        method.prepare(clouds.read(folder, numbers[0]))
        for number in numbers:
            cloud = clouds.read(folder, number)
            wall, processor = time.perf_counter(), time.process_time()
            prepared[number] = method.prepare(cloud)
            say(
                {
                    "fragment": number,
                    "points": len(cloud.points),
                    "ms": 1e3 * (time.perf_counter() - wall),
                    "processor_ms": 1e3 * (time.process_time() - processor),
                }
            )
        for i, j, initial in pairs:
            say({"begin": [i, j]})
            initial = None if initial is None else np.array(initial, np.float64).reshape(4, 4)
            if method.refines and initial is None:
                say({"i": i, "j": j, "pose": None, "score": 0.0, "ms": 0.0, "processor_ms": 0.0})
                continue
            wall, processor = time.perf_counter(), time.process_time()
            found = method.align(prepared[j], prepared[i], initial, seed)
            wall, processor = time.perf_counter() - wall, time.process_time() - processor
            pose = found.pop("pose")
            if pose is not None:
                pose = [float(v) for v in np.asarray(pose, np.float64).reshape(16)]
            elsewhere = max(elsewhere, found.pop("memory_mib", 0))
            say(
                {
                    "i": i,
                    "j": j,
                    "pose": pose,
                    "ms": 1e3 * wall,
                    "processor_ms": 1e3 * processor,
                    **found,
                }
            )
        say({"peak_memory_mib": elsewhere or peak_memory(), "before_mib": base})


main()
