# SPDX-License-Identifier: BSD-3-Clause
"""The table of unknown scales."""

import statistics

from tables.records import load

GROUPS = {
    "rooms, depth camera": ("kitchen",),
    "house, simulated depth camera": ("house_a",),
    "LiDAR": ("lidar", "kitti"),
    "objects, range scanner": ("dragon",),
    "objects, simulated range scanner": ("fgr",),
    "CAD parts and scans": ("cad",),
}


def of_group(sets, condition):
    """Pairs, correct with the known scale, correct with a searched one, lost; median error in per cent; the times."""
    runs = [run for name in sets for run in name.get(condition, [])]
    total = [
        sum(r["pairs"] for r in runs),
        sum(r["known"]["correct"] for r in runs),
        sum(r["searched"]["correct"] for r in runs),
        sum(r["lost"] for r in runs),
    ]
    # Records before the errors of the pairs have the median of each run.
    errors = [abs(e) for r in runs for e in r.get("scale_errors", [r["scale_error"]])]
    times = [r["times"] for r in runs]
    return total, 100 * statistics.median(errors) if errors else None, times


def of_teaser(sets):
    runs = [run for name in sets for run in name.get("teaser", [])]
    count = (
        {k: sum(r[k] for r in runs) for k in ("with_known", "with_free", "with_own")}
        if runs
        else None
    )
    return "{with_known}, {with_free}, {with_own}".format(**count) if count else "-"


def scale():
    record = load("scale.json")
    rows = [
        "| data | pairs | correct: scale known, `free` | median error of the scale, % | factor 1 given as `free`: pairs, lost | time, in pairs "
        "| correct, TEASER++: known, free, all free |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for shown, names in GROUPS.items():
        sets = [record["sets"][name] for name in names if name in record["sets"]]
        (pairs, known, free, _), error, times = of_group(sets, "free")
        (one, _, _, lost), _, more = of_group(sets, "one")
        if not pairs:
            continue
        shown_error = "-" if error is None else f"{error:.2f}"
        shown_one = f"{one}, {lost}" if one else "-"
        rows.append(
            f"| {shown} | {pairs} | {known}, {free} | {shown_error} | {shown_one} "
            f"| {min(times + more):.0f} to {max(times + more):.0f} | {of_teaser(sets)} |"
        )
    entries = list(record["sets"].values())
    commits = sorted({e["commit"].rstrip("+") for e in entries})
    devices = sorted({e.get("device", e["backend"]) for e in entries})
    return [
        *rows,
        "",
        f"Made by `bench/scale/run.py` at commit {', '.join(commits)} on {', '.join(devices)}.",
    ]


PLACES = {
    "room": "a room, all of it",
    "flat": "two rooms and a doorway",
    "corner": "a third of one room, scan of two rooms",
    "house": "a house from outside",
}
SEARCHES = {
    "known": "scale known",
    "free": "`free`",
    "one": "`free`, one search, voxel size of the scan",
    "given": "the same, viewpoints given",
    "none": "the same, source viewpoint `none`",
    "sized": "`free`, one search, voxel size of both clouds",
}


def photogrammetry():
    record = load("photogrammetry.json")
    rows = [
        "| pictures of | pairs | search | found, reported | scale within 1 % | error of the scale, %: median, largest | lowest confidence | foreign pairs: reported, highest confidence | s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    order = list(PLACES), list(SEARCHES)
    for g in sorted(
        record["groups"],
        key=lambda g: (order[0].index(g["kind"]), order[1].index(g["condition"])),
    ):
        error = "-"
        if g["condition"] != "known" and g["found"]:
            error = f"{g['scale_error']:.2f}, {g['largest_scale_error']:.2f}"
        within = "-" if g["condition"] == "known" else g["within_1_percent"]
        foreign = "-"
        if g["foreign"]:
            foreign = f"{g['foreign_reported']} of {g['foreign']}, {g['foreign_confidence']:.2f}"
        confidence = "-" if g["least_confidence"] is None else f"{g['least_confidence']:.2f}"
        rows.append(
            f"| {PLACES[g['kind']]} | {g['pairs']} | {SEARCHES[g['condition']]} | {g['found']}, {g['reported']} "
            f"| {within} | {error} | {confidence} | {foreign} | {g['seconds']:.0f} |"
        )
    commits = ", ".join(sorted({c.rstrip("+") for c in record["commit"].split(", ")}))
    return [
        *rows,
        "",
        f"Made by `bench/scale/photogrammetry.py` at commit {commits} on {record['processor']}; one thread each.",
    ]


MAPS = {
    "chunks": "a laser scan and three photogrammetric clouds of a generated room",
    "kitchen": "red kitchen",
    "house_a": "house A",
}
FACTORS = {"free": "0.05 to 20, `free`", "drift": "0.8 to 1.25, range given"}


def scaled_maps():
    record = load("scaled_maps.json")
    rows = [
        "| scans | factors | maps | placed: scales known, unknown | wrong edges | error, cm: scales known, unknown | error of the scales, %: RMS, largest | pairs searched | s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    groups = {}
    for row in record["rows"]:
        groups.setdefault((row["set"], row["every"], row["condition"]), []).append(row)
    order = list(MAPS)
    for (name, every, condition), own in sorted(
        groups.items(), key=lambda g: (order.index(g[0][0]), g[0])
    ):
        shown = MAPS[name] + (f", every {every}nd scan" if every == 2 else "")
        known = [row["known"] for row in own]

        def total(entries, key):
            return sum(entry[key] for entry in entries)

        def error(entries):
            return f"{100 * statistics.median([entry['error'] for entry in entries]):.1f}"

        rms = statistics.median([row["scales"][0] for row in own])
        rows.append(
            f"| {shown} | {FACTORS[condition]} | {len(own)} "
            f"| {total(known, 'placed')}, {total(own, 'placed')} of {total(own, 'scans')} "
            f"| {total(known, 'wrong')}, {total(own, 'wrong')} | {error(known)}, {error(own)} "
            f"| {rms:.1f}, {max(row['scales'][1] for row in own):.1f} "
            f"| {total(own, 'searched')} of {total(own, 'pairs')} | {statistics.median([row['seconds'] for row in own]):.0f} |"
        )
    commits = sorted({row["commit"].rstrip("+") for row in record["rows"]})
    return [
        *rows,
        "",
        f"Made by `bench/scale/maps.py` at commit {', '.join(commits)} on {record['rows'][0]['processor']}. Placed: in the largest island.",
    ]


TABLES = {"scale": scale, "photogrammetry": photogrammetry, "scaled_maps": scaled_maps}
