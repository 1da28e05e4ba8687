#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fits the confidence of a pose to its evidence, and tests the fits on buildings that they did not
see. bench/accuracy/rebuild_confidence.py runs it on all inputs of the shipped coefficients.

A run is BUILDING=SCENE_FOLDER=RESULT.json: the JSON of `gpureg batch` on a scene whose folder has
gt.log, gt.info, gt_all.log and gt_all.info. A pose is correct by Redwood's 0.2 m rule against
gt_all. Each run is tested with a fit on the other buildings. A fit on all of them gives the
coefficients of the library. Names and values of the features come from the library: this script
computes none.

Three regressions. The first ranks the modes of a pair by their own evidence: of distinct poses at most
one is correct, so it is a conditional logit over the modes of the pairs that have a correct one. The
second gives the probability that the best mode is correct. It also sees the other modes. No mode gets
more than its share of the odds of all. The third gives the probability that the pose is correct and the
clouds overlap by 30 % or more (in gt.log), which Redwood's strict rule asks for. The second and third
are additive, piecewise linear and monotone in each feature (SIGNS): more overlap never hurts, more
violation never helps, and beyond the values of the fit nothing gets more certain. Each exists four
times: with and without free space, with and without the sides of surfaces. Scans on models and 2-D
scans have logistic regressions that are linear in their features.

Kinds of buildings differ in how often places repeat, and no evidence of one pair tells a copy of a
place from the place. So all kinds take part, bare ones and those full of equal furniture, too: each
run counts the less the more runs its kind has, and kinds made of copies (COPIES) twice. --beside: runs
of other sensors (other_sensor.py) and voxels.

Nothing moves in these scenes. So that a moved chair does not cost a pose its confidence, every pair
is fitted a second time, with little weight, as if up to a tenth of one of its clouds were new.

usage: fit_confidence.py RUN... [--beside RUN=LABEL...] [--others RUN=LABEL...] [--origin RUN...]
[--unknown RUN...] [--header src/confidence/confidence_model.hpp] [-o bench/results/confidence.json]
--others: tested only. LABEL: the row of the table that the run belongs to. --origin, --unknown:
tested only; runs of the same scenes with the origin as the only viewpoint, or with none. Where a
scene has poses.txt (fragment number, world_from_fragment), the record also counts the kinds of
false positives. Needs numpy, scikit-learn, the Python package gpureg, and clang-format for
--header."""

import collections
import itertools
import json
import multiprocessing
import pathlib
import sys

import numpy as np
from record import plain_parser, save

from confidence.model_header import write_header
from confidence.regressions import (
    LINEAR_RANK,
    MODELS,
    conditional_logit,
    library,
    logistic,
    monotone,
    signed_logistic,
)

MAX_ERROR = 0.2  # metres, Redwood's rule for a correct pose
MIN_SEPARATION = 2  # j - i: neighbours in the sequence do not count in Redwood's protocol

# Inverse strengths of the L2 penalty. Chosen among 38 settings by the tables of docs/accuracy.md
# and by a correct pose in a changed place.
STRENGTHS = {"ranking": 0.15, "confidence": 0.00025, "overlap": 1.0}
EASY = 0.7  # share of the pairs without a correct mode that are easy: those with the fewest matches ...
EASY_KEPT = 0.25  # ... of which this share is fitted, and stands for the others

MODEL_STRENGTH = 1.0  # of the regressions for models, which have two features and the rank

# Changed places. The weight was chosen by R@P95 and R@P99 in rooms without changes and by the confidence of a
# correct pose in a changed one; the two bounds by hand.
CHANGED_WEIGHT = 0.11  # of a changed pair beside the pair itself
MAX_CHANGED = 0.1  # share of a cloud that is new
CHANGED_NEAR = (0.3, 0.8)  # share of the new points in front of surfaces that is near
CHANGED_SEED = 1
EASY_SEED = 2

# Kinds in which most places have copies. What they say against a confidence, no other kind does: with
# twice their weight, half as many poses above 0.9 are wrong in the one that is left out.
COPIES = ("equal corridors", "equal racks", "generated office", "generated warehouse")
COPIES_WEIGHT = 2.0

PRECISIONS = (80, 95, 99)  # percent, at which recall is reported
CALIBRATION_BINS = 10
REPORTED, SURE = 0.5, 0.9  # confidences: the default threshold, and one of little risk
# Kinds of false positives: a pose this close is nearly correct; one with less rotation than that has
# moved along a wall; all others are in another place that looks alike.
SMALL_ERROR = (5.0, 0.3)  # degrees, metres
MAX_TRANSLATED_DEGREES = 10.0


def blocks(path, size):
    rows = [line.split() for line in path.read_text().splitlines() if line.strip()]
    return {
        tuple(map(int, rows[k][:2])): np.array(rows[k + 1 : k + size], float)
        for k in range(0, len(rows), size)
    }


def errors(truth, information, poses):
    """Redwood's error of each pose, metres."""
    e = np.linalg.inv(truth) @ poses
    q = np.empty((len(poses), 3))
    for k, m in enumerate(e[:, :3, :3]):
        w, v = np.linalg.eigh(
            np.array(
                [
                    [m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0],
                    [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
                    [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], 0],
                    [
                        m[2, 1] - m[1, 2],
                        m[0, 2] - m[2, 0],
                        m[1, 0] - m[0, 1],
                        m[0, 0] + m[1, 1] + m[2, 2],
                    ],
                ]
            )
        )
        q[k] = v[:3, 3] * (1 if v[3, 3] >= 0 else -1)
    x = np.concatenate([e[:, :3, 3], q], 1)
    return np.sqrt(np.maximum(np.einsum("ka,ab,kb->k", x, information, x) / information[0, 0], 0))


