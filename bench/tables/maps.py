# SPDX-License-Identifier: BSD-3-Clause
"""Tables of maps."""

from tables.records import load, mean, source

SCENES = {
    "redkitchen": "red kitchen",
    "house_A": "house A",
    "house_B": "house B",
    "hospital_E": "hospital E",
}
VARIANTS = {
    "": "complete",
    "_half": "every second scan",
    "_third": "every third scan",
    "_nocam": "complete, without cameras.txt",
    "_half_nocam": "every second scan, without cameras.txt",
    "_third_nocam": "every third scan, without cameras.txt",
}

REPEATED = {
    "office_1": "generated office 1",
    "office_2": "generated office 2",
    "warehouse_1": "generated warehouse 1",
    "warehouse_2": "generated warehouse 2",
    "bare_office1": "public office, bare, walk 1",
    "bare_office2": "public office, bare, walk 2",
    "bare_pal_home1": "pal_home, bare, walk 1",
    "bare_pal_home2": "pal_home, bare, walk 2",
}


def names():
    """Name in the record and in the tables of every scene and variant."""
    for scene, shown in SCENES.items():
        for suffix, variant in VARIANTS.items():
            yield scene + suffix, f"{shown}, {variant}"


def rows_of(maps):
    for name, shown in names():
        if name in maps:
            yield shown, maps[name]
    if "foreign" in maps:
        yield "house A and 5 scans of hospital E", maps["foreign"]
    if "two_buildings" in maps:
        figures = maps["two_buildings"]
        yield (
            f"house A and hospital E in one folder, {figures['after_refinement']['pairs']} pairs",
            figures,
        )
    for name, figures in maps.items():
        if name.startswith("generated_"):
            seed = name.removeprefix("generated_")
            yield f"generated house {seed}, `--prune 20`", figures


def errors(figures):
    known = [island for island in figures["islands"] if "rmse_cm" in island]
    return ", ".join(f"{i['rmse_cm']:.1f} cm {i['rmse_degrees_own']:.1f}°" for i in known) or "-"


