# SPDX-License-Identifier: BSD-3-Clause
"""Tables of recall, precision and confidence."""

import json
import statistics

from tables.records import RESULTS, load, mean, percent, source


def redkitchen():
    rows = [
        "| preset | correct best candidates | recall / precision of the reports | recall at precision >= 95 % | average precision |",
        "| --- | --- | --- | --- | --- |",
    ]
    sources = []
    for file in sorted(RESULTS.glob("redkitchen_*.json"), reverse=True):
        record = json.loads(file.read_text())
        strict = [run["evaluate"]["strict"] for run in record["runs"]]
        rows.append(
            f"| `{record['preset']}` | {percent(mean(s['raw_recall'] for s in strict))} % | {percent(mean(s['recall'] for s in strict))} / "
            f"{percent(mean(s['precision'] for s in strict))} % | {percent(mean(s['recall_at_precision']['95'] for s in strict))} % | "
            f"{percent(mean(s['average_precision'] for s in strict))} % |"
        )
        sources.append(source(record))
    return rows + ["", *[line + "." for line in sources]]


def runs_of_kinds():
    """Of every kind of place and what is known of its viewpoints, each scored by a fit on all other kinds."""
    groups = {}
    for run in load("confidence.json")["runs"]:
        groups.setdefault((run["kind"], run["viewpoints"]), []).append(run)
    return sorted(groups.items())


