# SPDX-License-Identifier: BSD-3-Clause
"""The record of bench/redwood/run.py as Markdown, for the terminal and for a file."""

import itertools
import statistics

import published

RULES = ("strict", "geometric")
RANKED = ("raw_recall", "recall_at_50", "recall_at_80", "recall_at_95", "recall_at_99")
TIMES = ("fragment", "pair", "pair_amortised", "pair_alone", "processor")
MISSES = {
    "not_tried": "not tried",
    "no_candidate": "no pose",
    "right_but_not_reported": "correct, not reported",
    "wrong_and_not_reported": "false, not reported",
    "reported_off_by_little": "reported, off by 0.2 to 0.5 m",
    "reported_wrong": "reported, off by more",
}
FALSE_REPORTS = {
    "right_but_little_overlap": "correct pose, overlap below 30 %",
    "wrong_pose": "false pose",
    "no_overlap": "no overlap",
}


def percent(value):
    return f"{100 * value:.1f}"


def recall_precision(scores):
    return f"{percent(scores['recall']['mean'])} / {percent(scores['precision']['mean'])}"


def with_spread(entry):
    return percent(entry["mean"]) + (f" ± {100 * entry['stdev']:.1f}" if entry["stdev"] else "")


def table(head, rows):
    """Columns have one width, so that the text is a table on a terminal too."""
    rows = [[str(cell) for cell in row] for row in [head, *rows]]
    widths = [max(3, *(len(row[k]) for row in rows)) for k in range(len(head))]
    lines = ["| " + " | ".join(map(str.ljust, row, widths)) + " |" for row in rows]
    lines.insert(1, "| " + " | ".join("-" * width for width in widths) + " |")
    return "\n".join(lines) + "\n"


def paper_table(methods, names, rule):
    rows = []
    for method in methods:
        means = [method["scenes"][name]["mean"] for name in names]
        if not all(rule in mean for mean in means):
            continue
        overall = {
            key: {"mean": statistics.fmean(mean[rule][key]["mean"] for mean in means)}
            for key in ("recall", "precision")
        }
        ms = statistics.fmean(mean["ms"]["pair"]["mean"] for mean in means)
        cells = [recall_precision(mean[rule]) for mean in means]
        rows.append([method["label"], f"{ms:.1f} ms", *cells, recall_precision(overall)])
    if rows and rule == "strict":
        blank = [""] * len(names)
        for label, recall, precision, time, _ in published.ROWS:
            rows.append([f"*{label}*", time, *blank, f"{recall:.1f} / {precision:.1f}"])
    return rows and table(["method", "time per pair", *names, "mean"], rows)


def per_scene(methods, names):
    """(method, scene name, its mean, its runs) of every scene of every method."""
    for method in methods:
        for name in names:
            scene = method["scenes"].get(name)
            if scene:
                yield method, name, scene["mean"], scene["runs"]


def ranked_table(methods, names):
    rows = [
        [method["label"], name, rule]
        + [with_spread(mean[rule][key]) for key in (*RANKED, "average_precision")]
        for method, name, mean, _ in per_scene(methods, names)
        for rule in RULES
        if rule in mean
    ]
    head = ["method", "scene", "rule", "raw recall", "R@P50", "R@P80", "R@P95", "R@P99", "AP"]
    return table(head, rows)


def overlap_table(methods, names):
    rows, head = [], None
    for method, name, _, runs in per_scene(methods, names):
        found = runs[0].get("recall_by_overlap")
        if not found:
            continue
        edges = found["edges"]
        head = [f"{100 * a:.0f} to {100 * b:.0f} %" for a, b in itertools.pairwise(edges)]
        cells = [
            f"{correct} of {pairs}" if pairs else ""
            for correct, pairs in zip(found["reported_right"], found["pairs"])
        ]
        rows.append([method["label"], name, *cells])
    return rows and table(["method", "scene", *head], rows)


def count_table(methods, names, part, titles):
    """Pairs per run by kind; titles: of the kinds."""
    rows = [
        [method["label"], name]
        + [f"{statistics.fmean(run[part][kind] for run in runs):.3g}" for kind in titles]
        for method, name, _, runs in per_scene(methods, names)
    ]
    return table(["method", "scene", *titles.values()], rows)


def rotation_table(methods, names):
    rows, head = [], None
    for method, name, _, runs in per_scene(methods, names):
        found = runs[0]["rotation_errors_of_wrong_candidates"]
        if sum(found["counts"]):
            head = [f"{a} to {b}" for a, b in itertools.pairwise(found["edges"])]
            rows.append([method["label"], name, *found["counts"]])
    return rows and table(["method", "scene", *head], rows)


def recall_table(methods, names):
    rows = [
        [method["label"], name, log, with_spread(value)]
        for method, name, mean, _ in per_scene(methods, names)
        for log, value in mean.get("registration_recall", {}).items()
    ]
    return rows and table(["method", "scene", "log", "registration recall, %"], rows)


def time_table(methods, names):
    rows = [
        [method["label"], name] + [f"{mean['ms'][key]['mean']:.1f}" for key in TIMES]
        for method, name, mean, _ in per_scene(methods, names)
    ]
    head = ["prepared fragment", "prepared pair", "pair, preparation shared"]
    head += ["pair from raw points", "processor time, pair"]
    return table(["method", "scene", *head], rows)


def text(document, command=""):
    names = [scene["name"] for scene in document["scenes"]]
    methods = document["methods"]
    whole = [m for m in methods if all(name in m["scenes"] for name in names)]
    seeds = ", ".join(map(str, document["seeds"]))
    parts = [
        (
            "Recall / precision in %, strict rule",
            f"Redwood's protocol; gpureg: mean of the seeds {seeds}. In italics: published means "
            "of Redwood's four scenes.",
            paper_table(whole, names, "strict"),
        ),
        (
            "Recall / precision in %, geometric rule",
            "A pair counts by its pose, also where it overlaps by less than 30 %.",
            paper_table(whole, names, "geometric"),
        ),
        (
            "Ranked by score, in %",
            "Raw recall: every best candidate reported. R@P80: recall at 80 % precision. "
            "AP: average precision.",
            ranked_table(methods, names),
        ),
        (
            "Recall by overlap",
            "Correct reports of the true pairs whose overlap is in the range, first seed.",
            overlap_table(methods, names),
        ),
        (
            "Missed pairs",
            "True pairs per run without a correct report, mean of the seeds.",
            count_table(methods, names, "misses", MISSES),
        ),
        (
            "False positives",
            "Pairs per run, strict rule, mean of the seeds.",
            count_table(methods, names, "wrong_reports", FALSE_REPORTS),
        ),
        (
            "Rotation errors in degrees",
            "Number of false best candidates of true pairs, first seed. Perceptual aliases of "
            "rooms are near 90 and 180 degrees.",
            rotation_table(methods, names),
        ),
        (
            "Registration recall",
            "3DMatch's rule: best candidate within 15 degrees and 0.30 m.",
            recall_table(methods, names),
        ),
        (
            "Time in milliseconds",
            "Wall clock, which other programs on the machine make longer; processor time includes "
            "the pair's share of the preparation.",
            time_table(methods, names),
        ),
    ]
    out = "# gpureg: benchmark on " + ", ".join(names) + "\n"
    out += "".join(f"\n## {title}\n{note}\n\n{body}" for title, note, body in parts if body)
    return out + (f"\nMade by `{command}`.\n" if command else "")
