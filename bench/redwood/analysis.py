# SPDX-License-Identifier: BSD-3-Clause
"""Figures of a scene beyond recall and precision, from its evaluated pairs (`gpureg evaluate
--json`).
"""

import pathlib

OVERLAP_EDGES = [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 1.0]
DEGREE_EDGES = [0, 5, 15, 45, 75, 105, 135, 165, 180]
LITTLE = 0.5  # metres: a wrong pose nearer than that is "off by little"


def overlaps(folder):
    """Overlap (the larger of both directions) by pair from gt_overlap.txt; empty where the scene
    has none.
    """
    path = pathlib.Path(folder) / "gt_overlap.txt"
    found = {}
    if path.exists():
        for number, line in enumerate(path.read_text().splitlines(), 1):
            fields = line.split()
            if len(fields) != 4:
                raise SystemExit(
                    f"error: {path}:{number}: {len(fields)} fields, expected 4: i j max min"
                )
            found[int(fields[0]), int(fields[1])] = float(fields[2])
    return found


def bins(values, edges):
    """How many values are in [edge, next edge); the last bin is closed."""
    counts = [0] * (len(edges) - 1)
    for value in values:
        for k in range(len(counts)):
            if edges[k] <= value < edges[k + 1] or (k == len(counts) - 1 and value == edges[-1]):
                counts[k] += 1
                break
    return counts


def recall_by_overlap(pairs, overlap):
    """Of the true pairs by overlap: how many there are, reported right, and right when every best
    candidate is reported.
    """
    listed = [pair for pair in pairs if pair["listed"] and (pair["i"], pair["j"]) in overlap]

    def count(chosen):
        return bins([overlap[pair["i"], pair["j"]] for pair in chosen], OVERLAP_EDGES)

    if not listed:
        return None
    return {
        "edges": OVERLAP_EDGES,
        "pairs": count(listed),
        "reported_right": count([p for p in listed if p["reported"] and p["strict"]]),
        "candidate_right": count([p for p in listed if p["strict"]]),
    }


def misses(pairs):
    """Why true pairs are missing among the right reports; the classes add up to all misses."""
    found = {
        "not_tried": 0,
        "no_candidate": 0,
        "right_but_not_reported": 0,
        "wrong_and_not_reported": 0,
        "reported_off_by_little": 0,
        "reported_wrong": 0,
    }
    for pair in pairs:
        if not pair["listed"] or (pair["reported"] and pair["strict"]):
            continue
        if not pair["tried"]:
            name = "not_tried"
        elif pair["error"] is None:
            name = "no_candidate"
        elif not pair["reported"]:
            name = "right_but_not_reported" if pair["strict"] else "wrong_and_not_reported"
        else:
            name = "reported_off_by_little" if pair["error"] < LITTLE else "reported_wrong"
        found[name] += 1
    return found


def wrong_reports(pairs):
    """False positives of the strict rule: correct poses of pairs with little overlap, wrong poses of
    known pairs, and reports on unknown ones.
    """
    false = [pair for pair in pairs if pair["reported"] and not pair["strict"]]
    return {
        "right_but_little_overlap": sum(pair["geometric"] for pair in false),
        "wrong_pose": sum(not pair["geometric"] and pair["known"] for pair in false),
        "no_overlap": sum(not pair["known"] for pair in false),
    }


def rotation_errors(pairs):
    """Histogram over the wrong candidates of true pairs: aliases of rooms pile up near 90 and 180
    degrees.
    """
    wrong = [
        pair["degrees"]
        for pair in pairs
        if pair["listed"] and pair["degrees"] is not None and not pair["strict"]
    ]
    return {"edges": DEGREE_EDGES, "counts": bins(wrong, DEGREE_EDGES)}


def rounded(scores):
    """Scores of one rule with a curve of four digits: a record need not hold more."""
    if scores and "curve" in scores:
        scores["curve"] = [
            [round(recall, 4), round(precision, 4)] for recall, precision in scores["curve"]
        ]
    return scores


def all_of(pairs, overlap):
    return {
        "recall_by_overlap": recall_by_overlap(pairs, overlap),
        "misses": misses(pairs),
        "wrong_reports": wrong_reports(pairs),
        "rotation_errors_of_wrong_candidates": rotation_errors(pairs),
    }
