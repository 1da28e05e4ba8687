#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws bench/notes/images/scaling.png, cost as the work grows, from bench/results/pipeline.json.
Needs matplotlib.
"""

import json
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECORD = json.loads((ROOT / "bench/results/pipeline.json").read_text())
RUNS = {
    run["name"].split("/real_time")[0].split("/iterations")[0]: run for run in RECORD["benchmarks"]
}


def runs(name):
    return [run for key, run in RUNS.items() if key.startswith(name + "/")]


def main():
    figure, (pair, scored, fragments) = plt.subplots(
        1, 3, figsize=(12.5, 3.8), constrained_layout=True
    )
    sizes = runs("points_per_cloud")
    points = [run["points"] for run in sizes]
    for stage in ("match", "propose", "rank"):
        pair.loglog(points, [run["ms_" + stage] for run in sizes], marker="o", label=stage)
    pair.loglog(
        points, [run["ms_per_pair"] for run in sizes], marker="o", color="black", label="all"
    )
    pair.set(xlabel="points a cloud", ylabel="ms a pair", title="one pair in a batch of 28")
    pair.legend(frameon=False)

    scored.semilogx(
        points,
        np.array([1e6 * run["ms_rank"] / run["survivors"] / run["points"] for run in sizes]),
        marker="o",
        label="rank: a point test",
    )
    scored.semilogx(
        points,
        np.array([1e6 * run["ms_match"] / run["points"] ** 2 for run in sizes]),
        marker="o",
        label="match: two features",
    )
    scored.set(xlabel="points a cloud", ylabel="ns", title="the same over the number of operations")
    scored.legend(frameon=False)

    many = runs("many_fragments")
    fragments.semilogx(
        [run["fragments"] for run in many],
        np.array([run["ms_per_fragment"] for run in many]),
        marker="o",
        color="black",
    )
    fragments.set(
        xlabel="fragments, each aligned with four others",
        ylabel="ms a fragment",
        title="from raw points to poses",
    )
    for axes in (scored, fragments):
        axes.set_ylim(0, 1.15 * max(line.get_ydata().max() for line in axes.get_lines()))
    for axes in (pair, scored, fragments):
        axes.grid(True, alpha=0.3)
    figure.savefig(ROOT / "bench/notes/images/scaling.png", dpi=110)


main()
