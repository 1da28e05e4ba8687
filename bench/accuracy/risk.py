#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Is a promised risk kept in scenes that the threshold did not see?

Each draw leaves one scene out. `control_risk` chooses a threshold from the pairs of the others, once
with scenes and once as if all pairs were independent. A promise is kept where at most its share of
the poses that the left-out scene reports are false. `scenes`: leave-one-scene-out over all;
`few_scenes`: 19 others at random; `domain`: all scenes of the left-out one's domain are left out,
for which nothing is promised. Recall: of the correct poses of all left-out scenes, at the threshold
and from 0.5 on.

With --simulate: is it kept in folders whose pairs share scans? A share of the scans is bad, and a share
of the pairs of a bad scan is false, whatever its confidence. A folder breaks a promise where a threshold
is supported though more of all pairs are false in the long run. `scans`: by the scans of all pairs;
`pairs`: as if these were independent; `runs`: by scans, but bad ones come in runs of five, for which
nothing is promised. `supported`: folders with a threshold, by scans.

usage: risk.py FOLDER [--building NAME=SCENE_FOLDER=RESULT.json ...]
       [--map NAME=BUILDING=SCENE_FOLDER=RECONSTRUCTION.json ...] [-o RECORD]
       risk.py --simulate    (risk_of_scans.json beside RECORD)
