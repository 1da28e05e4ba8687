# SPDX-License-Identifier: BSD-3-Clause
"""One self-contained HTML page from records of the benchmarks: redwood, peers, fgr, and the GPU's
pipeline record.
"""

import html
import json
import pathlib
import re
import statistics
import sys

import plots

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(1, str(ROOT / "bench/redwood"))
import published

STYLE = """<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>gpureg benchmarks</title><style>
body { font: 15px/1.5 "DejaVu Sans", system-ui, sans-serif; color: #2b2b2b; background: #fafaf8; max-width: 1240px; margin: 1.5em auto; padding: 0 1em; }
h1 { font-size: 1.6em; margin: 0; } h2 { font-size: 1.25em; margin: 2em 0 .4em; border-top: 2px solid #ddd; padding-top: .7em; } h3 { font-size: 1.05em; margin: 1.2em 0 .3em; }
p.sub, figcaption { color: #666; margin-top: .2em; font-size: 13.5px; } table { border-collapse: collapse; margin: .5em 0; font-size: 13px; }
th, td { padding: .25em .5em; text-align: right; border-bottom: 1px solid #e4e4de; } th { color: #555; vertical-align: bottom; } th:first-child, td:first-child { text-align: left; white-space: nowrap; }
tr.own td { background: #e9f1fb; font-weight: 600; } tr.published td { color: #777; } .best { color: #1464c0; font-weight: 700; }
.cards { display: flex; flex-wrap: wrap; gap: 14px; margin: 1em 0; } .card { background: #fff; border: 1px solid #e0e0da; border-radius: 6px; padding: .7em 1em; flex: 1 1 240px; }
.card b { display: block; font-size: 1.7em; color: #1464c0; line-height: 1.2; } .row { display: flex; flex-wrap: wrap; gap: 18px; } .row > * { flex: 1 1 480px; max-width: 570px; }
img { max-width: 100%; } figure { margin: 0 0 1em; } .right { color: #2f9e5b; } .wrong { color: #d6453d; } .missed { color: #b97a00; } code { font-size: 12.5px; overflow-wrap: anywhere; }
</style></head><body>
"""


def text(value):
    return html.escape(str(value))


def plain(label):
    return text(label.replace("`", ""))


def percent(value, digits=1):
    return f"{100 * value:.{digits}f}"


def table(head, body):
    """body: (class, cells)."""
    rows = "".join(
        f'<tr class="{kind}">' + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>\n"
        for kind, cells in body
    )
    return "<table><tr>" + "".join(f"<th>{cell}</th>" for cell in head) + f"</tr>\n{rows}</table>\n"


def kind_of(name):
    return "own" if name.startswith("gpureg_default") else ""