def off_by(truth, pose):
    """Degrees and metres between two poses."""
    e = np.linalg.inv(truth) @ pose
    return np.degrees(np.arccos(np.clip((np.trace(e[:3, :3]) - 1) / 2, -1, 1))), np.linalg.norm(
        e[:3, 3]
    )


def columns(evidence):
    """Evidence of modes, as a result's JSON has it, as arrays with a row per mode."""
    return {key: np.array([e[key] for e in evidence], float) for key in evidence[0]}


def rows(evidence, chosen):
    return {key: values[chosen] for key, values in evidence.items()}


def refined_modes(options):
    """How many modes of a pair are refined, by the options of a result's JSON, also of an older gpureg."""
    if "evidence" in options:
        return options["evidence"]["modes"]
    import gpureg

    asked = gpureg.RegistrationOptions(quality=options["quality"])
    asked.tune = options["tune"]
    return library()._refined_modes(asked)


def overlap_factor(overlap, source_points, target_points):
    """Factor on a confidence where few points overlap; arguments: (..., 2), and points of the
    prepared clouds.
    """
    of = np.stack(np.broadcast_arrays(source_points, target_points), -1)
    points = np.rint(np.asarray(overlap) * of).min(-1)
    return library()._confidence_factor(points.astype(np.uint32), of.min(-1).astype(np.uint32))


class Run:
    """Modes of all pairs of a scene, in one array each; `pair` tells the pair of a mode."""

    weight = 1.0
    model = False

    def __init__(self, building, folder, result, label=None, viewpoints="known"):
        folder = pathlib.Path(folder)
        self.building, self.label, self.viewpoints = building, label, viewpoints
        self.name = f"{building}/{folder.name}"
        recorded = json.loads(pathlib.Path(result).read_text())
        pairs = [p for p in recorded["pairs"] if p["j"] - p["i"] >= MIN_SEPARATION]
        if viewpoints == "unknown":
            # A viewpoint that was inferred, perhaps wrongly, gives free space that was not observed.
            pairs = [
                p
                for p in pairs
                if not any(max(m["evidence"]["observed"]) > 0 for m in p.get("modes", []))
            ]
        modes = [p.get("modes", []) for p in pairs]
        if not any(modes):
            sys.exit(f"error: {result}: no pair has a mode with evidence")
        self.refined = refined_modes(recorded["options"])
        self.keys = [(p["i"], p["j"]) for p in pairs]
        self.modes_per_pair = np.array([len(m) for m in modes])
        self.pair = np.repeat(np.arange(len(pairs)), self.modes_per_pair)
        self.evidence = columns([m["evidence"] for of in modes for m in of])
        self.poses = np.array([m["T_ij"] for of in modes for m in of], float).reshape(-1, 4, 4)
        points = {f["number"]: f["points"] for f in recorded["fragments"]}
        i, j = (np.array(side)[self.pair] for side in zip(*self.keys))
        self.factor = overlap_factor(
            self.evidence["overlap"],
            np.vectorize(points.get)(j),
            np.vectorize(points.get)(i),
        )
        self.free_space = bool((self.evidence["observed"] > 0).any())
        self.correct, listed = self.check(folder / "gt_all.log", folder / "gt_all.info")
        self.strict, in_truth = self.check(folder / "gt.log", folder / "gt.info")
        self.listed, self.in_truth = listed, np.array([key in in_truth for key in self.keys])
        trajectory = folder / "poses.txt"
        self.fragments = (
            {k[0]: v for k, v in blocks(trajectory, 5).items()} if trajectory.exists() else {}
        )

    def check(self, log, info):
        """Which modes are correct, and the pairs of the log."""
        truth, information = blocks(log, 5), blocks(info, 7)
        correct = np.zeros(len(self.pair), bool)
        for k, key in enumerate(self.keys):
            if key not in truth:
                continue
            own = self.pair == k
            if own.any():
                correct[own] = errors(truth[key], information[key], self.poses[own]) <= MAX_ERROR
        return correct, set(truth)

    def has(self, model):
        return (self.free_space or not model.free_space) and self.model == model.model

    def features(self, model, regressand, modes=...):
        return library()._confidence_features(rows(self.evidence, modes), *model[:3], regressand)


