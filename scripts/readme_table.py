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
FILES = ["README.md", "docs/accuracy.md", "docs/benchmarks.md", "docs/performance.md"]


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
        rows.append(f"| Redwood's sample fragments | {run['seed']} | {run['status']} | confidence {run['score']:.2f} (no ground truth) |")
    return rows + ["", source(record) + "."]


PEER_SCENES = {"peers_redkitchen.json": "red kitchen", "peers_house_a.json": "house A"}


def peer_label(entry):
    return f"{entry['label']} {entry['version']}" if not entry["label"].startswith("gpureg") else entry["label"]


def made_with(record):
    """A record whose parts were measured at several commits names them all."""
    commits = sorted({entry["commit"].rstrip("+") for entry in record["methods"].values()})
    return f"Made by `{record['command']}` at commit {', '.join(commits)} on {record['processor']}."


def peers():
    """Both scenes side by side; only what places a cloud globally."""
    records = [load(name) for name in PEER_SCENES]
    rows = ["| method | " + " | ".join(f"{scene}: right, % | recall at precision >= 95 %: strict, geometric | processor ms a pair" for scene in PEER_SCENES.values()) + " |",
            "| --- |" + " --- | --- | --- |" * len(records)]
    for name, entry in records[0]["methods"].items():
        if entry["refines"]:
            continue
        cells = []
        for record in records:
            own = record["methods"].get(name)
            if own is None:
                cells += ["", "", ""]
                continue
            cells += [percent(own["strict"]["raw_recall"]), f"{percent(own['strict']['recall_at_precision']['95'])}, "
                      f"{percent(own['geometric']['recall_at_precision']['95'])}", f"{own['processor_ms_per_pair']:.0f}"]
        rows.append(f"| {peer_label(entry)} | " + " | ".join(cells) + " |")
    devices = [benchmarks(), benchmarks("pipeline_h200_house_a.json")]
    for preset in ("default", "loopsmart"):
        cells = []
        for _, runs in devices:
            cells += ["as above", "as above", f"{runs[f'align_many/cuda_{preset}/11']['ms_per_pair']:.2f} (device)"]
        rows.append(f"| gpureg `{preset}`, {devices[0][0]['gpu'].rsplit(' ', 1)[0]}, in a batch | " + " | ".join(cells) + " |")
    commits = sorted({context["commit"] for context, _ in devices})
    return rows + ["", *[made_with(record) for record in records],
                   f"The device's times: `gpureg_pipeline_bench` on all pairs at commit {', '.join(commits)}, on another machine, so no ratio is meant."]


def peers_of(file):
    record = load(file)
    base = record["methods"]["gpureg_default"]["processor_ms_per_pair"]
    rows = ["| method | right, % | recall / precision, % | R@P95, % | AP, % | geometric R@P95, % | ms a fragment | ms a pair | processor ms a pair | of gpureg's | peak MiB |",
            "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"]
    for entry in record["methods"].values():
        strict = entry["strict"]
        prepared = f"{entry['ms_per_fragment']:.0f}" if entry["ms_per_fragment"] >= 0.5 else "-"
        rows.append(f"| {peer_label(entry)} | {percent(strict['raw_recall'])} | {percent(strict['recall'])} / {percent(strict['precision'])} | "
                    f"{percent(strict['recall_at_precision']['95'])} | {percent(strict['average_precision'])} | {percent(entry['geometric']['recall_at_precision']['95'])} | "
                    f"{prepared} | {entry['ms_per_pair']:.0f} | {entry['processor_ms_per_pair']:.0f} | {entry['processor_ms_per_pair'] / base:.2f} | {entry['peak_memory_mib']} |")
    return rows + ["", f"{record['chosen'][0].upper()}{record['chosen'][1:]}.", made_with(record)]


def peers_redkitchen():
    return peers_of("peers_redkitchen.json")


def peers_house():
    return peers_of("peers_house_a.json")


def peer_parameters():
    record = load("peers_redkitchen.json")
    return ["| method | parameters | reported from |", "| --- | --- | --- |"] + [
        f"| {peer_label(e)} | {e['parameters']} | {'its own confidence' if e['threshold'] is None and not e['refines'] else '' if e['threshold'] is None else format(e['threshold'], 'g')} |"
        for e in record["methods"].values()]


def fgr():
    record = load("fgr.json")
    rows = ["| method | RMSE, mean / max | pairs below .01 / .02 / .05 |", "| --- | --- | --- |"]
    for entry in record["methods"].values():
        lost = f"; {entry['without_pose']} without a pose" if entry["without_pose"] else ""
        rows.append(f"| {peer_label(entry)} | {entry['rmse_mean']:.4f} / {entry['rmse_max']:.4f} | " + " / ".join(f"{entry[f'below_{b}']:.2f}" for b in ("0.01", "0.02", "0.05")) + f"{lost} |")
    for row in record["published"]:
        shares = " / ".join("-" if share is None else f"{share:.2f}" for share in row["below"])
        rows.append(f"| *{row['label']}* | {row['rmse_mean']:.4f} / {row['rmse_max']:.4f} | {shares} |")
    return rows + [f"| *(the ground truth itself)* | {record['rmse_of_truth']:.4f} | |", "", source(record) + "."]