def peers_section(record):
    entries = record["methods"]
    base = entries.get("gpureg_default")
    best = {key: max(value(e) for e in entries.values()) for key, value in RANKED.items()}
    body = []
    for name, e in entries.items():
        cells = [f"{plain(e['label'])} {text(e['version'])}"]
        for key, value in RANKED.items():
            cells.append(
                f'<span class="best">{percent(value(e))}</span>'
                if value(e) == best[key]
                else percent(value(e))
            )
        ratio = f"{e['processor_ms_per_pair'] / base['processor_ms_per_pair']:.2f}" if base else ""
        cells += [
            f"{e['ms_per_fragment']:.0f}" if e["ms_per_fragment"] >= 0.5 else "-",
            f"{e['ms_per_pair']:.0f}",
            f"{e['processor_ms_per_pair']:.0f}",
            ratio,
            e["peak_memory_mib"] or "",
        ]
        body.append((kind_of(name), cells))
    out = f"<h2>Beside its peers: {text(record['scene'])}</h2>\n<p class=\"sub\">{text(record['chosen'])}; the same downsampled clouds (5 cm), {record['threads']} threads, "
    out += f"{text(record['processor'])}. Strict Redwood rule; geometric: right poses of pairs with little overlap are right. Best of a column in blue.</p>\n"
    out += table(
        [
            "method",
            "right, best candidates, %",
            "recall, %",
            "precision, %",
            "R@P95, %",
            "AP, %",
            "geometric R@P95, %",
            "ms a fragment",
            "ms a pair",
            "processor ms a pair",
            "of gpureg's",
            "peak MiB",
        ],
        body,
    )
    out += (
        '<p class="sub">KISS-Matcher makes its features anew for each pair. Rows with + show the refinement\'s time alone. '
        "R@P95: recall at precision 95 %; AP: average precision. ms: by the clock, longer where the machine was busy. The confidence of gpureg was fitted on "
        "a set of buildings that red kitchen and house are part of; bench/results/confidence.json has fits that left each out.</p>\n"
    )
    shown = [
        (name, e["label"].replace("`", ""), e) for name, e in entries.items() if not e["refines"]
    ]
    overlap = [(name, label, e["recall_by_overlap"]) for name, label, e in shown]
    out += '<div class="row">' + plots.curves(
        shown, "strict", "Recall and precision, strict rule (dots: as reported)"
    )
    out += plots.curves(shown, "geometric", "Recall and precision, geometric rule")
    out += plots.recall_by_overlap(overlap, "Recall against overlap, as reported")
    out += (
        plots.time_bars(
            [(name, label, e["processor_ms_per_pair"]) for name, label, e in shown],
            "Processor time of a prepared pair",
        )
        + "</div>\n"
    )
    misses = [
        {"name": name, "label": label, "scenes": {record["scene"]: {"runs": [e]}}}
        for name, label, e in shown
        if "misses" in e
    ]
    return out + failures(misses, [record["scene"]])


RANKED = {
    "raw": lambda e: e["strict"]["raw_recall"],
    "recall": lambda e: e["strict"]["recall"],
    "precision": lambda e: e["strict"]["precision"],
    "95": lambda e: e["strict"]["recall_at_precision"]["95"],
    "ap": lambda e: e["strict"]["average_precision"],
    "wide": lambda e: (e["geometric"] or e["strict"])["recall_at_precision"]["95"],
}


def spread(entry):
    return percent(entry["mean"]) + (
        f" &plusmn; {100 * entry['stdev']:.1f}" if entry["stdev"] else ""
    )