FOLDER: DOMAIN.json files of domains.py. A building has gt_all.log and gt_all.info, and its result is
that of `gpureg batch` or the pairs.json of `gpureg reconstruct`. Of maps, the map_confidence of the
edges counts: `pairs` of the record has the domains with the buildings, `maps` with the maps. Needs
numpy and the Python package gpureg."""

import json
import pathlib

import calibrate
import gpureg
import map_confidence
import numpy as np
import record

RISKS = (0.1, 0.05, 0.01)
FEWEST = 19  # scenes of which control_risk can promise anything
DRAWS = 400  # with so few
REPORTED = 0.5
SCANS = (24, 50, 100, 200, 400)  # of a simulated folder
BAD_SHARES, FALSE_SHARES, RUN, FOLDERS = (0.002, 0.01, 0.02, 0.06, 0.1), (0.5, 1), 5, 200
ONE_SCENE = ("fgr", "dragon", "kitchen", "kitti", "lidar")  # pairs of one sensor in one place


def scenes_of_domain(path):
    """Confidences and labels by scene; conditions and seeds of a scene belong together."""
    scenes = {}
    for pair in json.loads(path.read_text())["pairs"]:
        if not pair["modes"]:
            continue
        scene = 0 if path.stem in ONE_SCENE else pair["scene"]
        row = pair["modes"][0]["confidence"], pair["correct"][:1] == [True]
        scenes.setdefault(scene, []).append(row)
    return [(path.stem, np.array(rows, float)) for rows in scenes.values()]


def building(text):
    _, folder, result = text.split("=")
    verdict = calibrate.redwood_verdicts(pathlib.Path(folder))
    rows = []
    for pair in json.loads(pathlib.Path(result).read_text())["pairs"]:
        if pair["T_ij"] is None:
            continue
        correct = verdict(pair["i"], pair["j"], np.reshape(pair["T_ij"], (4, 4)))
        if correct is not None:
            rows.append((pair["confidence"], correct))
    return np.array(rows, float)


def edges(text):
    of = map_confidence.Map(text)
    return np.column_stack([of.confidences["map_confidence"], of.correct]).astype(float)


def counts(scenes):
    out = {}
    for name, rows in scenes:
        of = out.setdefault(name, {"scenes": 0, "pairs": 0, "correct": 0})
        of["scenes"] += 1
        of["pairs"] += len(rows)
        of["correct"] += int(rows[:, 1].sum())
    return out


def threshold_of(scenes, risk, with_scenes):
    """Above 1 where nothing is supported, so that nothing is reported."""
    rows = np.concatenate(scenes)
    labels = np.repeat(np.arange(len(scenes)), [len(scene) for scene in scenes])
    found = gpureg.control_risk(
        rows[:, 0], rows[:, 1] > 0, scenes=labels if with_scenes else None, max_risk=risk
    )
    return found.min_confidence if found.supported else 2.0


def figures(draws, risk):
    """draws: the left-out scene and the threshold of each."""
    kept, thresholds, reported, usual, correct = 0, [], 0, 0, 0
    for rows, threshold in draws:
        out = rows[rows[:, 0] >= threshold, 1]
        kept += (out == 0).sum() <= risk * len(out)
        thresholds.append(threshold)
        reported += out.sum()
        usual += rows[rows[:, 0] >= REPORTED, 1].sum()
        correct += rows[:, 1].sum()
    return {
        "draws": len(draws),
        "kept": round(float(kept / len(draws)), 4),
        "median_threshold": round(float(np.median(thresholds)), 5),
        "recall": round(float(reported / correct), 4),
        "recall_from_half": round(float(usual / correct), 4),
    }


def measured(scenes, risk):
    rng = np.random.default_rng(1)
    rows = [of for _, of in scenes]

    def others(k, same_domain=True):
        return [
            r for n, (of, r) in enumerate(scenes) if n != k and (same_domain or of != scenes[k][0])
        ]

    every = range(len(scenes))
    few = []
    for _ in range(DRAWS):
        left_out, *chosen = rng.permutation(len(scenes))[: FEWEST + 1]
        few.append((rows[left_out], threshold_of([rows[k] for k in chosen], risk, True)))
    return {
        "scenes": figures([(rows[k], threshold_of(others(k), risk, True)) for k in every], risk),
        "few_scenes": figures(few, risk),
        "domain": figures(
            [(rows[k], threshold_of(others(k, False), risk, True)) for k in every], risk
        ),
        "as_independent_pairs": figures(
            [(rows[k], threshold_of(others(k), risk, False)) for k in every], risk
        ),
    }


def simulated_folder(rng, scans, bad_share, false_share, run):
    """Pairs of all scans, confidences and labels; most are confident, right or not."""
    bad = np.repeat(rng.random(-(-scans // run)) < bad_share, run)[:scans]
    pairs = np.argwhere(np.tri(scans, k=-1))
    false = bad[pairs].any(1) & (rng.random(len(pairs)) < false_share)
    return pairs, 1 - rng.random(len(pairs)) ** 3, ~false


def simulated(scans, bad_share, false_share, draws):
    """By risk: shares of the folders that break the promise, and of those with a threshold."""
    true_risk = false_share * (1 - (1 - bad_share) ** 2)
    counts = {risk: dict.fromkeys(("scans", "pairs", "runs"), 0) for risk in RISKS}
    for draw in range(draws):
        for kind, run in (("scans", 1), ("pairs", 1), ("runs", RUN)):
            rng = np.random.default_rng([draw, scans])
            pairs, confidences, correct = simulated_folder(rng, scans, bad_share, false_share, run)
            of = None if kind == "pairs" else pairs
            for risk in RISKS:
                found = gpureg.control_risk(confidences, correct, scans=of, max_risk=risk)
                counts[risk][kind] += found.supported
    out = []
    for risk, of in counts.items():
        row = {"draws": draws, "scans": scans, "bad": bad_share, "false": false_share, "risk": risk}
        row |= {"supported": of["scans"] / draws}
        broken = {kind: count / draws if true_risk > risk else 0.0 for kind, count in of.items()}
        out.append(row | {"broken": broken})
    return out


def simulate(arguments):
    rows = []
    for scans in SCANS:
        for bad_share in BAD_SHARES:
            for false_share in FALSE_SHARES:
                draws = min(FOLDERS, FOLDERS * 40 // scans)  # large ones take time
                rows += simulated(scans, bad_share, false_share, draws)
                print(*rows[-len(RISKS) :], sep="\n", flush=True)
    arguments.output = arguments.output.with_name("risk_of_scans.json")
    record.write(arguments, "bench/accuracy/risk.py --simulate", {"rows": rows})


def main():
    parser = record.parser(__doc__, "risk.json")
    parser.add_argument("folder", type=pathlib.Path, nargs="?")
    parser.add_argument("--simulate", action="store_true")
    parser.add_argument("--building", nargs="+", default=[])
    parser.add_argument("--map", nargs="+", default=[])
    arguments = parser.parse_args()
    if arguments.simulate:
        return simulate(arguments)
    scenes = []
    for path in sorted(arguments.folder.glob("*.json")):
        scenes += scenes_of_domain(path)
    sets = {
        "pairs": [("building", building(text)) for text in arguments.building],
        "maps": [("map", edges(text)) for text in arguments.map],
    }
    content = {"domains": counts([*scenes, *sets["pairs"], *sets["maps"]])}
    for name, more in sets.items():
        content[name] = {}
        for risk in RISKS:
            content[name][str(risk)] = measured([*scenes, *more], risk)
            for draws, of in content[name][str(risk)].items():
                print(name, risk, draws, of, flush=True)
    command = (
        "bench/accuracy/risk.py FOLDER --building NAME=SCENE=RESULT --map NAME=BUILDING=SCENE=MAP"
    )
    record.write(arguments, command, content)


if __name__ == "__main__":
    main()