def redwood():
    """The paper's table of the committed record."""
    record = load("redwood.json")
    names = [scene["name"] for scene in record["scenes"]]
    rows = ["| method | " + " | ".join(f"{name}: recall / precision, %" for name in names) + " | geometric precision, % | registration recall, 3DMatch / 3DLoMatch, % |",
            "| --- |" + " --- |" * (len(names) + 2)]
    for method in record["methods"]:
        means = [method["scenes"][name]["mean"] for name in names]

        def pm(entry):
            return percent(entry["mean"]) + (f" ± {100 * entry['stdev']:.1f}" if entry["stdev"] else "")
        recalls = {log: value for m in means for log, value in m["registration_recall"].items()}
        registration = " / ".join(percent(recalls[log]["mean"]) if log in recalls else "-" for log in ("official_3dmatch_gt.log", "official_3dlomatch_gt.log"))
        rows.append(f"| {method['label']} | " + " | ".join(f"{pm(m['strict']['recall'])} / {pm(m['strict']['precision'])}" for m in means) +
                    f" | {percent(mean(m['geometric']['precision']['mean'] for m in means))} | {registration} |")
    return rows + ["", source(record) + f"; seeds {', '.join(map(str, record['seeds']))}."]


def benchmarks(file="pipeline_h200.json"):
    """Context and runs by name; of a benchmark that was repeated, the median."""
    record = load(file)
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
            ("a pair in the naive mode, one after the other", "paper_mode", "ms_per_pair", None),
            ("a prepared pair on the CPU of the host, in a batch of 190", "align_many/cpu_loopsmart/1", "ms_per_pair", None),
            ("a prepared pair, `default`, in a batch of 2,090", "align_many/cuda_default/11", "ms_per_pair", 0.4),
            ("one prepared pair alone, `loopsmart`, median of 190", "align_one/cuda_loopsmart", "ms_median", 0.4),
            ("one prepared pair alone, `default`, median of 190", "align_one/cuda_default", "ms_median", 2.0),
            ("one pair alone, raw points in host memory to the pose, median of 100", "raw_to_pose/cuda_loopsmart", "ms_median", 3.0),
            ("a fragment prepared, in a batch of 20", "prepare_batch_of_fragments/cuda", "ms_per_fragment", 0.5),
            ("a fragment prepared for `default`, in a batch of 20", "prepare_batch_of_fragments/cuda_default", "ms_per_fragment", None),
            ("a fragment prepared alone", "prepare_one_fragment/cuda", "ms_per_fragment", 1.5),
            ("the same on the CPU, in a batch of 20", "prepare_batch_of_fragments/cpu", "ms_per_fragment", None),
            ("207 fragments and 5,280 pairs from raw points, cold", "redwood_sized/cuda", "real_time", 1500.0)]
    out = ["| | ms | goal | ms / goal |", "| --- | --- | --- | --- |"]
    for text, name, key, goal in rows:
        value = runs[name][key]
        out.append(f"| {text} | {value:.3g} | {'' if goal is None else f'{goal:g}'} | {'' if goal is None else f'{value / goal:.2f}'} |")
    return out + ["", made_by(context)]


def pipeline_house():
    context, runs = benchmarks("pipeline_h200_house_a.json")
    stages = ("match", "sample", "fit", "score", "refine", "judge")
    out = ["| | ms | " + " | ".join(stages) + " |", "| --- | --- |" + " --- |" * len(stages)]
    for text, name, key in (("a prepared pair, `default`, in a batch of 13,475", "align_many/cuda_default/11", "ms_per_pair"),
                            ("one prepared pair alone, `default`, median of 190", "align_one/cuda_default", "ms_median"),
                            ("a prepared pair, `loopsmart`, in a batch of 13,475", "align_many/cuda_loopsmart/11", "ms_per_pair"),
                            ("one prepared pair alone, `loopsmart`, median of 190", "align_one/cuda_loopsmart", "ms_median")):
        run = runs[name]
        out.append(f"| {text} | {run[key]:.2f} | " + " | ".join(f"{run['ms_' + stage]:.3f}" for stage in stages) + " |")
    out.append(f"| a fragment prepared for `default`, in a batch of 50 | {runs['prepare_batch_of_fragments/cuda_default']['ms_per_fragment']:.2f} | | | | | | |")
    return out + ["", f"{context['scene']}, {runs['align_many/cuda_default/11']['points']:,.0f} points a fragment. Made by `gpureg_pipeline_bench` with"
                  f" `GPUREG_BENCH_SCENE` at commit {context['commit']} on an {context['gpu']} and {context['num_cpus']} cores of its host."]