def redwood_section(record, gpu):
    names = [scene["name"] for scene in record["scenes"]]
    methods = [m for m in record["methods"] if all(name in m["scenes"] for name in names)]
    body = []
    for m in methods:
        scenes = [m["scenes"][name]["mean"] for name in names]
        cells = [
            plain(m["label"]),
            f"{statistics.fmean(s['ms']['pair']['mean'] for s in scenes):.1f}",
        ]
        cells += [
            f"{percent(s['strict']['recall']['mean'])} / {percent(s['strict']['precision']['mean'])}"
            for s in scenes
        ]
        cells.append(
            f"{percent(statistics.fmean(s['strict']['recall']['mean'] for s in scenes))} / "
            f"{percent(statistics.fmean(s['strict']['precision']['mean'] for s in scenes))}"
        )
        body.append((kind_of(m["name"]), cells))
    if gpu:
        body.append(
            (
                "published",
                [
                    f"gpureg loopsmart, {text(gpu['gpu'])}: same poses as on the CPU",
                    f"{gpu['pair']:.2f}",
                ]
                + [""] * (len(names) + 1),
            )
        )
    for label, recall, precision, ms, _ in published.ROWS:
        body.append(
            (
                "published",
                [f"{text(label)} (published)", text(ms)]
                + [""] * len(names)
                + [f"{recall:.1f} / {precision:.1f}"],
            )
        )
    out = (
        "<h2>The paper's table</h2>\n<p class=\"sub\">Recall / precision in % by Redwood's strict rule, "
        + ("seed " if len(record["seeds"]) == 1 else "means of the seeds ")
        + ", ".join(map(str, record["seeds"]))
    )
    out += ". Published rows: mean of Redwood's four scenes, which are other scenes than those measured here unless named so.</p>\n"
    out += table(["method", "ms a pair", *[text(name) for name in names], "mean"], body)
    ranked = []
    for m in methods:
        for name in names:
            for rule in ("strict", "geometric"):
                s = m["scenes"][name]["mean"].get(rule)
                if s:
                    ranked.append(
                        (
                            kind_of(m["name"]),
                            [plain(m["label"]), text(name), rule]
                            + [
                                spread(s[key])
                                for key in (
                                    "raw_recall",
                                    "recall_at_50",
                                    "recall_at_80",
                                    "recall_at_95",
                                    "recall_at_99",
                                    "average_precision",
                                )
                            ],
                        )
                    )
    out += "<h3>Ranked by the methods' own confidence</h3>\n" + table(
        [
            "method",
            "scene",
            "rule",
            "right, best candidates",
            "R@P50",
            "R@P80",
            "R@P95",
            "R@P99",
            "AP",
        ],
        ranked,
    )
    out += failures(methods, names)
    for name in names:
        shown = [(m["name"], m["label"], m["scenes"][name]["runs"][0]) for m in methods]
        overlap = [(n, label, run.get("recall_by_overlap")) for n, label, run in shown]
        cost = [
            (n, label, run["points_and_ms"]) for n, label, run in shown if run.get("points_and_ms")
        ]
        turned = [
            (n, label, run["rotation_errors_of_wrong_candidates"])
            for n, label, run in shown
            if n.startswith("gpureg")
        ]
        out += (
            f"<h3>{text(name)}</h3>\n"
            + '<div class="row">'
            + plots.curves(shown, "strict", f"{name}: strict rule, first seed")
        )
        out += plots.curves(
            shown, "geometric", f"{name}: geometric rule, first seed"
        ) + plots.recall_by_overlap(overlap, f"{name}: recall against overlap")
        out += plots.rotation_histogram(turned, f"{name}: how wrong poses are turned")
        out += (plots.cost(cost, f"{name}: cost against size, CPU") if cost else "") + "</div>\n"
    return out + times(methods, names)


def failures(methods, names):
    body = []
    for m in methods:
        for name in names:
            runs = m["scenes"][name]["runs"]
            mean = {
                key: statistics.fmean(run["misses"][key] for run in runs)
                for key in runs[0]["misses"]
            }
            false = {
                key: statistics.fmean(run["wrong_reports"][key] for run in runs)
                for key in runs[0]["wrong_reports"]
            }
            body.append(
                (
                    kind_of(m["name"]),
                    [
                        plain(m["label"]),
                        text(name),
                        *[f"{v:.3g}" for v in (*mean.values(), *false.values())],
                    ],
                )
            )
    return (
        '<h3>Where it fails</h3>\n<p class="sub">Pairs a run, mean of the seeds. Off by little: 0.2 to 0.5 m.</p>\n'
        + table(
            [
                "method",
                "scene",
                "missed: not tried",
                "no pose",
                "right, not reported",
                "wrong, not reported",
                "reported, off by little",
                "reported, wrong",
                "false: right pose, little overlap",
                "wrong pose",
                "no overlap at all",
            ],
            body,
        )
    )


def times(methods, names):
    body = []
    for m in methods:
        for name in names:
            ms = m["scenes"][name]["mean"]["ms"]
            body.append(
                (
                    kind_of(m["name"]),
                    [plain(m["label"]), text(name)]
                    + [
                        f"{ms[key]['mean']:.1f}" if key in ms else ""
                        for key in ("fragment", "pair", "pair_amortised", "pair_alone", "processor")
                    ],
                )
            )
    return (
        "<h3>Time, in milliseconds</h3>\n"
        + table(
            [
                "method",
                "scene",
                "a fragment prepared",
                "a prepared pair",
                "a pair, preparation shared",
                "a pair alone, from raw points",
                "processor time, a pair with its share of preparation",
            ],
            body,
        )
        + (
            '<p class="sub">By the clock; other programs on the machine make it longer, processor time less so.</p>\n'
        )
    )


