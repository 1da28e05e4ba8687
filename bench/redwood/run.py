#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The paper's table: time of a pair, recall and precision by Redwood's protocol, per scene and
mean, published rows beside measured ones.

SCENE: folders in Redwood's layout (the four scenes of scripts/fetch_redwood, 3DMatch's scenes,
those of `gpureg generate`), as paths or as names under --data. Without one, scenes are generated,
the same on every machine. Every preset runs with every seed through `gpureg batch` on every backend
that is there, `gpureg evaluate` evaluates; peers that are installed run once, through bench/peers
(--peers none: without). The record also holds recall/precision curves,
recall against overlap, where the misses are, rotation errors of the wrong poses, registration
recall by 3DMatch's rule where its logs are, and times with and without the preparation of clouds.
usage: run.py [SCENE ...] [--presets loopsmart default] [--seeds 1 2 3] [--peers all|none|NAME ...]
[--report out/redwood/report.html] [-o FILE]"""

import json
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path[1:1] = [str(HERE.parent / "accuracy"), str(HERE.parent / "report")]
import analysis
import published
import record
from scenes import Scene

GENERATED = [(12, 1), (12, 2)]  # fragments, seed of `gpureg generate`
COST_SAMPLE = 300  # pairs of a scene whose size and time the record keeps


def generated(arguments):
    scenes = []
    for fragments, seed in GENERATED:
        folder = record.ROOT / f"out/redwood/generated-{fragments}-{seed}"
        if not (folder / "gt_all.info").exists():
            print(f"generating {folder.relative_to(record.ROOT)}", flush=True)
            record.gpureg(
                arguments,
                "generate",
                folder,
                "--fragments",
                fragments,
                "--frames-per-fragment",
                50,
                "--seed",
                seed,
                "--quiet",
            )
        scenes.append(Scene(folder, f"generated-{seed}"))
    return scenes


def find(arguments, name):
    if pathlib.Path(name).is_dir():
        return Scene(name, pathlib.Path(name).resolve().name)
    return Scene(record.data_folder(arguments, name), name)


def backends(arguments):
    if arguments.backend != "auto":
        return [arguments.backend]
    cuda = any(
        line.startswith("cuda") and "device" in line
        for line in record.gpureg(arguments, "info").splitlines()
    )
    return ["cpu", "cuda"] if cuda else ["cpu"]


def times(batch, processor):
    """Milliseconds: of a pair whose clouds are prepared (in the batch, by the clock), of a
    fragment, and of a pair from raw points, with each preparation shared by all its pairs and with
    none shared. processor: seconds that the whole command took of all processors, which says more
    than the clock where other programs run beside."""
    pairs, fragments = len(batch["pairs"]), len(batch["fragments"])
    pair, prepare = (
        1e3 * batch["seconds"]["align"] / pairs,
        1e3 * batch["seconds"]["prepare"] / fragments,
    )
    return {
        "pair": pair,
        "fragment": prepare,
        "pair_amortised": pair + prepare * fragments / pairs,
        "pair_alone": pair + 2 * prepare,
        "processor": 1e3 * processor / pairs,
    }


def run_once(arguments, scene, preset, backend, seed, temporary, pictures):
    result, scores = temporary / "result.json", temporary / "scores.json"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    record.gpureg(
        arguments,
        "batch",
        scene.fragments,
        "--preset",
        preset,
        "--backend",
        backend,
        "--seed",
        seed,
        "-o",
        temporary / "result.log",
        "--json",
        result,
        "--quiet",
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    words = ["evaluate", result, "--ground-truth", scene.truth, "--json", scores]
    if scene.recall_logs:
        words += ["--registration-recall", *scene.recall_logs]
    record.gpureg(arguments, *words)
    batch, verdict = json.loads(result.read_text()), json.loads(scores.read_text())["scenes"][0]
    recalls = [
        {**entry, "log": pathlib.Path(entry["log"]).name}
        for entry in verdict.get("registration_recall", [])
    ]
    if pictures is not None:
        page = temporary / "page.html"
        record.gpureg(
            arguments,
            "report",
            result,
            "--ground-truth",
            scene.truth,
            "--clouds",
            scene.fragments,
            "-o",
            page,
        )
        pictures[scene.name, preset] = page.read_text()
    cost = [
        [
            pair["statistics"]["source_points"] + pair["statistics"]["target_points"],
            round(pair["ms"]["total"], 4),
        ]
        for pair in batch["pairs"]
    ]
    return {
        "seed": seed,
        "strict": analysis.rounded(verdict["strict"]),
        "geometric": analysis.rounded(verdict.get("geometric")),
        "registration_recall": recalls,
        "ms": times(batch, processor),
        "pairs": len(batch["pairs"]),
        "peak_memory_mib": round(batch["peak_memory_mib"]),
        "stages_ms": stages(batch),
        "points_and_ms": cost[:: max(1, len(cost) // COST_SAMPLE)],
        **analysis.all_of(verdict["pairs"], analysis.overlaps(scene.fragments)),
    }, batch


def stages(batch):
    return {
        stage: statistics.fmean(pair["ms"][stage] for pair in batch["pairs"])
        for stage in batch["pairs"][0]["ms"]
        if stage != "total"
    }


def spread(values):
    return {
        "mean": statistics.fmean(values),
        "stdev": statistics.stdev(values) if len(values) > 1 else 0.0,
    }


def over_seeds(runs):
    """Mean and standard deviation of the figures of a table."""

    def of(rule, *path):
        values = []
        for run in runs:
            value = run[rule]
            for key in path:
                value = value[key]
            values.append(value)
        return spread(values)

    rules = ["strict"] + (["geometric"] if runs[0]["geometric"] else [])
    table = {
        rule: {
            **{
                key: of(rule, key)
                for key in ("recall", "precision", "raw_recall", "average_precision")
            },
            **{
                f"recall_at_{p}": of(rule, "recall_at_precision", p)
                for p in ("50", "80", "95", "99")
            },
        }
        for rule in rules
    }
    return {
        **table,
        "ms": {key: spread([run["ms"][key] for run in runs]) for key in runs[0]["ms"]},
        "registration_recall": {
            entry["log"]: spread([run["registration_recall"][k]["recall"] for run in runs])
            for k, entry in enumerate(runs[0]["registration_recall"])
        },
    }


def peers_of(arguments, scene, temporary):
    """The methods of bench/peers on this scene: its record's entries, or none where that could not
    run.
    """
    output = temporary / "peers.json"
    command = [
        sys.executable,
        HERE.parent / "peers/run.py",
        "--scene",
        scene.fragments,
        "--gpureg",
        arguments.gpureg,
        "-o",
        output,
    ]
    if arguments.peers != ["all"]:
        command += ["--methods", *arguments.peers]
    else:
        command += [
            "--methods",
            "open3d_ransac",
            "open3d_fgr",
            "pcl_prerejective",
            "kiss_matcher_005",
            "kiss_matcher_010",
            "sc2_pcr",
            "teaser",
        ]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    for line in (done.stdout + done.stderr).splitlines():
        if line.startswith("skipped"):
            print(line)
    if done.returncode != 0:
        print(f"skipped: peers: {(done.stderr.strip().splitlines() or ['?'])[-1]}")
        return {}
    return json.loads(output.read_text())["methods"]


def percent(value):
    return f"{100 * value:.1f}"


def print_table(entry_rows, names):
    """entry_rows: label, ms text, [(recall, precision) per scene]."""
    width = max(len(row[0]) for row in entry_rows) + 2
    print(
        f"{'':{width}}{'ms/pair':>10}"
        + "".join(f"{name[-24:]:>26}" for name in names)
        + (f"{'mean':>16}" if len(names) > 1 else "")
    )
    for label, ms, cells in entry_rows:
        line = f"{label:{width}}{ms:>10}" + "".join(
            f"{percent(r) + ' / ' + percent(p):>26}" for r, p in cells
        )
        if len(cells) > 1:
            line += f"{percent(statistics.fmean(r for r, _ in cells)) + ' / ' + percent(statistics.fmean(p for _, p in cells)):>16}"
        print(line)


def print_all(document):
    names = [scene["name"] for scene in document["scenes"]]
    print(
        "\nRecall / precision in %, strict Redwood rule"
        + (f", mean of {len(document['seeds'])} seeds" if len(document["seeds"]) > 1 else "")
    )
    rows, wide, ranked = [], [], []
    for method in document["methods"]:
        scenes = [method["scenes"][name] for name in names if name in method["scenes"]]
        if len(scenes) < len(names):
            continue
        ms = statistics.fmean(scene["mean"]["ms"]["pair"]["mean"] for scene in scenes)
        rows.append(
            (
                method["label"],
                f"{ms:.1f}",
                [
                    (
                        s["mean"]["strict"]["recall"]["mean"],
                        s["mean"]["strict"]["precision"]["mean"],
                    )
                    for s in scenes
                ],
            )
        )
        if all("geometric" in s["mean"] for s in scenes):
            wide.append(
                (
                    method["label"],
                    "",
                    [
                        (
                            s["mean"]["geometric"]["recall"]["mean"],
                            s["mean"]["geometric"]["precision"]["mean"],
                        )
                        for s in scenes
                    ],
                )
            )
        for rule in ("strict", "geometric"):
            for name, s in zip(names, scenes):
                if rule in s["mean"]:
                    ranked.append((method["label"], name, rule, s["mean"][rule]))
    print_table(rows, names)
    print("  published, mean of Redwood's four scenes (not of those above):")
    for label, recall, precision, ms, _ in published.ROWS:
        print(f"  {label:34}{recall:5.1f} / {precision:4.1f}   {ms}")
    if wide:
        print("\nThe same by the geometric rule")
        print_table(wide, names)
    width = max(len(label) for label, *_ in ranked) + 2
    print(
        f"\n{'ranked by its confidence':{width}}{'scene':>26}{'rule':>11}{'raw':>14}{'R@P50':>8}{'R@P80':>8}{'R@P95':>14}{'R@P99':>8}{'AP':>8}"
    )
    for label, name, rule, m in ranked:

        def pm(key, m=m):
            return f"{percent(m[key]['mean'])} +- {100 * m[key]['stdev']:.1f}"

        print(
            f"{label:{width}}{name[-24:]:>26}{rule:>11}{pm('raw_recall'):>14}{percent(m['recall_at_50']['mean']):>8}{percent(m['recall_at_80']['mean']):>8}"
            f"{pm('recall_at_95'):>14}{percent(m['recall_at_99']['mean']):>8}{percent(m['average_precision']['mean']):>8}"
        )
    print(
        "\nmissed true pairs and false positives by kind (sums over seeds); registration recall (15 deg, 0.3 m)"
    )
    for method in document["methods"]:
        for name in names:
            runs = method["scenes"].get(name, {}).get("runs", [])
            if runs:
                missed = {key: sum(run["misses"][key] for run in runs) for key in runs[0]["misses"]}
                false = {
                    key: sum(run["wrong_reports"][key] for run in runs)
                    for key in runs[0]["wrong_reports"]
                }
                recalls = method["scenes"][name]["mean"].get("registration_recall", {})
                said = [
                    f"{value} {key.replace('_', ' ')}"
                    for key, value in {**missed, **false}.items()
                    if value
                ]
                said += [f"{percent(value['mean'])} % of {log}" for log, value in recalls.items()]
                print(f"  {method['label']}, {name}: {'; '.join(said) or 'nothing'}")
    print(
        f"\n{'ms':{width}}{'scene':>26}{'fragment':>11}{'prepared pair':>16}{'pair, amortised':>17}{'pair alone':>13}{'processor, a pair':>19}"
    )
    for method in document["methods"]:
        for name in names:
            if name in method["scenes"]:
                ms = method["scenes"][name]["mean"]["ms"]
                print(
                    f"{method['label']:{width}}{name[-24:]:>26}"
                    + "".join(
                        f"{ms[key]['mean']:{w}.1f}"
                        for key, w in (
                            ("fragment", 11),
                            ("pair", 16),
                            ("pair_amortised", 17),
                            ("pair_alone", 13),
                            ("processor", 19),
                        )
                    )
                )


def main():
    parser = record.parser(__doc__, "redwood.json")
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--presets", nargs="+", default=["loopsmart", "default"])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument(
        "--peers",
        nargs="+",
        default=["all"],
        help="all that are installed, none, or names of bench/peers",
    )
    parser.add_argument(
        "--report",
        type=pathlib.Path,
        default=record.ROOT / "out/redwood/report.html",
        help="the page (needs matplotlib)",
    )
    arguments = parser.parse_args()
    if not arguments.gpureg.exists():
        sys.exit(
            f"error: there is no command {arguments.gpureg}: build it (cmake --preset cpu && cmake --build --preset cpu --target gpureg_command), or name it with --gpureg"
        )
    scenes = [find(arguments, name) for name in arguments.scenes] or generated(arguments)
    used = backends(arguments)
    methods, pictures, environment = [], {}, {}
    with tempfile.TemporaryDirectory() as temporary:
        temporary = pathlib.Path(temporary)
        for preset in arguments.presets:
            for backend in used:
                method = {
                    "name": f"gpureg_{preset}_{backend}",
                    "label": f"gpureg {preset}, {backend.upper()}",
                    "preset": preset,
                    "backend": backend,
                    "scenes": {},
                }
                for scene in scenes:
                    runs = []
                    for seed in arguments.seeds:
                        wanted = (
                            pictures if seed == arguments.seeds[0] and backend == used[0] else None
                        )
                        run, batch = run_once(
                            arguments, scene, preset, backend, seed, temporary, wanted
                        )
                        if runs:  # of the first seed only
                            for detail in (run["strict"], run["geometric"] or {}):
                                detail.pop("curve", None)
                            del run["points_and_ms"]
                        runs.append(run)
                        environment[backend] = batch["environment"]
                        method["options"] = {
                            k: v for k, v in batch["options"].items() if k != "seed"
                        }
                        print(
                            f"{method['label']}, {scene.name}, seed {seed}: {percent(run['strict']['recall'])} / {percent(run['strict']['precision'])}",
                            flush=True,
                        )
                    method["scenes"][scene.name] = {"mean": over_seeds(runs), "runs": runs}
                methods.append(method)
        if arguments.peers != ["none"]:
            add_peers(arguments, scenes, temporary, methods)
    sources = arguments.scenes or [scene.name for scene in scenes]
    words = [
        "bench/redwood/run.py",
        *([pathlib.Path(s).name if pathlib.Path(s).is_absolute() else s for s in arguments.scenes]),
        "--presets",
        *arguments.presets,
        "--seeds",
        *arguments.seeds,
        "--backend",
        arguments.backend,
        "--peers",
        *arguments.peers,
    ]
    document = {
        "kind": "redwood",
        "environment": environment,
        "seeds": arguments.seeds,
        "scenes": [
            {"name": scene.name, "source": source} for scene, source in zip(scenes, sources)
        ],
        "methods": methods,
    }
    print_all(document)
    record.write(arguments, " ".join(map(str, words)), document)
    try:
        import page
    except ImportError as error:
        print(f"skipped: the report: {error} (bench/report needs matplotlib)")
        return
    page.write(arguments.report, [arguments.output], pictures)


def add_peers(arguments, scenes, temporary, methods):
    found = {}
    for scene in scenes:
        for name, entry in peers_of(arguments, scene, temporary).items():
            run = {
                **entry,
                "seed": 1,
                "registration_recall": [],
                "ms": {
                    "pair": entry["ms_per_pair"],
                    "fragment": entry["ms_per_fragment"],
                    "pair_alone": entry["ms_per_pair"] + 2 * entry["ms_per_fragment"],
                    "pair_amortised": entry["ms_per_pair"]
                    + entry["ms_per_fragment"] * entry["fragments"] / max(1, entry["tried"]),
                    "processor": entry["processor_ms_per_pair"],
                },
            }
            method = found.setdefault(
                name,
                {
                    "name": name,
                    "label": f"{entry['label'].replace('`', '')} {entry['version']}",
                    "peer": True,
                    "scenes": {},
                },
            )
            method["scenes"][scene.name] = {"mean": over_seeds([run]), "runs": [run]}
    methods += found.values()


if __name__ == "__main__":
    main()