class ChangedRun(Run):
    """The pairs of a run with new things in one of their clouds, in front of the surfaces of the
    other one, where this has any.
    """

    def __init__(self, run):
        vars(self).update(vars(run))
        self.weight = CHANGED_WEIGHT * run.weight
        random = np.random.default_rng(CHANGED_SEED)
        draws = [
            (random.integers(2), random.uniform(0, MAX_CHANGED), random.uniform(*CHANGED_NEAR))
            for _ in run.keys
        ]
        side, share, near = (np.array(of)[run.pair] for of in zip(*draws))
        self.evidence = changed(run.evidence, side, share, near)


def changed(evidence, side, share, near):
    """Evidence as if that share of the cloud on that side were new; arguments: one per mode."""
    out = {key: values.copy() for key, values in evidence.items()}
    of_side = np.arange(len(side)), side
    for key in (
        "overlap",
        "overlap_any_normal",
        "normal_weighted_overlap",
        "front_violation_near",
        "front_violation_far",
        "behind_surface",
    ):
        out[key][of_side] *= 1 - share
    new = share * evidence["near_surface"][of_side]
    out["front_violation_near"][of_side] += new * near
    out["front_violation_far"][of_side] += new * (1 - near)
    observed = np.where(evidence["observed"][of_side] > 0, share, 0)
    out["free_space_violation"][of_side] *= 1 - observed
    out["free_space_violation"][of_side] += observed
    out["occluded"][of_side] *= 1 - observed
    out["match_support"] *= 1 - share
    return out


def best_modes(run, model, ranking):
    """Features of the best mode of each pair that has one, for the second and third regression;
    which mode it is; its share of the odds of all.
    """
    log_odds = ranking.log_odds(run.features(model, "ranking"))
    own = run.features(model, "confidence")
    rank = library()._confidence_rank_features(log_odds, own, run.modes_per_pair, run.refined)
    if not model.additive:
        names = library()._confidence_feature_names()
        rank = rank * np.isin(names, LINEAR_RANK)
    best, share = [], []
    for modes in np.split(np.arange(len(log_odds)), np.cumsum(run.modes_per_pair)[:-1]):
        if len(modes):
            best.append(modes[log_odds[modes].argmax()])
            share.append(1 / np.exp(log_odds[modes] - log_odds[best[-1]]).sum())
    best = np.array(best)
    return own[best] + rank[best], best, np.array(share)


def fit_additive(runs, model):
    """The three regressions by name."""
    count = collections.Counter(run.building for run in runs)
    runs = [*runs, *map(ChangedRun, runs)]
    weight_of = [
        run.weight / count[run.building] * (COPIES_WEIGHT if run.building in COPIES else 1.0)
        for run in runs
    ]
    x, correct, modes, weight = [], [], [], []
    for run, of_run in zip(runs, weight_of):
        known = np.bincount(run.pair[run.correct], minlength=len(run.keys)) > 0
        x.append(run.features(model, "ranking", known[run.pair]))
        correct.append(run.correct[known[run.pair]])
        modes.append(run.modes_per_pair[known])
        weight.append(np.full(known.sum(), of_run))
    ranking = conditional_logit(*map(np.concatenate, (x, correct, modes, weight)))

    random = np.random.default_rng(EASY_SEED)
    column = library()._confidence_feature_names().index("log_match_inliers")
    x, weight, labels = [], [], {"correct": [], "strict": []}
    for run, of_run in zip(runs, weight_of):
        features, best, _ = best_modes(run, model, ranking)
        known = np.bincount(run.pair[run.correct], minlength=len(run.keys)) > 0
        hopeless = ~known[run.pair[best]]
        matches = features[:, column]
        easy = (
            hopeless & (matches < np.quantile(matches[hopeless], EASY))
            if hopeless.any()
            else hopeless
        )
        kept = ~easy | (random.random(len(best)) < EASY_KEPT)
        x.append(features[kept])
        of_pair = of_run / len(best)
        weight.append(np.where(easy[kept], of_pair / EASY_KEPT, of_pair))
        for label, of in labels.items():
            of.append(getattr(run, label)[best[kept]])
    x, weight = np.concatenate(x), np.concatenate(weight)
    return {
        "ranking": ranking,
        "confidence": monotone(x, np.concatenate(labels["correct"]), weight),
        "overlap": monotone(x, np.concatenate(labels["strict"]), weight),
    }


