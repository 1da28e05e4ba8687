#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""sphere2500 with 0 to 90 % false loops: gpureg against GTSAM and Open3D.

    cmake --preset cpu && cmake --build --preset cpu --target gpureg_pose_graph_runner
    python3 -m venv build/pose-graph-peers
    build/pose-graph-peers/bin/pip install numpy gtsam==4.3.0 open3d==0.20.0
    build/pose-graph-peers/bin/python bench/pose_graph/run.py

Writes bench/results/pose_graph.json; bench/readme_table.py makes the table. --methods, --percent, --seeds, --nodes
and --limit choose a part; runs that are in the record already are kept unless --fresh. The graph
comes from GTSAM's wheel. The peers are no dependency of the library.
"""

from __future__ import annotations

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import sphere

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "bench"))
from rows import dumps

OURS = {
    "gpureg": "gnc",
    "gpureg_without_consensus": "gnc_plain",
    "gpureg_line_process": "line_process",
    "gpureg_least_squares": "none",
}
PEERS = ("gtsam_gnc", "gtsam_lm", "open3d")


def solve(method: str, graph: sphere.SphereGraph, folder: pathlib.Path, limit: float) -> dict:
    """ATE, accepted loops and seconds of one method; or why there are none."""
    out = folder / "out"
    if method in OURS:
        sphere.write_g2o(folder / "graph.g2o", graph)
        runner = ROOT / "build/cpu/bin/gpureg_pose_graph_runner"
        command = [runner, folder / "graph.g2o", out, OURS[method], "2"]
    else:
        np.savez(
            folder / "graph.npz",
            ends=graph.ends,
            poses=graph.poses,
            information=graph.information,
            odometry=graph.odometry,
            initial=graph.initial(),
        )
        out = folder / "out.npz"
        here = pathlib.Path(__file__).parent
        command = [sys.executable, here / "peers.py", folder / "graph.npz", method, out]
    try:
        done = subprocess.run(
            [str(c) for c in command], capture_output=True, text=True, timeout=limit
        )
    except subprocess.TimeoutExpired:
        return {"failed": f"no result after {limit:g} s"}
    if done.returncode:
        lines = done.stderr.strip().splitlines()
        return {"failed": lines[-1] if lines else f"exit status {done.returncode}"}
    if method in OURS:
        lines = out.read_text().splitlines()
        seconds, cpu_seconds = (float(x) for x in lines[0].split()[1:3])
        poses = np.array([line.split() for line in lines[1:-1]], float).reshape(-1, 3, 4)
        accepted = np.array(lines[-1].split(), int) > 0
    else:
        data = np.load(out)
        seconds, cpu_seconds = float(data["seconds"]), float(data["cpu_seconds"])
        poses, accepted = data["poses"], data["accepted"]
    loops = ~graph.odometry
    return {
        "ate": sphere.ate(poses[:, :3, 3], graph.truth[:, :3, 3]),
        "seconds": seconds,
        "cpu_seconds": cpu_seconds,  # other programs on the machine change it little
        "true_accepted": int((accepted & loops & ~graph.false).sum()),
        "false_accepted": int((accepted & graph.false).sum()),
        "true_loops": int((loops & ~graph.false).sum()),
        "false_loops": int(graph.false.sum()),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--methods", nargs="+", default=["gpureg", "gtsam_lm", "gtsam_gnc", "open3d"]
    )
    parser.add_argument("--percent", nargs="+", type=int, default=list(range(0, 100, 10)))
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    parser.add_argument("--kinds", nargs="+", default=["random", "consistent"])
    parser.add_argument("--nodes", nargs="+", type=int, default=[2500])
    parser.add_argument("--limit", type=float, default=300, help="seconds per run")
    parser.add_argument("--fresh", action="store_true", help="run again what is recorded")
    parser.add_argument("--data", type=pathlib.Path, help="folder of sphere2500.txt")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "bench/results/pose_graph.json")
    arguments = parser.parse_args()
    data = arguments.data
    if data is None:
        import gtsam

        data = pathlib.Path(gtsam.__file__).parent / "Data"
    record = json.loads(arguments.out.read_text()) if arguments.out.exists() else {}
    runs = record.setdefault("runs", {})
    for nodes in arguments.nodes:
        base = sphere.load(data, nodes)
        for percent in arguments.percent:
            for kind in arguments.kinds:
                for seed in arguments.seeds if percent else arguments.seeds[:1]:
                    graph = sphere.with_false_loops(base, percent, kind, seed)
                    for method in arguments.methods:
                        if method == "gtsam_lm" and percent:
                            continue
                        key = f"{method} {nodes} {kind} {percent} {seed}"
                        if key in runs and not arguments.fresh:
                            continue
                        with tempfile.TemporaryDirectory() as folder:
                            run = solve(method, graph, pathlib.Path(folder), arguments.limit)
                        runs[key] = {
                            "method": method,
                            "nodes": nodes,
                            "kind": kind,
                            "percent": percent,
                            "seed": seed,
                            **run,
                        }
                        print(key, run, flush=True)
                        arguments.out.write_text(dumps(record) + "\n")


if __name__ == "__main__":
    main()