def kinds_of_places():
    out = [
        "| kind | viewpoints | runs | first correct / any mode, % | R@P95, % | ECE | correct above 0.9 | correct poses reported from 0.5 on, % | precision, % |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for (kind, viewpoints), runs in runs_of_kinds():
        of = lambda key: mean(run[key] for run in runs)  # noqa: B023,E731
        total = lambda key: sum(run[key] for run in runs)  # noqa: B023,E731
        out.append(
            f"| {kind} | {'none' if viewpoints == 'unknown' else viewpoints} | {len(runs)} | {of('raw'):.1f} / {of('generated'):.1f} | {of('geo_R@P95'):.1f} | "
            f"{of('ECE'):.3f} | {total('right_above_0.9_count')} of {total('above_0.9')} | {100 * total('right_from_0.5') / total('right'):.0f} | "
            f"{100 * total('right_from_0.5') / max(1, total('from_0.5')):.0f} |"
        )
    return out


def loop_consistency():
    record = load("loop_consistency.json")
    out = [
        "| scene | | first correct, % | R@P95 / R@P99 / AP, % | ECE | above 0.9 | of them correct, % |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for scene in record["scenes"]:
        for text, of in (
            ("each pair alone", scene["before"]),
            ("loop consistency", scene["after"]),
        ):
            out.append(
                f"| {scene['scene']} | {text} | {of['raw_recall']:.1f} | {of['R@P95']:.1f} / {of['R@P99']:.1f} / {of['AP']:.1f} | "
                f"{of['calibration_error']:.3f} | {of['above_0.9']} | {of['right_above_0.9']:.1f} |"
            )
    return out


def few_points():
    record = load("few_points.json")
    out = [
        "| overlapping points | poses | mean confidence without the factor | correct | mean confidence |",
        "| --- | --- | --- | --- | --- |",
    ]
    for b in record["bins"]:
        span = f"{b['from']} to {b['below'] - 1}" if b["below"] else f"{b['from']} or more"
        out.append(
            f"| {span} | {b['poses']} | {b['before']:.2f} | {b['right']:.2f} | {b['after']:.2f} |"
        )
    return [*out, "", source(record) + "."]


def closing_loops():
    out = [
        "| scene | loops of three correct poses | of them close, % | loops with a false pose | of them close, % |",
        "| --- | --- | --- | --- | --- |",
    ]
    for scene in load("loop_consistency.json")["scenes"]:
        cells = [
            f"{count} | {100 * close / count:.1f}" if count else "0 |"
            for count, close in (scene["loops"]["right"], scene["loops"]["wrong"])
        ]
        out.append(f"| {scene['scene']} | {' | '.join(cells)} |")
    return out


FRONT_SCENES = {
    "houses A, B, hospital E": ("house/A", "house/B", "hospital/E"),
    "red kitchen": ("redkitchen/fragments",),
    "generated houses": ("gen/house1", "gen/house2"),
    "offices": ("gen/office1", "gen/office2"),
    "warehouses": ("gen/ware1", "gen/ware2"),
    "A, E, moved": ("house/A, moved", "hospital/E, moved"),
}


def front():
    record = load("front.json")
    rows = record["rows"]

    def mean_of(scenes, setting, value):
        return statistics.mean(
            value(row) for row in rows if row["setting"] == setting and row["scene"] in scenes
        )

    def cell(scenes, setting):
        if not any(row["setting"] == setting and row["scene"] in scenes for row in rows):
            return ""
        first, found, recall = (
            mean_of(scenes, setting, value)
            for value in (
                lambda row: row["first"],
                lambda row: row["any"],
                lambda row: row["geometric"]["R@P95"],
            )
        )
        ms = mean_of(scenes, setting, lambda row: row["ms"])
        return f"{first:.1f} / {found:.1f} / {recall:.1f} / {ms:.3f}"

    out = [
        f"| setting | {' | '.join(FRONT_SCENES)} |",
        "| --- |" + " --- |" * len(FRONT_SCENES),
    ]
    for setting in dict.fromkeys(row["setting"] for row in rows):
        cells = [cell(scenes, setting) for scenes in FRONT_SCENES.values()]
        out.append(f"| {setting} | {' | '.join(cells)} |")
    seeds = sorted({row["seed"] for row in rows})
    return [
        *out,
        "",
        f"Seeds {', '.join(map(str, seeds))} at commit {record['commit']}, {record['device']}. {record['remark']}",
    ]


SENSORS = {
    "kitchen": "rooms: red kitchen, depth camera",
    "dragon": "objects: Stanford dragon, range scanner",
    "cad": "CAD: scans on points of the models",
    "cad_mesh": "CAD: scans on the models as meshes",
    "kitti": "LiDAR: KITTI, 64 beams",
    "lidar": "LiDAR: sample of small_gicp",
    "fgr": "objects: range pairs of FGR",
}
CONDITIONS = {
    "said": "moved, viewpoints given",
    "nothing": "moved, nothing given",
    "still": "not moved, nothing given",
}

DECISIONS = ("given", "origin", "normals", "none", "model")


def span(runs, key):
    """The value of all runs, or its range."""
    values = [run.get(key, 0) for run in runs]
    low, high = min(values), max(values)
    return f"{low}" if low == high else f"{low} to {high}"


def viewpoints():
    """Of each condition the runs with several seeds; records of one seed have the counts alone."""
    record = load("viewpoints.json")
    out = [
        "| data | clouds | seeds | pairs | first correct | reported | with `--set accept_symmetry=true` | false reports | decisions about the clouds |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, text in SENSORS.items():
        found = record["sets"].get(name, {})
        for condition, runs in found.get("conditions", {}).items():
            runs = runs if isinstance(runs, list) else [runs]
            pairs = f"{runs[0]['pairs']}" + (
                f" and {runs[0]['negatives']} negative" if runs[0].get("negatives") else ""
            )
            keys = {key: None for run in runs for key in run if key.split(": ")[-1] in DECISIONS}
            decided = ", ".join(f"{span(runs, key)} {key}" for key in keys)
            cells = [text, CONDITIONS[condition], len(found["seeds"]), pairs]
            cells += [span(runs, key) for key in ("right", "reported", "reported_up_to_symmetry")]
            cells += [span(runs, "reported_up_to_symmetry_wrong"), decided]
            out.append(f"| {' | '.join(map(str, cells))} |")
    made = [
        f"* `{entry['command']}` at commit {entry['commit'].rstrip('+')}."
        for entry in record["sets"].values()
        if "command" in entry
    ]
    return [*out, "", "Made by", "", *made]


SENSOR_UNKNOWN = ("fgr",)  # whether the origin is the viewpoint of an unmoved scan


def decisions():
    """Right decisions about clouds whose viewpoint nobody said, over all seeds."""
    record = load("viewpoints.json")
    groups = {
        "moved scans: `none`": ("nothing", "scan", "none"),
        "scans not moved: `origin`": ("still", "scan", "origin"),
        "models: `model`": (None, "model", "model"),
    }
    out = [f"| data | {' | '.join(groups)} | all, % |", "| --- |" + " --- |" * (len(groups) + 1)]
    every = [0, 0]
    for name, text in SENSORS.items():
        cells, both = [text], [0, 0]
        for condition, kind, right in groups.values():
            counts = [0, 0]
            for at, runs in record["sets"].get(name, {}).get("conditions", {}).items():
                if at not in ([condition] if condition else ["nothing", "still"]):
                    continue
                if at == "still" and kind == "scan" and name in SENSOR_UNKNOWN:
                    continue
                for key, count in ((k, v) for run in runs for k, v in run.items()):
                    if key.startswith(f"{kind}: "):
                        counts[0] += count * (key == f"{kind}: {right}")
                        counts[1] += count
            cells.append(f"{counts[0]} of {counts[1]}" if counts[1] else "")
            both = [a + b for a, b in zip(both, counts)]
        every = [a + b for a, b in zip(every, both)]
        if both[1]:
            out.append(f"| {' | '.join(cells)} | {100 * both[0] / both[1]:.0f} |")
    share = f"{100 * every[0] / every[1]:.1f}"
    return [*out, f"| all: {every[0]} of {every[1]} | | | | {share} |"]


def verification():
    record = load("verification.json")
    rows = [
        "| scene | pairs | area under the ROC curve | confidence above 0.5: true poses | wrong poses |",
        "| --- | --- | --- | --- | --- |",
    ]
    rows += [
        f"| {row['scene']} | {row['pairs']} | {row['area_under_curve']:.4f} | {percent(row['true_above_half'])} % | "
        f"{percent(row['moved_above_half'])} % |"
        for row in record["scenes"]
    ]
    return [*rows, "", source(record) + "."]


CALIBRATED = {
    "rooms3": "rooms, three times the errors of the depth camera",
    "street": "street, spinning LiDAR of 16 to 128 rings",
    "hall": "halls, spinning LiDAR or terrestrial scanner",
    "parts": "machined parts, scans on models",
}


def calibration():
    record = load("calibration.json")
    rows = [
        "| data | folder | pairs | correct | error before | after | if every confidence were true | correct reported before | after | false reported before | after | slope | offset |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, text in CALIBRATED.items():
        if name not in record["kinds"]:
            continue
        kind = record["kinds"][name]
        made = kind["calibration"]
        for which in ("first", "second"):
            before, after = kind[which]["before"], kind[which]["after"]
            rows.append(
                f"| {text} | {which} | {before['pairs']} | {before['correct']} | {before['error']:.3f} | {after['error']:.3f} | {after['expected_error']:.3f} | "
                f"{before['reported']} | {after['reported']} | {before['reported_false']} | {after['reported_false']} | "
                f"{made['slope']:.2f} | {made['offset']:.2f} |"
            )
    return [*rows, "", source(record) + "."]


DOMAINS = {
    "street": "LiDAR of 16 to 128 rings in streets, simulated",
    "kitti": "LiDAR of 64 rings, KITTI",
    "lidar": "LiDAR, another pair",
    "hall": "LiDAR or terrestrial scanner in halls, simulated",
    "objects": "range scans of objects, simulated",
    "dragon": "range scans, Stanford dragon",
    "fgr": "range scans of FGR, points alone",
    "figures": "scans on models, rounded shapes, simulated",
    "parts": "scans on models, machined parts, simulated",
    "cad_mesh": "scans on models, real parts, meshes",
    "cad": "scans on models, real parts, points",
}


def domains():
    record = load("domains.json")
    rows = [
        "| data | seeds | pairs | true pairs | correct among the modes | first correct | reported | false reports | above 0.9 | of these false | ECE |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, text in DOMAINS.items():
        of = record["domains"][name]
        rows.append(
            f"| {text} | {len(of.get('seeds', [1]))} | {of['pairs']} | {of['true_pairs']} | {of['among_modes']} | {of['first']} | {of['reported']} | "
            f"{of['reported_wrong']} | {of['sure']} | {of['sure_wrong']} | {of['ECE']:.3f} |"
        )
    newer = {}
    for name in DOMAINS:
        commit = record["domains"][name].get("commit", record["commit"])
        if commit != record["commit"]:
            newer.setdefault(commit, []).append(DOMAINS[name])
    also = [f"At commit {commit}: {'; '.join(names)}." for commit, names in newer.items()]
    return [*rows, "", " ".join([source(record) + ".", *also])]


UNSEEN = {
    "house_a": "rooms: house A, simulated depth camera",
    "hospital_e": "rooms: hospital E, simulated depth camera",
    "frames": "rooms: single depth images of the red kitchen",
    "clutter": "CAD: scans of parts with clutter",
}


def decisions_unseen():
    """Decisions about scans by which no threshold was chosen, over all seeds."""
    record = load("viewpoints.json")
    out = [
        "| data | moved scans: `none` | moved: `origin`, free space invented | not moved: `origin` | not moved: `none`, safe | correct, % |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    measured = {name: text for name, text in UNSEEN.items() if name in record["sets"]}
    for name, text in measured.items():
        counted = {}
        for condition in ("nothing", "still"):
            runs = record["sets"][name]["conditions"][condition]
            for decision in ("none", "origin"):
                counted[condition, decision] = sum(run.get(f"scan: {decision}", 0) for run in runs)
            every = (n for run in runs for key, n in run.items() if key.startswith("scan: "))
            counted[condition] = sum(every)
        moved, still = counted["nothing"], counted["still"]
        share = 100 * (counted["nothing", "none"] + counted["still", "origin"]) / (moved + still)
        out.append(
            f"| {text} | {counted['nothing', 'none']} of {moved} | {counted['nothing', 'origin']} | "
            f"{counted['still', 'origin']} of {still} | {counted['still', 'none']} | {share:.0f} |"
        )
    commits = sorted({record["sets"][name]["commit"].rstrip("+") for name in measured})
    return [*out, "", f"Made by `bench/accuracy/viewpoints.py` at commit {', '.join(commits)}."]


def flat_scans():
    record = load("flat_scans.json")
    rows = [
        "| scans | viewpoints | pairs | overlapping | best candidate correct, % | reported: recall, % | precision, % | recall at precision >= 95 %, % | above 0.9 | of these correct, % |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    commits = set()
    for of in record["generated"] + [of for of in record["sets"] if of["real"]]:
        commits.add(of.get("commit", record["commit"]))
        shares = [
            "-" if of[key] is None else percent(of[key])
            for key in ("best_candidate_correct", "recall", "precision", "recall_at_95")
        ]
        sure = of["correct_above_0.9"]
        rows.append(
            f"| {of['set']} | {of.get('viewpoints', 'inferred')} | {of['pairs']} | {of['overlapping']} | {' | '.join(shares)} | {of['above_0.9']} | "
            f"{'-' if sure is None else percent(sure)} |"
        )
    earlier = ", ".join(sorted(commits - {record["commit"]}))
    return [*rows, "", source(record) + (f"; real scans: {earlier}." if earlier else ".")]


TABLES = {
    "flat_scans": flat_scans,
    "decisions_unseen": decisions_unseen,
    "domains": domains,
    "calibration": calibration,
    "viewpoints": viewpoints,
    "decisions": decisions,
    "verification": verification,
    "redkitchen": redkitchen,
    "kinds_of_places": kinds_of_places,
    "loop_consistency": loop_consistency,
    "closing_loops": closing_loops,
    "few_points": few_points,
    "front": front,
}
