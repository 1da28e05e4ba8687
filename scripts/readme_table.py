#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the tables of measured figures in README.md and docs/accuracy.md from the records in bench/results.

A table stands between <!-- table NAME --> and <!-- end -->; no figure in it is typed by hand.
usage: readme_table.py          rewrite the tables
       readme_table.py --check  exit status 1 where a file does not say what the records say"""
import argparse
import json
import pathlib
import re
import statistics
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
RESULTS = ROOT / "bench/results"
FILES = ["README.md", "docs/accuracy.md"]


def load(name):
    return json.loads((RESULTS / name).read_text())


def percent(value):
    return f"{100 * value:.1f}"


def mean(values):
    return statistics.fmean(values)


def source(record):
    return f"Made by `{record['command']}` at commit {record['commit'].rstrip('+')}"


def redkitchen():
    rows = ["| preset | right when every best candidate is reported | reported: recall / precision | recall at precision >= 95 % | average precision |",
            "| --- | --- | --- | --- | --- |"]
    sources = []
    for file in sorted(RESULTS.glob("redkitchen_*.json"), reverse=True):
        record = json.loads(file.read_text())
        strict = [run["evaluate"]["strict"] for run in record["runs"]]
        rows.append(f"| `{record['preset']}` | {percent(mean(s['raw_recall'] for s in strict))} % | {percent(mean(s['recall'] for s in strict))} / "
                    f"{percent(mean(s['precision'] for s in strict))} % | {percent(mean(s['recall_at_precision']['95'] for s in strict))} % | "
                    f"{percent(mean(s['average_precision'] for s in strict))} % |")
        sources.append(source(record))
    return rows + ["", *[line + "." for line in sources]]


def redkitchen_seeds():
    rows = ["| preset | seed | right, best candidates | reported recall | precision | geometric precision |", "| --- | --- | --- | --- | --- | --- |"]
    for file in sorted(RESULTS.glob("redkitchen_*.json"), reverse=True):
        record = json.loads(file.read_text())
        for run in record["runs"]:
            strict, geometric = run["evaluate"]["strict"], run["evaluate"]["geometric"]
            rows.append(f"| `{record['preset']}` | {run['seed']} | {percent(strict['raw_recall'])} % | {percent(strict['recall'])} % "
                        f"({strict['good_recall']} of {strict['ground_truth']}) | {percent(strict['precision'])} % ({strict['good']} of "
                        f"{strict['reported']}) | {percent(geometric['precision'])} % |")
    return rows


def range_pairs():
    rows = ["| method | RMSE, mean / max | pairs below .01 / .02 / .05 |", "| --- | --- | --- |"]
    sources, best = [], []
    for file in sorted(RESULTS.glob("range_pairs*.json")):
        record = json.loads(file.read_text())
        runs = record["runs"]
        below = " / ".join(f"{mean(run[f'below_{bound}'] for run in runs):.2f}" for bound in (0.01, 0.02, 0.05))
        best.append(mean(run["rmse_mean_of_truth"] for run in runs))
        rows.append(f"| gpureg, default options, voxel {record['options']['prepare']['voxel_size']:g} | {mean(run['rmse_mean'] for run in runs):.4f} / "
                    f"{max(run['rmse_max'] for run in runs):.4f} | {below} |")
        sources.append(source(record) + ".")
    rows.append("| Fast Global Registration, as published | 0.0104 / 0.0193 | 0.60 / 1.00 / 1.00 |")
    return rows + [f"| (the ground truth itself) | {best[0]:.4f} | |", "", *sources]


def other_pairs():
    record = load("other_pairs.json")
    rows = ["| pair | seed | status | off by |", "| --- | --- | --- | --- |"]
    for run in record["lidar"]:
        what = "refined" if run["refined"] else "before refinement"
        rows.append(f"| LiDAR, {what} | {run['seed']} | {run['status']} | {run['metres']:.3f} m, {run['degrees']:.2f} deg |")
    for run in record["redwood_sample"]:
        rows.append(f"| Redwood's sample fragments | {run['seed']} | {run['status']} | inlier ratio {run['score']:.2f} (no ground truth) |")
    return rows + ["", source(record) + "."]


TABLES = {"redkitchen": redkitchen, "redkitchen_seeds": redkitchen_seeds, "range_pairs": range_pairs, "other_pairs": other_pairs}


def rewritten(text):
    def table(match):
        return match[1] + "\n" + "\n".join(TABLES[match[2]]()) + "\n" + match[3]
    return re.sub(r"(<!-- table (\w+) -->)\n.*?(<!-- end -->)", table, text, flags=re.DOTALL)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    check = parser.parse_args().check
    stale = []
    for name in FILES:
        text = (ROOT / name).read_text()
        new = rewritten(text)
        if new != text:
            stale.append(name)
            if not check:
                (ROOT / name).write_text(new)
    if check and stale:
        sys.exit(f"error: {', '.join(stale)}: run scripts/readme_table.py")


main()
