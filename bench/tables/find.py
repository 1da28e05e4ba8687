# SPDX-License-Identifier: BSD-3-Clause
"""The table of parts found in bins."""

from tables.records import load

SETS = {
    "generated": "generated parts",
    "cad": "CAD parts",
    "model of few points": "parts of few points, with normals",
    "scan of few points": "parts of few points, without normals",
    "beside opencv": "seed 1, five of them",
    "opencv": "the same, point pair features of OpenCV",
    "beside pcl": "seed 1, one, five and twenty of them",
    "pcl": "the same, template alignment of PCL",
}
SHOWN = {
    "count": "{} of them in the bin",
    "part_points": "{} points",
    "kind": "{}",
}


def percent(value):
    return "-" if value is None else f"{100 * value:.1f}"


def row(name, f):
    # Their scores are no probabilities.
    peer = "the same" in name
    reported = "-" if peer else f"{percent(f['recall'])} / {percent(f['precision'])}"
    none = f"{f['without']} of {f['scenes_without']}" if f["scenes_without"] and not peer else "-"
    return (
        f"| {name} | {f['scenes']} | {f['visible']} | {percent(f['recall_at_p95'])} | {reported} "
        f"| {f['first']} of {f['scenes_with']} | {percent(f['candidates'])} | {none} | {f['seconds']:.0f} |"
    )


def find():
    record = load("find.json")
    out = [
        "| parts | scenes | visible instances | recall at precision >= 95 %, % | reported: recall / precision, % | best pose correct, scenes | among the poses, % | scenes without the part with a report | s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for key, text in SETS.items():
        entry = record["sets"].get(key)
        if not entry:
            continue
        out.append(row(text, entry["all"][0]))
        for group, shown in SHOWN.items():
            if group != "part_points" and (
                key not in ("generated", "cad") or (group == "kind" and key != "cad")
            ):
                continue
            for f in entry.get(group, ()):
                name = f["name"].removeprefix(f"{group} ")
                out.append(row(f"{text}: {shown.format(name)}", f))
    return [
        *out,
        "",
        f"Made by `{record['command']}` at commit {record['commit'].replace('+', '')} on {', '.join(record['devices'])}.",
    ]


TABLES = {"find": find}
