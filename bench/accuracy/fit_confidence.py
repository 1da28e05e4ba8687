#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fits the confidence of a pose to its evidence, and says how far it can be trusted in buildings
that the fit did not see.

A run is BUILDING=SCENE_FOLDER=RESULT.json: what `gpureg batch --preset default --json` wrote for a
scene whose folder has gt.log, gt.info, gt_all.log and gt_all.info (right: Redwood's 0.2 m rule
against gt_all). Every run is tested with a fit on the other buildings; then all of them together
give the coefficients that are written into the library.

Three logistic regressions: the first ranks the modes of a pair by their own evidence, the second
judges the best of them, and also sees its margin over the best distinct rival and how many modes
there are, and no pose gets more than its share of the odds of all, as at most one is right; the
third says, from the same, whether the pose is right and the clouds overlap by 30 % or more (in
gt.log), which is what Redwood's strict protocol counts. Each exists four times: with and without
free space, which clouds without known viewpoints do not tell, and with and without the surface_sides of
surfaces, which prepare.surface_side_distance = 0 leaves out.

Buildings are few, and these were all seen by one kind of sensor. So the second regression also
learns from runs that only serve to widen it (--beside): the same scenes as other sensors would have
seen them (other_sensor.py) or with other voxels, and generated buildings (`gpureg generate`), which
are full of twins. They are left out with their building, too, and do not say which mode is right.

Nothing moves in these scenes. So that a chair that was moved does not cost a pose its confidence,
every pair is fitted a second time, with little weight, as it would look if up to a tenth of one of
its clouds were new.

usage: fit_confidence.py RUN... [--beside RUN=LABEL...] [--others RUN=LABEL...] [--origin RUN...]
[--unknown RUN...]
                         [--header src/confidence/confidence_model.hpp] [-o bench/results/confidence.json]