def fit(runs, beside, model):
    """The three regressions by name; linear ones use the runs beside for the second alone."""
    if model.additive:
        return fit_additive([*runs, *beside], model)
    if not model.model:
        runs, beside = ([*of, *map(ChangedRun, of)] for of in (runs, beside))
    strengths = dict.fromkeys(STRENGTHS, MODEL_STRENGTH) if model.model else STRENGTHS
    x, y, weight = [], [], []
    for run in runs:
        # Pairs without a correct mode do not teach which mode is correct. Without free space so
        # little tells modes apart that their wrong ones help all the same.
        known = np.bincount(run.pair[run.correct], minlength=len(run.keys)) > 0
        chosen = known[run.pair] | (not model.free_space and not model.model)
        x.append(run.features(model, "ranking", chosen))
        y.append(run.correct[chosen])
        weight.append(np.full(chosen.sum(), run.weight))
    regression_of = signed_logistic if model.model else logistic
    ranking = regression_of(*map(np.concatenate, (x, y, weight)), strengths["ranking"])

    def of_best(of, regression, label):
        views = [best_modes(run, model, ranking) for run in of]
        return regression_of(
            np.concatenate([x for x, _, _ in views]),
            np.concatenate([getattr(run, label)[best] for run, (_, best, _) in zip(of, views)]),
            np.concatenate([np.full(len(x), run.weight) for run, (x, _, _) in zip(of, views)]),
            strengths[regression],
        )

    return {
        "ranking": ranking,
        "confidence": of_best(runs + beside, "confidence", "correct"),
        "overlap": of_best(runs, "overlap", "strict"),
    }


def confidences(run, model, regressions):
    """Of the best mode of each pair that has one: its index, confidence and overlap confidence."""
    x, best, share = best_modes(run, model, regressions["ranking"])
    correct, overlapping = (
        1 / (1 + np.exp(-regressions[name].log_odds(x))) for name in ("confidence", "overlap")
    )
    correct = np.minimum(correct, share) * run.factor[best]
    return best, correct, np.minimum(overlapping, correct)


def figures(run, model, regressions):
    best, found_confidence, found_overlapping = confidences(run, model, regressions)
    pairs = len(run.keys)
    confidence, overlapping = np.zeros(pairs), np.zeros(pairs)
    correct, strict = np.zeros(pairs, bool), np.zeros(pairs, bool)
    of = run.pair[best]
    confidence[of], overlapping[of] = found_confidence, found_overlapping
    correct[of], strict[of] = run.correct[best], run.strict[best]
    total = int(run.in_truth.sum())
    among_modes = np.bincount(run.pair[run.strict], minlength=pairs) > 0
    out = {
        "pairs": pairs,
        "ground_truth": total,
        "generated": 100 * among_modes[run.in_truth].mean(),
        "raw": 100 * strict.sum() / total,
    }
    for name, good, score in (("geo", correct, confidence), ("strict", strict, overlapping)):
        order = np.argsort(-score, kind="stable")
        recall = np.cumsum(strict[order]) / total
        precision = np.cumsum(good[order]) / np.arange(1, len(order) + 1)
        for at in PRECISIONS:
            out[f"{name}_R@P{at}"] = 100 * max(
                [r for r, p in zip(recall, precision) if p >= at / 100], default=0
            )
        out[f"{name}_AP"] = 100 * (precision * strict[order]).sum() / total
    bins = np.minimum((confidence * CALIBRATION_BINS).astype(int), CALIBRATION_BINS - 1)
    out["ECE"] = sum(
        (bins == b).mean() * abs(confidence[bins == b].mean() - correct[bins == b].mean())
        for b in range(CALIBRATION_BINS)
        if (bins == b).any()
    )
    sure = confidence > SURE
    out["right_above_0.9"] = 100 * correct[sure].mean() if sure.any() else None
    reported = confidence >= REPORTED
    out |= {
        "above_0.9": int(sure.sum()),
        "right_above_0.9_count": int(correct[sure].sum()),
        "right": int(correct.sum()),
        "from_0.5": int(reported.sum()),
        "right_from_0.5": int(correct[reported].sum()),
    }
    if run.fragments:
        out["above_half"] = kinds_of_false_positives(run, best, found_confidence)
    return out


