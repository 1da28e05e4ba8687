#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The paper's table: time of a pair, recall and precision by Redwood's protocol, per scene and
mean, published rows beside measured ones.

SCENE: folders in Redwood's layout (the four scenes of bench/redwood/fetch, 3DMatch's scenes,
those of `gpureg generate`), as paths or as names under --data. Without one, scenes are generated,
the same on every machine. Every preset runs with every seed through `gpureg batch` on every backend
that is there, `gpureg evaluate` scores them; peers that are installed run once, through bench/peers
(--peers none: without). The record, and the same as Markdown tables, also hold recall by overlap,
the kinds of missed pairs and false positives, rotation errors of false poses, registration recall
by 3DMatch's rule where its logs are, and times with and without the preparation of clouds. The page
is that of `gpureg report` for the first seed: curves, pictures, every pair.
usage: run.py [SCENE ...] [--presets loopsmart default] [--seeds 1 2 3] [--peers all|none|NAME ...]
[--report out/redwood/report.html] [--tables out/redwood/tables.md] [-o FILE]"""

import json
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path[1:1] = [str(HERE.parent / "accuracy")]
import analysis
import markdown_tables
import record
from markdown_tables import percent
from scenes import Scene

GENERATED = [(12, 1), (12, 2)]  # fragments, seed of `gpureg generate`


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


def file_name(scene):
    return scene.name.replace("/", "_")


def run_once(arguments, scene, preset, backend, seed, temporary):
    result = temporary / f"{file_name(scene)}-{preset}-{backend}-{seed}.json"
    scores = temporary / "scores.json"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    record.gpureg(
        arguments,
        "batch",
        scene.fragments,
        "--voxel-size",
        0.05,
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
    return (
        {
            "seed": seed,
            "strict": analysis.rounded(verdict["strict"]),
            "geometric": analysis.rounded(verdict.get("geometric")),
            "registration_recall": recalls,
            "ms": times(batch, processor),
            "pairs": len(batch["pairs"]),
            "peak_memory_mib": round(batch["peak_memory_mib"]),
            "stages_ms": stages(batch),
            **analysis.all_of(verdict["pairs"], analysis.overlaps(scene.fragments)),
        },
        batch,
        result,
    )


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


def peers_of(arguments, scene, temporary, kept):
    """Runs the methods of bench/peers on this scene. Their entries of its record; none where it could
    not run. kept: folder for their RESULT.json.
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
        "--results",
        kept,
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


def write_page(arguments, results):
    """results: (name, RESULT.json, scene, whether to draw pairs). One page, by `gpureg report`."""
    arguments.report.parent.mkdir(parents=True, exist_ok=True)
    words = ["report", *[path for _, path, _, _ in results], "-o", arguments.report]
    for name, _, scene, pictures in results:
        words += ["--name", name, "--ground-truth", scene.truth]
        words += ["--clouds", scene.fragments if pictures else "-"]
    record.gpureg(arguments, *words)
    print(f"written: {arguments.report}")


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
        help="the page of `gpureg report`",
    )
    parser.add_argument(
        "--tables",
        type=pathlib.Path,
        default=record.ROOT / "out/redwood/tables.md",
        help="the tables, as Markdown",
    )
    arguments = parser.parse_args()
    if not arguments.gpureg.exists():
        sys.exit(
            f"error: there is no command {arguments.gpureg}: build it (cmake --preset cpu && cmake --build --preset cpu --target gpureg_command), or name it with --gpureg"
        )
    scenes = [find(arguments, name) for name in arguments.scenes] or generated(arguments)
    used = backends(arguments)
    methods, results, environment = [], [], {}
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
                        run, batch, path = run_once(
                            arguments, scene, preset, backend, seed, temporary
                        )
                        if not runs:  # the page shows the first seed
                            name = f"{method['label']}, {scene.name}"
                            results.append((name, path, scene, backend == used[0]))
                        else:  # the record keeps details of the first seed only
                            for detail in (run["strict"], run["geometric"] or {}):
                                detail.pop("curve", None)
                        runs.append(run)
                        environment[backend] = batch["environment"]
                        method["options"] = {
                            name: value
                            for name, value in batch["options"].items()
                            if name != "seed"
                        }
                        print(
                            f"{method['label']}, {scene.name}, seed {seed}: {percent(run['strict']['recall'])} / {percent(run['strict']['precision'])}",
                            flush=True,
                        )
                    method["scenes"][scene.name] = {"mean": over_seeds(runs), "runs": runs}
                methods.append(method)
        if arguments.peers != ["none"]:
            add_peers(arguments, scenes, temporary, methods, results)
        write_page(arguments, results)
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
    command = " ".join(map(str, words))
    tables = markdown_tables.text(document, command)
    print("\n" + tables)
    arguments.tables.parent.mkdir(parents=True, exist_ok=True)
    arguments.tables.write_text(tables)
    print(f"written: {arguments.tables}")
    record.write(arguments, command, document)


def add_peers(arguments, scenes, temporary, methods, results):
    found = {}
    for scene in scenes:
        kept = temporary / f"peers-{file_name(scene)}"
        for name, entry in peers_of(arguments, scene, temporary, kept).items():
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
            results.append(
                (f"{method['label']}, {scene.name}", kept / f"{name}.json", scene, False)
            )
    methods += found.values()


if __name__ == "__main__":
    main()
