# SPDX-License-Identifier: BSD-3-Clause
"""Fits the confidence of the places of a scan in a map, and tests it on buildings that it did not see.

    python3 bench/localization/fit_places.py bench/results/places.json [--write]

A row is a scan with the places that the plan of a map proposes, or those that its tiles propose, after their
refinement. Columns of a place: whether it is correct, and the evidence that src/localization/place_confidence.cpp reads.
Maps are posed scans, or one cloud without viewpoints; scans are of the building, or of another one, which are not
there. Exactly one place of a row or none is correct: the fit maximises the likelihood of that, kinds of buildings
count alike, and more evidence never speaks against a place. A table tells what a fit on the other kinds says of each.
--write: src/localization/place_confidence_model.hpp gets the fit on all. Needs numpy and scipy.
"""

from __future__ import annotations

import argparse
import json
import pathlib
from typing import Any

import numpy as np
from scipy.optimize import minimize

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADER = ROOT / "src/localization/place_confidence_model.hpp"
NAMES = (
    "nothing_uncovered",
    "no_map_in_free_space",
    "no_scan_in_free_space",
    "no_map_in_front",
    "no_scan_in_front",
    "no_scan_behind",
    "no_scan_far_in_front",
    "log_weighted_overlap",
    "search_log_odds",
    "pair_log_odds",
    "log_match_inliers",
    "lead",
)
OF_TILES = ("pair_log_odds", "log_match_inliers")
RIDGE, NO_RIVAL, MOST_LEAD = 1e-3, -8.0, 8.0
FOUND, SURE = 0.75, 0.9


def features(columns: list[str], places: np.ndarray) -> np.ndarray:
    """As place_confidence.cpp, without the lead."""

    def column(name: str) -> np.ndarray:
        return places[:, columns.index(name)]

    def no(share: np.ndarray, least: float) -> np.ndarray:
        return -np.log(np.maximum(share, least))

    def logit(confidence: np.ndarray, least: float) -> np.ndarray:
        c = np.clip(confidence, least, 1 - least)
        return np.log(c / (1 - c))

    in_free_space = np.where(column("map observed") > 0, column("map in free space"), 0.02)
    return np.stack(
        [
            no(1 - column("covered"), 0.01),
            no(in_free_space, 0.002),
            no(column("scan in free space"), 0.002),
            no(column("map in front"), 0.003),
            no(column("scan in front"), 0.003),
            no(column("scan behind"), 0.003),
            no(column("scan far in front"), 0.003),
            -no(column("weighted overlap"), 0.02),
            logit(column("search"), 1e-4),
            logit(column("pair"), 1e-3),
            np.log1p(column("match inliers")),
        ],
        1,
    )