def kinds_of_false_positives(run, best, confidence):
    """Of the reports with a confidence above one half that are wrong by the 0.2 m rule: how many
    there are of each kind.
    """
    out = {
        "reports": int((confidence > REPORTED).sum()),
        "little_overlap": 0,
        "small_error": 0,
        "translated": 0,
        "alias": 0,
    }
    for mode in best[(confidence > REPORTED) & ~run.correct[best]]:
        i, j = run.keys[run.pair[mode]]
        degrees, metres = off_by(
            np.linalg.inv(run.fragments[i]) @ run.fragments[j], run.poses[mode]
        )
        if degrees < SMALL_ERROR[0] and metres < SMALL_ERROR[1]:
            # Of pairs that overlap too little for gt_all even a correct pose counts as wrong.
            kind = "small_error" if (i, j) in run.listed else "little_overlap"
        else:
            kind = "translated" if degrees < MAX_TRANSLATED_DEGREES else "alias"
        out[kind] += 1
    return out


def text_of(figures):
    def value(key, v):
        return f"{v:.3f}" if key == "ECE" else f"{v:.1f}" if isinstance(v, float) else f"{v}"

    return " ".join(f"{key} {value(key, v)}" for key, v in figures.items())


def parallel(work, arguments):
    """work(*of) for each of the arguments, in order, by as many processes as there are processors. They inherit what
    `work` refers to, which is not copied.
    """
    global _work
    _work = work
    with multiprocessing.get_context("fork").Pool() as pool:
        return pool.map(_call, arguments, chunksize=1)


def _call(arguments):
    return _work(*arguments)


def test_and_fit(runs, beside, others):
    """Figures of all runs by fits on other buildings, and the models of the fit on all of them."""

    def allowed(of, model, building=None):
        # The overlap alone tells other things in bare generated rooms than elsewhere.
        if of is beside and model.overlap_alone:
            return []
        return [run for run in of if run.has(model) and run.building != building]

    def fit_without(name, building):
        model = MODELS[name]
        if not allowed(runs, model, building):
            return None
        return fit(allowed(runs, model, building), allowed(beside, model, building), model)

    names = [name for name, model in MODELS.items() if not model.model]  # see fit_models.py
    buildings = [*dict.fromkeys(run.building for run in [*runs, *beside, *others]), None]
    keys = list(itertools.product(names, buildings))
    fits = dict(zip(keys, parallel(fit_without, keys)))
    tested = []
    for name in names:
        model = MODELS[name]
        for run in [*runs, *beside, *others]:
            # Models without free space are tested where there is none. Those without sides of
            # surfaces are tested everywhere, which shows the gain of the sides.
            left_out = fits[name, run.building]
            if not left_out or not run.has(model) or (not model.free_space and run.free_space):
                continue
            out = {
                "kind": run.building,
                "scene": run.name,
                **({"label": run.label} if run.label else {}),
                "viewpoints": run.viewpoints,
                "model": name,
                **figures(run, model, left_out),
            }
            tested.append(out)
            print(text_of(out), flush=True)
    return tested, {name: fits[name, None] for name in names if fits[name, None]}


def parse_run(text, viewpoints="known"):
    building, folder, result, *label = text.split("=")
    return Run(building, folder, result, label[0] if label else None, viewpoints)


def main():
    parser = plain_parser(__doc__)
    parser.add_argument("runs", nargs="+", metavar="RUN", help="BUILDING=SCENE_FOLDER=RESULT.json")
    for name, meta, text in (
        ("--beside", "RUN=LABEL", "the second regression alone is fitted to them"),
        ("--others", "RUN=LABEL", "tested only"),
        ("--origin", "RUN", "tested only: the origin was the only viewpoint"),
        ("--unknown", "RUN", "tested only: no viewpoint was known"),
    ):
        parser.add_argument(name, nargs="+", default=[], metavar=meta, help=text)
    parser.add_argument("--header", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    arguments = parser.parse_args()
    tested, models = test_and_fit(
        [parse_run(text) for text in arguments.runs],
        [parse_run(text) for text in arguments.beside],
        [parse_run(text) for text in arguments.others]
        + [parse_run(text, "origin") for text in arguments.origin]
        + [parse_run(text, "unknown") for text in arguments.unknown],
    )
    if arguments.header:
        write_header(arguments.header, models)
    if arguments.output:
        save(arguments.output, {"runs": tested})


if __name__ == "__main__":
    main()