def fgr_section(record):
    body = []
    for name, e in record["methods"].items():
        shares = [f"{e[f'below_{bound}']:.2f}" for bound in ("0.01", "0.02", "0.05")]
        body.append(
            (
                kind_of(name),
                [
                    f"{plain(e['label'])} {text(e['version'])}",
                    f"{e['rmse_mean']:.4f}",
                    f"{e['rmse_max']:.4f}",
                    *shares,
                    f"{e['ms_per_pair']:.0f}",
                    e["without_pose"] or "",
                ],
            )
        )
    for row in record["published"]:
        body.append(
            (
                "published",
                [
                    text(row["label"]),
                    f"{row['rmse_mean']:.4f}",
                    f"{row['rmse_max']:.4f}",
                    *["" if s is None else f"{s:.2f}" for s in row["below"]],
                    "",
                    "",
                ],
            )
        )
    body.append(
        (
            "published",
            ["(the ground truth itself)", f"{record['rmse_of_truth']:.4f}", "", "", "", "", "", ""],
        )
    )
    return (
        f"<h2>Synthetic range pairs</h2>\n<p class=\"sub\">The {record['pairs']} pairs of the Fast Global Registration paper, noise 0.0025 of the diameter, random poses, voxel size "
        f"{record['voxel_size']:g}; RMSE in units of which the diameter is 2. Grey: published.</p>\n"
        + table(
            [
                "method",
                "RMSE, mean",
                "max",
                "below .01",
                "below .02",
                "below .05",
                "ms a pair",
                "without a pose",
            ],
            body,
        )
    )


def gpu_of(record):
    """Of the pipeline record of a GPU machine: its name, and milliseconds."""
    runs = {run["name"].split("/real_time")[0]: run for run in record["benchmarks"]}
    return {
        "gpu": record["context"]["gpu"],
        "commit": record["context"]["commit"],
        "pair": runs["align_many/cuda_loopsmart/11"]["ms_per_pair"],
        "fragment": runs["prepare_batch_of_fragments/cuda"]["ms_per_fragment"],
        "sizes": [
            (runs[f"points_per_cloud/{n}"]["points"], runs[f"points_per_cloud/{n}"]["ms_per_pair"])
            for n in (1000, 5000, 20000, 100000)
        ],
    }


def gpu_section(gpu):
    return (
        f"<h2>On a GPU</h2>\n<p>{text(gpu['gpu'])}, paper's preset: a prepared pair of the red kitchen in a batch <b>{gpu['pair']:.2f} ms</b>, a fragment prepared "
        f"<b>{gpu['fragment']:.2f} ms</b>. The poses are those of the CPU, bit for bit. Absolute device times, measured on another machine than the peers' "
        f"(bench/results/pipeline_h200.json, commit {text(gpu['commit'])}): no ratio to the CPU rows above is meant.</p>\n<div class=\"row\">"
        + plots.gpu_cost(gpu["sizes"], "Cost against size, GPU, all pairs of 8 clouds")
        + "</div>\n"
    )