def maps():
    record = load("maps.json")
    rows = [
        "| scans | placed | islands of | edges: accepted / wrong | RMSE before the joint refinement | after | graph, refinement in s | MiB |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, both in rows_of(record["maps"]):
        before, after = both["before_refinement"], both["after_refinement"]
        seconds = after["seconds"]
        rows.append(
            f"| {name} | {after['placed']} of {after['scans']} | {', '.join(str(i['scans']) for i in after['islands'])} "
            f"| {after['accepted']} / {after['wrong']} | {errors(before)} | {errors(after)} "
            f"| {seconds['graph']:.1f}, {seconds['refine']:.1f} | {after['peak_memory_mib']:.0f} |"
        )
    return [*rows, "", source(record) + "."]


def maps_repeated():
    """Buildings of repeated furniture, audited: a row each with and without cameras."""
    maps = load("maps.json")["maps"]
    rows = [
        "| scans | complete | every second scan | every third scan |",
        "| --- | --- | --- | --- |",
    ]
    for name, shown in REPEATED.items():
        for cameras, said in (("", ""), ("_nocam", ", without cameras.txt")):
            row = []
            for thinned in ("", "_half", "_third"):
                f = maps[name + thinned + cameras]["after_refinement"]
                row.append(f"{f['placed']} of {f['scans']}, {f['accepted']} / {f['far_off']}")
            rows.append(f"| {shown}{said} | {' | '.join(row)} |")
    return rows


def maps_short():
    """The complete sets with cameras."""
    record = load("maps.json")
    rows = [
        "| scans | placed | islands of | edges: accepted / wrong | RMSE after the joint refinement |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, both in rows_of(record["maps"]):
        if "every" in name or "without" in name:
            continue
        after = both["after_refinement"]
        islands = ", ".join(str(island["scans"]) for island in after["islands"])
        rows.append(
            f"| {name} | {after['placed']} of {after['scans']} | {islands} | {after['accepted']} / {after['wrong']} | {errors(after)} |"
        )
    return [*rows, "", source(record) + "."]


def peers():
    record = load("maps.json")
    rows = [
        "| scans | method | placed | edges: accepted / wrong | RMSE |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, theirs in record["peers"]["open3d"].items():
        shown = dict(names())[name]
        ours = record["maps"][name]["after_refinement"]
        for method, figures in (("gpureg", ours), ("Open3D multiway registration", theirs)):
            rows.append(
                f"| {shown} | {method} | {figures['placed']} of {figures['scans']} "
                f"| {figures['accepted']} / {figures['wrong']} | {errors(figures)} |"
            )
    return rows


def located():
    """Scans of a kind in a map, a row each."""
    groups = {}
    for name in ("locate.json", "locate_copies.json", "locate_sweeps.json"):
        for row in load(name)["rows"]:
            kind = row.get("kind", "fragment" if row["here"] else "fragment of another scene")
            groups.setdefault((row["map"], kind), []).append(row)
    rows = [
        "| map | scans | asked | first pose correct | found | of them wrong | ambiguous | CPU seconds a scan |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for (place, kind), scans in groups.items():
        found = [s for s in scans if s["status"] == "found"]
        correct = sum(s["correct"] for s in scans) if scans[0]["here"] else "-"
        rows.append(
            f"| {place} | {kind} | {len(scans)} | {correct} | {len(found)} "
            f"| {sum(not s['correct'] for s in found)} | {sum(s['status'] == 'ambiguous' for s in scans)} "
            f"| {mean([s['cpu_seconds'] for s in scans]):.1f} |"
        )
    return rows


def located_generated():
    """Fragments among many generated buildings."""
    record = load("locate_generated.json")
    rows = [
        "| map | at commit | points, tiles | asked | first pose correct | found, of them wrong | from | ambiguous | recall at 99 % precision | of other buildings: found |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for of in record["maps"]:
        rows.append(
            f"| {of['map']} | {of['commit']} | {of['map_points']:,}, {of['tiles']} | {of['asked']} "
            f"| {of['first_correct']} | {of['found']}, {of['found_wrong']} | {of['min_confidence']} | {of['ambiguous']} "
            f"| {of['recall_at_precision_99']} of {of['asked']} | {of['strangers_found']} of {of['strangers']} |"
        )
    return [*rows, "", f"Made by `{record['command']}`."]


def city_runs(sensor, voxel_size):
    """Runs of the record whose rows are of such sensors, with these rows."""
    record = load("locate_city.json")
    for run in record["runs"]:
        rows = [row for row in record["rows"] if row["map"] == run["map"]]
        if rows[0]["sensor"].startswith(sensor) and f" {voxel_size} m" in run["map"]:
            yield run, rows


def found_of(rows):
    here = [row for row in rows if row["here"]]
    away = [row for row in rows if not row["here"]]
    found = [row for row in here if row["status"] == "found"]
    right = [
        row
        for row in here
        if row["correct"]
        and (row["status"] == "found" or (row["status"] == "ambiguous" and row["copies"] > 1))
    ]
    return (
        f"{len(right)} of {len(here)}, {sum(not row['correct'] for row in found)} wrong "
        f"| {sum(row['correct'] for row in here)} "
        f"| {sum(row['status'] == 'found' for row in away)} of {len(away)}"
    )


def located_city():
    """Sweeps from streets: cost against the size of the map."""
    rows = [
        "| buildings | raw points | voxels, tiles | built in, peak | file | loaded in | first call | a scan alone, in a batch | found | first pose correct | of other cities: found |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for run, of_run in city_runs("street", 0.4):
        rows.append(
            f"| {run['buildings']:,} | {run['raw_points']:,} | {run['map_points']:,}, {run['tiles']} "
            f"| {run['build_seconds']:.1f} s, {run['build_memory_mib']:,} MiB | {run['file_mib']:.1f} MiB | {run['load_seconds']:.1f} s "
            f"| {run['first_seconds']:.2f} s | {1e3 * run['alone_seconds']:.0f} ms, {1e3 * run['batch_seconds']:.0f} ms | {found_of(of_run)} |"
        )
    return rows


def located_rooms():
    rows = [
        "| buildings | voxels | a scan alone, in a batch | found | first pose correct | of other cities: found |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for voxel_size in (0.2, 0.1):
        for run, of_run in city_runs("room", voxel_size):
            rows.append(
                f"| {run['buildings']} | {voxel_size} m | {1e3 * run['alone_seconds']:.0f} ms, {1e3 * run['batch_seconds']:.0f} ms | {found_of(of_run)} |"
            )
    return rows


def pruning():
    """Overlapping pairs that pruning keeps, a column for each share of pairs tried."""
    record = load("pruning.json")
    sets, kept = {}, {}
    for row in sorted(record["rows"], key=lambda row: row["neighbors"]):
        sets.setdefault(row["set"], []).append(row)
    shares = [f"{row['tried_percent']:.1f} %" for row in next(iter(sets.values()))]
    for name, rows in sets.items():
        kept[f"**{name}**: {rows[0]['scans']} scans, {rows[0]['overlapping']} pairs overlap"] = [
            row["kept_percent"] for row in rows
        ]
        for part in rows[0]["kept_percent_of"]:
            kept[part] = [row["kept_percent_of"][part] for row in rows]
    return [
        f"| pairs tried | {' | '.join(shares)} |",
        "| --- |" + " --- |" * len(shares),
        *(f"| {name} | {' | '.join(map(str, values))} |" for name, values in kept.items()),
        "",
        source(record) + ".",
    ]


def confidences():
    """The confidences of the edges of each map."""
    record = load("map_confidence.json")
    rows = [
        "| map | edges | ECE: pair alone | loop consistency | map | map, fitted without the building | correct above 0.9: pair alone | loop consistency | map |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    kinds = ("pair_confidence", "confidence", "map_confidence")
    for of in record["maps"]:
        errors = " | ".join(f"{of[kind]['ECE']:.3f}" for kind in kinds)
        sure = " | ".join(f"{of[kind]['of_them_correct']} of {of[kind]['above']}" for kind in kinds)
        rows.append(f"| {of['map']} | {of['edges']} | {errors} | {of['without']:.3f} | {sure} |")
    return [*rows, "", source(record) + "."]


SCORES = {
    "pairs": "every pair by itself",
    "maps": "pairs of buildings by `map_confidence`",
}
DRAWS = {
    "scenes": "all other scenes",
    "few_scenes": "19 other scenes",
    "domain": "scenes of other domains",
    "as_independent_pairs": "all others, as independent pairs",
}


def promised_risk():
    record = load("risk.json")
    rows = [
        "| confidence | calibrated on | risk, % | draws | kept, % | recall, % | from 0.5 on, % |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for score, of_score in SCORES.items():
        for draws, of_draws in DRAWS.items():
            for risk, of in record[score].items():
                of = of[draws]
                rows.append(
                    f"| {of_score} | {of_draws} | {100 * float(risk):.0f} | {of['draws']} | {100 * of['kept']:.1f} "
                    f"| {100 * of['recall']:.1f} | {100 * of['recall_from_half']:.1f} |"
                )
    return [*rows, "", source(record) + "."]


def risk_of_scans():
    """Of the shares of bad scans, the one of which most folders break the promise."""
    record = load("risk_of_scans.json")
    rows = [
        "| scans | promised, % | broken, % | as independent pairs, % | bad scans in runs of five, % | with a threshold, of 0.2 % bad scans, % | of 1 %, % |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for scans, risk in dict.fromkeys((row["scans"], row["risk"]) for row in record["rows"]):
        of = [row for row in record["rows"] if (row["scans"], row["risk"]) == (scans, risk)]
        worst = [max(row["broken"][kind] for row in of) for kind in ("scans", "pairs", "runs")]
        use = [
            row["supported"]
            for bad in (0.002, 0.01)
            for row in of
            if (row["bad"], row["false"]) == (bad, 1)
        ]
        figures = " | ".join(f"{100 * share:.0f}" for share in worst + use)
        rows.append(f"| {scans} | {100 * risk:.0f} | {figures} |")
    return [*rows, "", source(record) + "."]


def alike_kinds():
    """Sets of each kind that a fit on the other kinds calls alike."""
    rows = [
        "| kind | places | called alike, of sets | their share of the poses, % |",
        "| --- | --- | --- | --- |",
    ]
    for of in load("alike_sets.json")["kinds"]:
        places = "alike" if of["alike"] else "distinct"
        rows.append(
            f"| {of['kind']} | {places} | {of['called_alike']} of {of['sets']} | {of['poses_percent']} |"
        )
    return rows


TABLES = {
    "alike_kinds": alike_kinds,
    "risk_of_scans": risk_of_scans,
    "maps": maps,
    "maps_repeated": maps_repeated,
    "maps_short": maps_short,
    "map_peers": peers,
    "located": located,
    "located_generated": located_generated,
    "located_city": located_city,
    "located_rooms": located_rooms,
    "pruning": pruning,
    "map_confidence": confidences,
    "promised_risk": promised_risk,
}
