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
FILES = ["README.md", "docs/accuracy.md", "docs/performance.md"]


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


def open3d():
    record = load("open3d_ransac.json")
    ours, theirs = record["gpureg"], record["open3d"]
    rows = ["| method | ms per pair: mean, median | recall / precision |", "| --- | --- | --- |"]
    for name, own in ((f"gpureg `loopsmart`, {ours['hypotheses']:,} hypotheses, {record['environment']['description']}", ours),
                      (f"Open3D {theirs['version']}, RANSAC, {theirs['iterations']:,} iterations", theirs)):
        rows.append(f"| {name} | {own['ms_mean']:.0f}, {own['ms_median']:.0f} | {percent(own['recall'])} / {percent(own['precision'])} % |")
    return rows + ["", f"{record['processor']}; peak memory of gpureg with all {record['pairs']} pairs: {ours['peak_memory_mib']:.0f} MiB.", source(record) + "."]


def benchmarks():
    """Context and runs by name; of a benchmark that was repeated, the median."""
    record = load("pipeline_h200.json")
    runs = {run["name"].split("/real_time")[0].split("/iterations")[0]: run for run in record["benchmarks"]
            if run.get("aggregate_name", "median") == "median"}
    return record["context"], runs


def made_by(context):
    gpus = int(context.get("gpus", 1))
    return (f"Made by `scripts/gpu_check` at commit {context['commit']} on {'an' if gpus == 1 else f'one of {gpus}'} {context['gpu']}"
            f" and {context['num_cpus']} cores of its host.")


def speed():
    context, runs = benchmarks()
    batch, cpu = runs["align_many/cuda_loopsmart/11"]["ms_per_pair"], runs["align_many/cpu_loopsmart/1"]["ms_per_pair"]
    one, whole = runs["align_one/cuda_loopsmart"]["ms_median"], runs["raw_to_pose/cuda_loopsmart"]["ms_median"]
    fragment, on_cpu = runs["prepare_batch_of_fragments/cuda"]["ms_per_fragment"], runs["prepare_batch_of_fragments/cpu"]["ms_per_fragment"]
    naive = runs["paper_mode"]["ms_per_pair"]
    return [f"| | GPU, ms | naive on the GPU, ms | CPU, {context['num_cpus']} cores, ms |", "| --- | --- | --- | --- |",
            f"| a prepared pair, 4,000,000 hypotheses, in a batch | {batch:.2f} | {naive:.1f} ({naive / batch:.0f} x) | {cpu:.1f} ({cpu / batch:.0f} x) |",
            f"| a fragment prepared ({runs['prepare_batch_of_fragments/cuda']['raw_points'] / 1000:.0f}k raw points), in a batch | {fragment:.2f} | | {on_cpu:.1f} ({on_cpu / fragment:.0f} x) |",
            f"| one prepared pair alone, median | {one:.2f} | {runs['paper_mode']['ms_median']:.1f} | |",
            f"| one pair alone, from raw points in host memory to the pose, median | {whole:.2f} | | |",
            "", made_by(context)]


def pipeline():
    context, runs = benchmarks()
    rows = [("a prepared pair, `loopsmart`, in a batch of 2,090", "align_many/cuda_loopsmart/11", "ms_per_pair", 0.10),
            ("a prepared pair, `default`, in a batch of 2,090", "align_many/cuda_default/11", "ms_per_pair", None),
            ("a pair in the naive mode, one after the other", "paper_mode", "ms_per_pair", None),
            ("a prepared pair on the CPU of the host, in a batch of 190", "align_many/cpu_loopsmart/1", "ms_per_pair", None),
            ("one prepared pair alone, median of 190", "align_one/cuda_loopsmart", "ms_median", 0.4),
            ("one pair alone, raw points in host memory to the pose, median of 100", "raw_to_pose/cuda_loopsmart", "ms_median", 3.0),
            ("a fragment prepared, in a batch of 20", "prepare_batch_of_fragments/cuda", "ms_per_fragment", 0.5),
            ("a fragment prepared alone", "prepare_one_fragment/cuda", "ms_per_fragment", 1.5),
            ("the same on the CPU, in a batch of 20", "prepare_batch_of_fragments/cpu", "ms_per_fragment", None),
            ("207 fragments and 5,280 pairs from raw points, cold", "redwood_sized/cuda", "real_time", 1500.0)]
    out = ["| | ms | goal | ms / goal |", "| --- | --- | --- | --- |"]
    for text, name, key, goal in rows:
        value = runs[name][key]
        out.append(f"| {text} | {value:.3g} | {'' if goal is None else f'{goal:g}'} | {'' if goal is None else f'{value / goal:.2f}'} |")
    return out + ["", made_by(context)]


