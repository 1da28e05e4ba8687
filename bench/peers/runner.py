# SPDX-License-Identifier: BSD-3-Clause
"""Runs one method on pairs of clouds, in a process of its own."""

import json
import os
import pathlib
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent


def check(name):
    """Description of a method, or the reason why it cannot run here."""
    done = subprocess.run(
        [sys.executable, HERE / "worker.py", name, "--check"], capture_output=True, text=True
    )
    if done.returncode == 0:
        return json.loads(done.stdout.strip().splitlines()[-1]), None
    lines = done.stderr.strip().splitlines()
    return None, lines[-1] if lines else f"exit status {done.returncode}"


def lines_of(path):
    return (
        [json.loads(line) for line in path.read_text().splitlines() if line.endswith("}")]
        if path.exists()
        else []
    )


def work(name, pairs, initial, folder, temporary, seed, threads, pair_timeout):
    """Runs the worker until every pair has its line; a pair that ends or hangs it is given up.

    Returns (lines of the pairs, lines of the fragments, memory, lost pairs), or (None, None, None,
    why)."""
    journal = temporary / f"{name}.jsonl"
    environment = dict(os.environ, PYTHONPATH=str(HERE))
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        environment[variable] = str(threads)
    lost, fragments, memory, done = [], {}, None, {}
    while True:
        left = [
            [i, j, initial.get((i, j))]
            for i, j in pairs
            if (i, j) not in done and (i, j) not in lost
        ]
        if not left:
            return list(done.values()), list(fragments.values()), memory, lost
        listing = temporary / f"{name}.pairs"
        listing.write_text(json.dumps(left))
        journal.unlink(missing_ok=True)
        child = subprocess.Popen(
            [sys.executable, HERE / "worker.py", name, folder, listing, journal, str(seed)],
            env=environment,
        )
        size, changed = 0, time.monotonic()
        while child.poll() is None:
            time.sleep(0.2)
            now = journal.stat().st_size if journal.exists() else 0
            if now != size:
                size, changed = now, time.monotonic()
            elif time.monotonic() - changed > pair_timeout:
                child.kill()
                child.wait()
        current = None
        for line in lines_of(journal):
            if "begin" in line:
                current = tuple(line["begin"])
            elif "fragment" in line:
                fragments[line["fragment"]] = line
            elif "peak_memory_mib" in line:
                memory = line
            else:
                done[line["i"], line["j"]] = line
                current = None
        if child.returncode != 0:
            if current is None:
                return None, None, None, f"exit status {child.returncode} before the first pair"
            lost.append(current)
            print(f"  {name}: gave up pair {current} (exit status {child.returncode})", flush=True)
