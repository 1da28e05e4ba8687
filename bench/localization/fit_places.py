# SPDX-License-Identifier: BSD-3-Clause
"""Fits the confidence of places of a scan in a map to surfaces, and tests it on places that it did not see.

    python3 bench/localization/fit_places.py bench/results/planned_places.json

A row is a scan, with the places that the plan of a map proposes (src/localization/plan) after their refinement:
whether the place is correct, the part of the scan without a surface of the map, the part of the map in free
space of the scan, the part of both in front of surfaces of the other, and the confidence of the search. Domains
count alike in the fit. The rows were printed by verify_planned() in a build with that line added; scans and maps are
those of city.py, bench/accuracy/locate.py and locate_sweeps.py with other seeds. Each is tested with a fit on the others; a fit on all gives the constants of
src/localization/verify_places.cpp.
"""

from __future__ import annotations

import json
import pathlib
import sys
from typing import Any

import numpy as np
from scipy.optimize import minimize

LEAST = np.array([0.01, 0.002, 0.004])  # uncovered, free space, front
LEAST_SEARCH, RIDGE = 1e-4, 5e-4


def design(rows: list[dict[str, Any]]) -> tuple[np.ndarray, np.ndarray]:
    """Features of all places, and whether they are correct."""
    places = np.array([place for row in rows for place in row["places"]])
    logs = np.log(np.maximum(places[:, 1:4], LEAST))
    search = np.clip(places[:, 4], LEAST_SEARCH, 1 - LEAST_SEARCH)
    x = np.c_[logs, np.log(search / (1 - search)), np.ones(len(places))]
    return x, places[:, 0] > 0


def fit(rows: list[dict[str, Any]]) -> np.ndarray:
    x, right = design(rows)
    domains = [row["domain"] for row in rows for _ in row["places"]]
    weights = np.array([1 / domains.count(d) for d in domains]) * len(x) / len(set(domains))
    scale = x.std(0)
    scale[-1] = 1

    def loss(b: np.ndarray) -> tuple[float, np.ndarray]:
        z = x / scale @ b
        residual = weights * (1 / (1 + np.exp(-z)) - right)
        ridge = RIDGE * len(x) * np.r_[b[:-1], 0]
        value = (weights * np.logaddexp(0, np.where(right, -z, z))).sum() + ridge @ b
        return value, x.T @ residual / scale + 2 * ridge

    return minimize(loss, np.zeros(x.shape[1]), jac=True, method="L-BFGS-B").x / scale


def report(name: str, rows: list[dict[str, Any]], b: np.ndarray) -> None:
    found = {
        True: [0, 0, 0],
        False: [0, 0, 0],
    }  # of scans that are there, or not: all, right, wrong
    for row in rows:
        x, right = design([row])
        best = int(np.argmax(x @ b))
        counts = found[row["here"]]
        counts[0] += 1
        if (x @ b)[best] >= 0:
            counts[1 if right[best] else 2] += 1
    (here, good, wrong), (away, _, foreign) = found[True], found[False]
    print(f"| {name} | {here} | {good} | {wrong} | {foreign} of {away} |")


def main() -> None:
    rows = json.loads(pathlib.Path(sys.argv[1]).read_text())["rows"]
    domains = sorted({r["domain"] for r in rows})
    print(
        "| not in the fit | scans | found | wrong | foreign found |\n| --- | --- | --- | --- | --- |"
    )
    for domain in domains:
        inside = [r for r in rows if r["domain"] == domain]
        report(domain, inside, fit([r for r in rows if r["domain"] != domain]))
    names = ["uncovered", "free space", "front", "search", "1"]
    print({name: round(float(value), 2) for name, value in zip(names, fit(rows))})


if __name__ == "__main__":
    main()
