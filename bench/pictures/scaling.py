#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws cost as the work grows. Needs matplotlib.

bench/notes/images/scaling.png: pairs and fragments, from bench/results/pipeline.json;
bench/notes/images/map_scaling.png: a scan in a map, from bench/results/locate_city.json;
bench/notes/images/set_scaling.png: sets of several buildings, from bench/results/sets.json, where that is.
"""

import json
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]


def record(name):
    return json.loads((ROOT / "bench/results" / name).read_text())


def draw_maps():
    """Street sensors, voxels of 0.4 m: one row of runs for each size of the city."""
    runs = [run for run in record("locate_city.json")["runs"] if " 0.4 m" in run["map"]]
    points = [run["raw_points"] for run in runs]
    figure, (asked, built, kept) = plt.subplots(
        1, 3, figsize=(12.5, 3.8), constrained_layout=True, sharex=True
    )
    for axes, curves in (
        (
            asked,
            {
                "first_seconds": "first call of a process",
                "alone_seconds": "a scan alone",
                "batch_seconds": "a scan in a batch",
            },
        ),
        (built, {"build_seconds": "built", "load_seconds": "loaded, with the start of a process"}),
        (kept, {"build_memory_mib": "peak while building", "file_mib": "file"}),
    ):
        for key, label in curves.items():
            axes.loglog(points, [run[key] for run in runs], marker="o", label=label)
        axes.set_xlabel("raw points of the map")
        axes.grid(True, alpha=0.3)
        axes.legend(frameon=False)
    asked.set(ylabel="s", title="where is this scan?")
    built.set(ylabel="s", title="map")
    kept.set(ylabel="MiB", title="memory and file")
    figure.savefig(ROOT / "bench/notes/images/map_scaling.png", dpi=110)


def draw_pairs():
    all_runs = {
        run["name"].split("/real_time")[0].split("/iterations")[0]: run
        for run in record("pipeline.json")["benchmarks"]
    }

    def runs(name):
        return [run for key, run in all_runs.items() if key.startswith(name + "/")]

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


def draw_sets():
    """All pairs and --prune beside each other, by stage."""
    rows = record("sets.json")["runs"]
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), constrained_layout=True, sharey=True)
    for place, (title, chosen) in zip(
        axes,
        (
            ("all pairs", [row for row in rows if not row["prune"]]),
            ("--prune", [row for row in rows if row["prune"]]),
        ),
        strict=True,
    ):
        scans = [row["scans"] for row in chosen]
        for key, label in (
            ("prepare", "prepare"),
            ("prune", "prune"),
            ("align", "align"),
            ("graph", "audited map"),
            ("all", "from files to the map"),
        ):
            seconds = [row["seconds"][key] for row in chosen]
            if max(seconds, default=0) > 0:
                place.loglog(scans, seconds, marker="o", label=label)
        place.set(xlabel="scans", title=title)
        place.grid(True, alpha=0.3)
        place.legend(frameon=False)
    axes[0].set_ylabel("s")
    figure.savefig(ROOT / "bench/notes/images/set_scaling.png", dpi=110)


draw_pairs()
draw_maps()
if (ROOT / "bench/results/sets.json").exists():
    draw_sets()