def cards(records, gpu):
    """What one should know first."""
    said = []
    for record in records:
        if record.get("kind") == "peers" and "gpureg_default" in record["methods"]:
            own = record["methods"]["gpureg_default"]
            others = {
                n: e
                for n, e in record["methods"].items()
                if not n.startswith("gpureg") and not e["refines"]
            }
            name = max(others, key=lambda n: RANKED["wide"](others[n]), default=None)
            line = f"{text(record['scene'])}: of the true pairs found at 95 % precision (geometric rule)"
            if name:
                line += f"; best peer: {plain(others[name]['label'])}, {percent(RANKED['wide'](others[name]))} %"
            said.append((f"{percent(RANKED['wide'](own))} %", line))
            if name:
                ratio = others[name]["processor_ms_per_pair"] / own["processor_ms_per_pair"]
                said.append(
                    (
                        f"{own['processor_ms_per_pair']:.0f} ms",
                        f"{text(record['scene'])}: processor time a pair; that best peer: {others[name]['processor_ms_per_pair']:.0f} ms "
                        f"({ratio:.1f} x)",
                    )
                )
        if record.get("kind") == "redwood":
            for m in record["methods"]:
                if m["name"].startswith("gpureg_default"):
                    scenes = [s["mean"] for s in m["scenes"].values()]
                    said.append(
                        (
                            f"{percent(statistics.fmean(s['strict']['recall']['mean'] for s in scenes))} / "
                            f"{percent(statistics.fmean(s['strict']['precision']['mean'] for s in scenes))} %",
                            f"recall / precision, strict rule, mean of {', '.join(map(text, m['scenes']))}",
                        )
                    )
                    break
        if record.get("kind") == "fgr" and "gpureg_default" in record["methods"]:
            said.append(
                (
                    f"{record['methods']['gpureg_default']['rmse_mean']:.4f}",
                    "mean RMSE on the synthetic range pairs; best published (FGR): 0.0104",
                )
            )
    if gpu:
        said.append(
            (
                f"{gpu['pair']:.2f} ms",
                f"a prepared pair on an {text(gpu['gpu'].split(' ')[1])}, paper's preset",
            )
        )
    return (
        '<div class="cards">'
        + "".join(f'<div class="card"><b>{number}</b>{what}</div>' for number, what in said)
        + "</div>\n"
    )


def picture_section(pictures):
    """Pictures of the pages that `gpureg report` wrote: of each kind one or two a scene and preset."""
    out = ""
    for (scene, preset), page in pictures.items():
        found = re.findall(r"<figure><figcaption><b class=.*?</figure>", page, re.DOTALL)
        if found:
            out += f"<h3>{text(scene)}, {text(preset)}</h3>\n" + "\n".join(found)
    return (
        '<h2>Pairs to look at</h2>\n<p class="sub">Left before, right after; yellow: source, blue: target. Right, wrong and missed ones, first seed.</p>\n'
        + out
        if out
        else ""
    )


def sources(records):
    return "<h2>How it was made</h2>\n" + "".join(
        f"<p><code>{text(r['command'])}</code><br><span class=\"sub\">commit {text(r['commit'])}, {text(r['processor'])}</span></p>\n"
        for r in records
    )


def write(output, paths, pictures=None):
    """paths: JSON records; pictures: {(scene, preset): page of `gpureg report`}."""
    records = [json.loads(pathlib.Path(path).read_text()) for path in paths]
    known = [r for r in records if r.get("kind") in ("redwood", "peers", "fgr")]
    pipeline = next((r for r in records if "benchmarks" in r), None)
    if unknown := [
        str(path) for path, r in zip(paths, records) if r not in known and "benchmarks" not in r
    ]:
        sys.exit(
            f"error: {unknown[0]}: no record of bench/redwood, bench/peers, bench/fgr or bench/pipeline"
        )
    gpu = gpu_of(pipeline) if pipeline else None
    body = (
        '<h1>gpureg, benchmarks</h1>\n<p class="sub">Global registration of point clouds. Every number comes from the records named at the end.</p>\n'
        + cards(known, gpu)
    )
    sections = {
        "redwood": lambda r: redwood_section(r, gpu),
        "peers": peers_section,
        "fgr": fgr_section,
    }
    for kind in ("peers", "redwood", "fgr"):
        body += "".join(sections[kind](r) for r in known if r["kind"] == kind)
    if gpu:
        body += gpu_section(gpu)
    body += picture_section(pictures or {}) + sources(known)
    output = pathlib.Path(output)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(STYLE + body + "</body></html>\n")
    print(f"written: {output}")