def devices():
    context, runs = benchmarks()
    one = runs["redwood_sized/cuda"]
    out = ["| devices | ms | faster by | preparation, ms | memory of each device, GiB |", "| --- | --- | --- | --- | --- |"]
    for run in [one] + ([runs["redwood_sized/cuda_all"]] if int(context.get("gpus", 1)) > 1 else []):
        out.append(f"| {run['devices']:.0f} | {run['real_time']:.0f} | {one['real_time'] / run['real_time']:.2f} x | {run['ms_prepare']:.0f} | {run['GiB_per_device']:.1f} |")
    return out + ["", f"Made by `scripts/gpu_check` at commit {context['commit']} on {context['gpu']}."]


def scaling():
    """Beside what was measured, what the number of operations predicts from the second row: feature products, and tests of points."""
    context, runs = benchmarks()
    sizes = [runs[f"points_per_cloud/{n}"] for n in (1000, 5000, 20000, 100000)]
    base = sizes[1]
    out = ["| points a cloud | hypotheses scored | match, ms | sample, ms | score, ms | a pair, ms | by the operations, ms |",
           "| --- | --- | --- | --- | --- | --- | --- |"]
    for run in sizes:
        points, survivors = run["points"] / base["points"], run["survivors"] / base["survivors"]
        rest = base["ms_per_pair"] - base["ms_match"] - base["ms_score"]
        predicted = base["ms_match"] * points ** 2 + base["ms_score"] * survivors * points + rest
        out.append(f"| {run['points']:,.0f} | {run['survivors']:,.0f} | {run['ms_match']:.3f} | {run['ms_sample']:.3f} | {run['ms_score']:.2f} | "
                   f"{run['ms_per_pair']:.2f} | {predicted:.2f} |")
    out += ["", "| raw points | prepared points | a fragment, ms |", "| --- | --- | --- |"]
    out += [f"| {n:,} | {runs[f'raw_points/{n}']['points']:,.0f} | {runs[f'raw_points/{n}']['ms_per_fragment']:.2f} |" for n in (100000, 300000, 1000000)]
    out += ["", "| fragments, each with four others | ms | ms a fragment | memory of the device, GiB |", "| --- | --- | --- | --- |"]
    for n in (10, 50, 200, 500, 2000):
        run = runs[f"many_fragments/{n}"]
        out.append(f"| {n:,} | {run['real_time']:.0f} | {run['ms_per_fragment']:.2f} | {run['GiB_per_device']:.1f} |")
    return out + ["", made_by(context)]


def floors():
    context, runs = benchmarks()
    run = runs["align_many/cuda_loopsmart/11"]
    points, survivors = run["points"], run["survivors"]
    instructions = 29.6e12
    floor = {"match": 2 * points ** 2 * 40 * 2 / 495e12 * 1e3, "sample": 4e6 * 100 / instructions * 1e3, "fit": survivors * 2500 / instructions * 1e3,
             "score": survivors * points * 0.75 * 36 / instructions * 1e3}
    what = {"match": "two products of 40 dimensions for every two features", "sample": "100 instructions a hypothesis",
            "fit": "2,500 instructions a survivor", "score": "36 instructions for each of three quarters of the point tests"}
    out = ["| stage | ms a pair | floor, ms | ratio | the floor counts |", "| --- | --- | --- | --- | --- |"]
    for stage in floor:
        out.append(f"| {stage} | {run['ms_' + stage]:.4f} | {floor[stage]:.4f} | {run['ms_' + stage] / floor[stage]:.1f} | {what[stage]} |")
    return out + [f"| judge, refine | {run['ms_judge'] + run['ms_refine']:.4f} | | | |"]


TABLES = {"redkitchen": redkitchen, "redkitchen_seeds": redkitchen_seeds, "range_pairs": range_pairs, "other_pairs": other_pairs,
          "open3d": open3d, "speed": speed, "pipeline": pipeline, "devices": devices, "scaling": scaling, "floors": floors}


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