--others: tested, and nothing is fitted to them. LABEL: what they are.
--origin, --unknown: runs of the same scenes whose clouds came with the origin as their only
viewpoint, or with none; they are tested, and nothing is fitted to them. Where a scene has poses.txt
(fragment number, world_from_fragment), it is also told what kind of poses the wrong reports are.
Needs numpy and scikit-learn."""

import argparse
import copy
import json
import pathlib

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
# What a model may look at beside the overlap: free space, surface_sides of surfaces.
MODELS = {
    "everything": (True, True),
    "surface_sides": (False, True),
    "free_space": (True, False),
    "neither": (False, False),
}


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


# Real rooms are full of things that one cloud saw and the other did not look at: where free space
# is known, up to the second sum of both clouds' shares in front of surfaces speaks of which of a
# pair's poses is the better one, and only through that of whether it is right.
MIN_FRONT_VIOLATION, MIN_VERIFIED_FRONT_VIOLATION = 1e-3, 2e-2
FRONT_VIOLATION_NEAR = (
    8 + 9
    # its place among the measures of a model that looks at both: after the overlap's and those of free
    # space
)


def measures(evidence, free_space, surface_sides):
    """What the model sees of one mode; the library computes the same (src/confidence/confidence.cpp)."""
    log = lambda value, least: np.log(max(value, least))  # noqa: E731
    overlap, balanced = evidence["overlap"], evidence["normal_weighted_overlap"]
    information_eigenvalues = evidence["information_eigenvalues"]
    out = [
        log(evidence["match_support"], 1e-5),
        log(evidence["match_inliers"], 1),
        log(min(balanced), 1e-3),
        log(max(balanced), 1e-3),
        log(min(overlap), 1e-3),
        log(information_eigenvalues[0], 1e-2),
        log(information_eigenvalues[1], 1e-2),
        sum(np.log1p(s) for s in information_eigenvalues),
    ]
    if free_space:
        seen, impossible, hidden = evidence["seen"], evidence["impossible"], evidence["hidden"]
        known = [k for k in (0, 1) if seen[k] > 0] or [0]
        seen, impossible, hidden = ([v[k] for k in known] for v in (seen, impossible, hidden))
        of_all = [s * i for s, i in zip(seen, impossible)]
        out += [
            min(seen),
            max(seen),
            max(of_all),
            min(of_all),
            max(impossible),
            min(impossible),
            log(max(impossible), 3e-3),
            min(hidden),
            log(sum(of_all) * (2 / len(of_all)), 1e-3),
        ]
    if surface_sides:
        reach, around, back = evidence["reach"], evidence["around"], evidence["behind_surface"]
        alike = [o / max(r, 1e-6) for o, r in zip(overlap, reach)]
        out += [
            log(sum(evidence["front_violation_near"]), MIN_FRONT_VIOLATION),
            min(alike),
            max(alike),
            max(around),
            min(around),
        ]
        # Where free space is known it says the rest; without, how much is in front or behind beside
        # what touches.
        if not free_space:
            out.append(log(sum(evidence["front_violation_far"]), MIN_FRONT_VIOLATION))
            in_front = [
                n + f
                for n, f in zip(evidence["front_violation_near"], evidence["front_violation_far"])
            ]

            def beside(shares):
                return [s / max(s + r, 1e-6) for s, r in zip(shares, reach)]

            out += [
                max(beside(in_front)),
                min(beside(in_front)),
                log(sum(back), 1e-3),
                max(beside(back)),
                min(beside(back)),
            ]
    return out


FEW, SMALL_CLOUD = 80, 1500  # points that touch, of how many


def with_so_few_points(evidence, points):
    """What is left of a confidence where hardly any points touch (src/confidence/confidence.cpp). points:
    of the prepared clouds, source and target.
    """
    touching = min(share * of for share, of in zip(evidence["overlap"], points))
    return 1 - np.exp(-((touching / FEW * max(1, min(points) / SMALL_CLOUD)) ** 2))


def has_free_space(evidence):
    return max(evidence["seen"]) > 0


def has_surface_sides(evidence):
    return min(evidence["around"]) > 0


class Run:
    weight = 1.0

    def __init__(self, text, viewpoints="known"):
        self.viewpoints = viewpoints
        self.building, folder, result, *label = text.split("=")
        self.label = {"label": label[0]} if label else {}
        folder = pathlib.Path(folder)
        self.name = self.building + "/" + folder.name
        truth, information = blocks(folder / "gt_all.log", 5), blocks(folder / "gt_all.info", 7)
        strict, strict_information = blocks(folder / "gt.log", 5), blocks(folder / "gt.info", 7)
        recorded = json.loads(pathlib.Path(result).read_text())
        pairs = [p for p in recorded["pairs"] if p["j"] - p["i"] > 1]
        self.refined = recorded["options"]["evidence"]["modes"]
        self.in_truth = np.array([(p["i"], p["j"]) in strict for p in pairs])
        self.keys, self.listed = [(p["i"], p["j"]) for p in pairs], set(truth)
        trajectory = folder / "poses.txt"
        self.fragments = (
            {k[0]: v for k, v in blocks(trajectory, 5).items()} if trajectory.exists() else {}
        )
        self.modes = [p.get("modes", []) for p in pairs]
        points = {f["number"]: f["points"] for f in recorded["fragments"]}
        self.few = [
            np.array(
                [with_so_few_points(m["evidence"], (points[p["j"]], points[p["i"]])) for m in modes]
            )
            for p, modes in zip(pairs, self.modes)
        ]
        self.free = any(m and has_free_space(m[0]["evidence"]) for m in self.modes)
        self.right, self.strict = [], []
        for p, modes in zip(pairs, self.modes):
            key = (p["i"], p["j"])
            poses = np.array([m["T_ij"] for m in modes], float).reshape(-1, 4, 4)
            wrong = np.full(len(modes), 9.0)
            self.right.append(
                (
                    errors(truth[key], information[key], poses)
                    if key in truth and len(modes)
                    else wrong
                )
                <= 0.2
            )
            self.strict.append(
                (
                    errors(strict[key], strict_information[key], poses)
                    if key in strict and len(modes)
                    else wrong
                )
                <= 0.2
            )
        self.x = {
            model: [
                np.array([measures(m["evidence"], *model) for m in modes]) for modes in self.modes
            ]
            for model in MODELS.values()
            if self.free or not model[0]
        }


CHANGED_WEIGHT, MOST_CHANGED = 0.11, 0.1


class ChangedRun:
    """The pairs of a run, with things in one of their clouds that the other did not see: in front
    of its surfaces, as far as it is around.
    """

    weight = CHANGED_WEIGHT

    def __init__(self, run):
        random = np.random.default_rng(1)
        modes = []
        for pair in run.modes:
            side, share, near = (
                random.integers(2),
                random.uniform(0, MOST_CHANGED),
                random.uniform(0.3, 0.8),
            )
            modes.append([{"evidence": changed(m["evidence"], side, share, near)} for m in pair])
        self.right, self.strict, self.refined = run.right, run.strict, run.refined
        self.x = {
            model: [np.array([measures(m["evidence"], *model) for m in ms]) for ms in modes]
            for model in run.x
        }


def changed(evidence, side, share, near):
    out = copy.deepcopy(evidence)
    for key in (
        "overlap",
        "reach",
        "normal_weighted_overlap",
        "front_violation_near",
        "front_violation_far",
        "behind_surface",
    ):
        out[key][side] *= 1 - share
    out["front_violation_near"][side] += share * evidence["around"][side] * near
    out["front_violation_far"][side] += share * evidence["around"][side] * (1 - near)
    if evidence["seen"][side] > 0:
        out["impossible"][side] = evidence["impossible"][side] * (1 - share) + share
        out["hidden"][side] *= 1 - share
    out["match_support"] *= 1 - share
    return out


class Logistic:
    """Logistic regression on standardised measures, written as weights of the measures themselves.

    strength: inverse of the L2 penalty. What few buildings leave undetermined a strong penalty
    shares out among alike measures, which orders the poses of other buildings better; but it also
    draws all odds together, so slope and intercept are then fitted anew."""

    def __init__(self, x, y, weight, strength):
        from sklearn.linear_model import LogisticRegression  # what only applies a fit needs none

        mean, scale = x.mean(0), np.maximum(x.std(0), 1e-9)
        fit = LogisticRegression(C=strength, max_iter=5000).fit((x - mean) / scale, y, weight)
        self.weights = fit.coef_[0] / scale
        self.bias = float(fit.intercept_[0] - (self.weights * mean).sum())
        again = LogisticRegression(C=1e6, max_iter=5000).fit(self.logit(x)[:, None], y, weight)
        slope = float(again.coef_[0, 0])
        self.weights, self.bias = (
            slope * self.weights,
            slope * self.bias + float(again.intercept_[0]),
        )

    def logit(self, x):
        return x @ self.weights + self.bias


def judged(x, model):
    """Of the measures by which a mode is ranked, those by which the best one is judged."""
    x = x.copy()
    if all(model):
        x[FRONT_VIOLATION_NEAR] = max(x[FRONT_VIOLATION_NEAR], np.log(MIN_VERIFIED_FRONT_VIOLATION))
    return x


def second_view(run, model, first):
    """Measures of the best mode of each pair, its logit, its margin over the best rival, and how
    many modes there are of those that were refined (many poses that end in one place agree; where
    little holds them, each ends in its own); which mode it is; its share."""
    rows, best, share = [], [], []
    for x in run.x[model]:
        if not len(x):
            best.append(-1)
            continue
        own = first.logit(x)
        k = int(own.argmax())
        share.append(1 / np.exp(own - own[k]).sum())
        logits = np.clip(own, -14, 14)
        rival = max([v for i, v in enumerate(logits) if i != k], default=-14.0)
        rows.append(np.r_[judged(x[k], model), logits[k], logits[k] - rival, len(x) / run.refined])
        best.append(k)
    return np.array(rows), best, np.array(share)


RANKING, CONFIDENCE, OVERLAP = 0.15, 0.00025, 1.0  # strengths


def fit(runs, beside, model):
    """The three regressions from the runs; the second from those beside them, too."""
    runs, beside = ([*of, *(run.changed for run in of)] for of in (runs, beside))
    # Of pairs without a right mode there is nothing to learn about which mode is right. Without
    # free space so little tells modes apart that their wrong ones help all the same.
    ranked = [
        (x, right, np.full(len(x), run.weight))
        for run in runs
        for x, right in zip(run.x[model], run.right)
        if len(x) and (not model[0] or np.any(right))
    ]
    x, y, weight = (np.concatenate([np.asarray(row[k]) for row in ranked]) for k in range(3))
    first = Logistic(x, y, weight, RANKING)

    def second(of, kind, strength):
        views = [second_view(run, model, first) for run in of]
        y = [
            [getattr(run, kind)[k][b] for k, b in enumerate(view[1]) if b >= 0]
            for run, view in zip(of, views)
        ]
        weight = [np.full(len(view[0]), run.weight) for run, view in zip(of, views)]
        return Logistic(
            np.concatenate([view[0] for view in views]),
            np.concatenate(y),
            np.concatenate(weight),
            strength,
        )

    return first, second(runs + beside, "right", CONFIDENCE), second(runs, "strict", OVERLAP)


def figures(run, model, models):
    x, best, share = second_view(run, model, models[0])
    confidence = np.zeros(len(best))
    overlapping = np.zeros(len(best))
    found = np.array([b >= 0 for b in best])
    confidence[found] = np.minimum(1 / (1 + np.exp(-models[1].logit(x))), share) * [
        run.few[k][b] for k, b in enumerate(best) if b >= 0
    ]
    overlapping[found] = np.minimum(1 / (1 + np.exp(-models[2].logit(x))), confidence[found])
    right = np.array([b >= 0 and bool(run.right[k][b]) for k, b in enumerate(best)])
    strict = np.array([b >= 0 and bool(run.strict[k][b]) for k, b in enumerate(best)])
    total = int(run.in_truth.sum())
    out = {
        "pairs": len(best),
        "ground_truth": total,
        "generated": 100 * np.mean([v.any() for v, t in zip(run.strict, run.in_truth) if t]),
        "raw": 100 * strict.sum() / total,
    }
    for name, good, score in (("geo", right, confidence), ("strict", strict, overlapping)):
        order = np.argsort(-score, kind="stable")
        recall = np.cumsum(strict[order]) / total
        precision = np.cumsum(good[order]) / np.arange(1, len(order) + 1)
        for at in (80, 95, 99):
            out[f"{name}_R@P{at}"] = 100 * max(
                [r for r, p in zip(recall, precision) if p >= at / 100], default=0
            )
        out[f"{name}_AP"] = 100 * (precision * strict[order]).sum() / total
    bins = np.minimum((confidence * 10).astype(int), 9)
    out["ECE"] = sum(
        (bins == b).mean() * abs(confidence[bins == b].mean() - right[bins == b].mean())
        for b in range(10)
        if (bins == b).any()
    )
    sure = confidence > 0.9
    out["right_above_0.9"] = 100 * right[sure].mean() if sure.any() else None
    if run.fragments:
        out["above_half"] = kinds_of_mistakes(run, best, confidence, right)
    return out


def kinds_of_mistakes(run, best, confidence, right):
    """Of the reports with a confidence above one half that the 0.2 m rule calls wrong: how many
    there are of each kind.
    """
    out = {
        "reports": int((confidence > 0.5).sum()),
        "unlisted": 0,
        "near": 0,
        "slid": 0,
        "turned": 0,
    }
    for k in np.flatnonzero((confidence > 0.5) & ~right):
        i, j = run.keys[k]
        degrees, metres = off_by(
            np.linalg.inv(run.fragments[i]) @ run.fragments[j],
            np.array(run.modes[k][best[k]]["T_ij"], float).reshape(4, 4),
        )
        # Right by the trajectories, though the clouds share too little for gt_all; a little off;
        # along a wall; in a place that looks alike.
        kind = (
            ("near" if (i, j) in run.listed else "unlisted")
            if degrees < 5 and metres < 0.3
            else "slid"
            if degrees < 10
            else "turned"
        )
        out[kind] += 1
    return out


def header(models):
    # Names as the library's confidence.cpp reads them.
    lines = [
        "// SPDX-License-Identifier: BSD-3-Clause",
        "// Written by bench/accuracy/fit_confidence.py; docs/accuracy.md says how well it does.",
        "#pragma once",
        "",
        "namespace gpureg::confidence_model {",
        "",
        "struct Regression {",
        "  const double* weights;",
        "  double bias;",
        "};",
        "",
        "struct Model {",
        "  Regression ranking, confidence, overlap;",
        "};",
        "",
    ]
    stages = ("ranking", "confidence", "overlap")
    for name, regressions in zip(MODELS, models):
        for stage, regression in zip(stages, regressions):
            lines.append(
                f"constexpr double {name}_{stage}[] = {{{', '.join(f'{w:.9g}' for w in regression.weights)}}};"
            )
        of = ", ".join(
            f"{{{name}_{stage}, {regression.bias:.9g}}}"
            for stage, regression in zip(stages, regressions)
        )
        lines += [f"constexpr Model {name}{{{of}}};", ""]
    return "\n".join(lines + ["}  // namespace gpureg::confidence_model", ""])


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("runs", nargs="+", metavar="RUN", help="BUILDING=SCENE_FOLDER=RESULT.json")
    parser.add_argument(
        "--beside",
        nargs="+",
        default=[],
        metavar="RUN=LABEL",
        help="fitted to by the second regression alone: other sensors, other buildings",
    )
    parser.add_argument("--others", nargs="+", default=[], metavar="RUN=LABEL", help="tested only")
    parser.add_argument(
        "--origin",
        nargs="+",
        default=[],
        metavar="RUN",
        help="tested only: the origin was the only viewpoint",
    )
    parser.add_argument(
        "--unknown",
        nargs="+",
        default=[],
        metavar="RUN",
        help="tested only: no viewpoint was known",
    )
    parser.add_argument("--header", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    arguments = parser.parse_args()
    runs = [Run(text) for text in arguments.runs]
    beside = [Run(text) for text in arguments.beside]
    for run in runs + beside:
        run.changed = ChangedRun(run)
    tests = runs + beside + [Run(text) for text in arguments.others]
    tests += [Run(text, "origin") for text in arguments.origin] + [
        Run(text, "unknown") for text in arguments.unknown
    ]
    record = {"runs": []}

    def allowed(of, model, building=None):
        # Who knows neither free space nor surface_sides has the overlap alone, and what that tells in bare
        # generated rooms it tells nowhere else.
        if of is beside and not any(model):
            return []
        return [run for run in of if model in run.x and run.building != building]

    for name, model in MODELS.items():
        fits = {}
        for run in tests:
            others = allowed(runs, model, run.building)
            # Those without free space are tested where there is none; those without surface_sides on all,
            # to tell what surface_sides give.
            if not others or model not in run.x or (not model[0] and run.free):
                continue
            if run.building not in fits:
                fits[run.building] = fit(others, allowed(beside, model, run.building), model)
            out = {
                "scene": run.name,
                **run.label,
                "viewpoints": run.viewpoints,
                "model": name,
                **figures(run, model, fits[run.building]),
            }
            record["runs"].append(out)
            print(
                " ".join(
                    f"{k} {v:.3f}"
                    if k == "ECE"
                    else f"{k} {v:.1f}"
                    if isinstance(v, float)
                    else f"{k} {v}"
                    for k, v in out.items()
                )
            )
    models = [fit(allowed(runs, model), allowed(beside, model), model) for model in MODELS.values()]
    if arguments.header:
        arguments.header.write_text(header(models))
    if arguments.output:
        arguments.output.write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