def confidence():
    """Fits that have not seen the building they are tested on; means over the runs (seeds) of each scene."""
    groups = {}
    for run in load("confidence.json")["runs"]:
        groups.setdefault((run["model"], run["scene"]), []).append(run)
    out = ["| viewpoints | scene | runs | found among the modes / best, % | geometric R@P95 / R@P99 / AP, % | strict R@P95 / AP, % | ECE | right above 0.9, % |",
           "| --- | --- | --- | --- | --- | --- | --- | --- |"]
    for (model, scene), runs in groups.items():
        of = lambda key: mean(run[key] for run in runs)  # noqa: B023,E731
        out.append(f"| {'known' if model == 'with_free_space' else 'unknown'} | {scene} | {len(runs)} | {of('generated'):.1f} / {of('raw'):.1f} | {of('geo_R@P95'):.1f} / "
                   f"{of('geo_R@P99'):.1f} / {of('geo_AP'):.1f} | {of('strict_R@P95'):.1f} / {of('strict_AP'):.1f} | {of('ECE'):.3f} | {of('right_above_0.9'):.1f} |")
    return out


def agreement():
    record = load("agreement.json")
    out = ["| scene | | best right, % | R@P95 / R@P99 / AP, % | ECE | above 0.9 | of them right, % |", "| --- | --- | --- | --- | --- | --- | --- |"]
    for scene in record["scenes"]:
        for text, of in (("each pair alone", scene["before"]), ("with agreement", scene["after"])):
            out.append(f"| {scene['scene']} | {text} | {of['raw_recall']:.1f} | {of['R@P95']:.1f} / {of['R@P99']:.1f} / {of['AP']:.1f} | "
                       f"{of['calibration_error']:.3f} | {of['above_0.9']} | {of['right_above_0.9']:.1f} |")
    return out


def accuracy_sweep():
    record = load("accuracy_sweep.json")
    scenes = [key for key in record["rows"][0] if key != "setting"]
    return [f"| setting | {' | '.join(scenes)} |", "| --- |" + " --- |" * len(scenes),
            *[f"| {row['setting']} | " + " | ".join(" / ".join(f"{v:.1f}" for v in row[s]) for s in scenes) + " |" for row in record["rows"]],
            "", f"Seeds {' and '.join(map(str, record['seeds']))} at commit {record['commit']}, with the confidence shipped there."]


def pipeline_steps():
    steps = load("pipeline_steps.json")["steps"]
    cell = lambda step, scene: f"{step[scene]:.2f}" if scene in step else ""  # noqa: E731
    return ["| | commit | red kitchen | house |", "| --- | --- | --- | --- |",
            *[f"| {s['step']} | {s['commit']} | {cell(s, 'red kitchen')} | {cell(s, 'house/A')} |" for s in steps]]


def accuracy_attempts():
    record = load("accuracy_attempts.json")
    scenes = list(record["before"])
    rows = ["| tried | " + " | ".join(scenes) + " | |", "| --- |" + " --- |" * (len(scenes) + 1)]
    for entry in [{"tried": "(nothing)", **record["before"]}, *record["attempts"]]:
        cells = [f"{entry[s][0]:.1f} / {entry[s][1]:.1f}" if s in entry else "" for s in scenes]
        rows.append(f"| {entry['tried']} | {' | '.join(cells)} | {entry.get('remark', '')} |")
    return rows


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
    floor = {"match": 2 * points ** 2 * 48 * 2 / 990e12 * 1e3, "sample": 4e6 * 100 / instructions * 1e3, "fit": survivors * 2500 / instructions * 1e3,
             "score": survivors * points * 0.75 * 36 / instructions * 1e3}
    what = {"match": "two products of 48 dimensions for every two features", "sample": "100 instructions a hypothesis",
            "fit": "2,500 instructions a survivor", "score": "36 instructions for each of three quarters of the point tests"}
    out = ["| stage | ms a pair | floor, ms | ratio | the floor counts |", "| --- | --- | --- | --- | --- |"]
    for stage in floor:
        out.append(f"| {stage} | {run['ms_' + stage]:.4f} | {floor[stage]:.4f} | {run['ms_' + stage] / floor[stage]:.1f} | {what[stage]} |")
    return out + [f"| judge, refine | {run['ms_judge'] + run['ms_refine']:.4f} | | | |"]


TABLES = {"accuracy_attempts": accuracy_attempts, "accuracy_sweep": accuracy_sweep, "pipeline_steps": pipeline_steps, "agreement": agreement, "confidence": confidence, "pipeline_house": pipeline_house, "redkitchen": redkitchen, "redkitchen_seeds": redkitchen_seeds, "range_pairs": range_pairs, "other_pairs": other_pairs,
          "peers": peers, "peers_redkitchen": peers_redkitchen, "peers_house": peers_house,
          "peer_parameters": peer_parameters, "fgr": fgr, "redwood": redwood, "speed": speed, "pipeline": pipeline, "devices": devices, "scaling": scaling, "floors": floors}


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