class Rows:
    """Places of all rows, one after the other."""

    def __init__(self, columns: list[str], rows: list[dict[str, Any]], planned: bool) -> None:
        self.count = len(rows)
        self.row = np.repeat(np.arange(len(rows)), [len(r["places"]) for r in rows])
        places = np.array([p for r in rows for p in r["places"]])
        self.right = places[:, 0] > 0
        self.x = features(columns, places)
        if planned:
            self.x[:, [NAMES.index(name) for name in OF_TILES]] = 0
        self.kinds = sorted({r["kind"] for r in rows})
        self.kind = np.array([self.kinds.index(r["kind"]) for r in rows])
        self.here = np.array([r["here"] for r in rows])
        self.weight = 1 / np.bincount(self.kind)[self.kind]

    def shares(self, z: np.ndarray) -> np.ndarray:
        """Probability of each place, where that of none has the odds 1."""
        most = np.zeros(self.count)
        np.maximum.at(most, self.row, z)
        odds = np.exp(z - most[self.row])
        return odds / (np.exp(-most) + np.bincount(self.row, odds, self.count))[self.row]

    def lead(self, z: np.ndarray) -> np.ndarray:
        z = np.maximum(z, NO_RIVAL)
        order = np.lexsort((-z, self.row))
        first = np.r_[True, np.diff(self.row[order]) > 0]
        best = np.full(self.count, NO_RIVAL)
        second = np.full(self.count, NO_RIVAL)
        best[self.row[order[first]]] = z[order[first]]
        at_second = np.r_[False, first[:-1]] & ~first
        second[self.row[order[at_second]]] = z[order[at_second]]
        leads = np.zeros(len(z), bool)
        leads[order[first]] = True
        rival = np.where(leads, second[self.row], best[self.row])
        return np.clip(z - rival, -MOST_LEAD, MOST_LEAD)

    def fit(self, x: np.ndarray, used: np.ndarray) -> np.ndarray:
        """Weights, none negative, and the bias, of the used rows."""
        take, scale = used[self.row], x.std(0) + 1e-9
        weight = np.where(used, self.weight, 0) / self.weight[used].sum()

        def loss(b: np.ndarray) -> tuple[float, np.ndarray]:
            z = x / scale @ b[:-1] + b[-1]
            share = self.shares(z)
            right = self.right & take
            none = np.ones(self.count)
            np.add.at(none, self.row, -share)
            has = np.bincount(self.row, self.right, self.count) > 0
            likelihood = np.log(np.maximum(none, 1e-300)) @ (weight * ~has)
            likelihood += weight[self.row[right]] @ np.log(np.maximum(share[right], 1e-300))
            g = weight[self.row] * (self.right - share)
            gradient = -np.r_[x.T @ g / scale, g.sum()]
            return -likelihood + RIDGE * b[:-1] @ b[:-1], gradient + 2 * RIDGE * np.r_[b[:-1], 0]

        bounds = [(0, None)] * x.shape[1] + [(None, None)]
        b = minimize(loss, np.zeros(x.shape[1] + 1), jac=True, method="L-BFGS-B", bounds=bounds).x
        return np.r_[b[:-1] / scale, b[-1]]

    def fits(self, used: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """By its own evidence, among the others, and the features of the latter."""
        own = self.fit(self.x, used)
        x = np.c_[self.x, self.lead(self.x @ own[:-1] + own[-1])]
        return own, self.fit(x, used), x


def report(name: str, confidence: np.ndarray, right: np.ndarray, here: np.ndarray) -> None:
    found, sure = confidence >= FOUND, confidence > SURE
    bins = np.minimum((confidence * 10).astype(int), 9)
    error = sum(abs((confidence - right)[bins == b].sum()) for b in range(10)) / len(right)
    print(
        f"| {name} | {here.sum()} | {(found & right).sum()} | {(found & ~right).sum()} "
        f"| {(found & ~here).sum()} of {(~here).sum()} | {(sure & right).sum()} of {sure.sum()} | {error:.3f} |"
    )


def test(rows: Rows) -> None:
    print(
        "| not in the fit | scans | found | wrong | foreign found | right above 0.9 | ECE |\n"
        "| --- | --- | --- | --- | --- | --- | --- |"
    )
    every = []
    for kind, name in enumerate(rows.kinds):
        _, among, x = rows.fits(rows.kind != kind)
        share = rows.shares(x @ among[:-1] + among[-1])
        best = np.zeros(rows.count)
        np.maximum.at(best, rows.row, share)
        right = np.bincount(rows.row, rows.right & (share == best[rows.row]), rows.count) > 0
        of = rows.kind == kind
        every.append((best[of], right[of], rows.here[of]))
        report(name, *every[-1])
    report("all", *map(np.concatenate, zip(*every)))


def model_text(name: str, own: np.ndarray, among: np.ndarray) -> str:
    def regression(b: np.ndarray) -> str:
        return "{{" + ", ".join(f"{v:.4g}" for v in b[:-1]) + f"}}, {b[-1]:.4g}}}"

    return f"constexpr PlaceModel {name}{{{regression(np.insert(own, -1, 0))},\n{regression(among)}}};\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("record", type=pathlib.Path)
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    record = json.loads(arguments.record.read_text())
    text = """// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/place_confidence.hpp"

// Written by bench/localization/fit_places.py.
namespace gpureg::localization {

/// Weights in the order of PlaceFeature.
struct PlaceRegression {
  std::array<double, kPlaceFeatures> weights;
  double bias;
};

struct PlaceModel {
  PlaceRegression own;    ///< of a place alone: what rivals are measured by
  PlaceRegression among;  ///< of a place in view of the others
};

"""
    for name, planned in (("kPlanned", True), ("kOfTiles", False)):
        rows = Rows(
            record["columns"], [r for r in record["rows"] if r["planned"] == planned], planned
        )
        print(f"\n{name}")
        test(rows)
        own, among, _ = rows.fits(np.ones(rows.count, bool))
        text += model_text(name, own, among)
    if arguments.write:
        HEADER.write_text(text + "\n}  // namespace gpureg::localization\n")


if __name__ == "__main__":
    main()
