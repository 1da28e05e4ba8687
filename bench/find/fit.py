# SPDX-License-Identifier: BSD-3-Clause
"""Fits the confidence of parts to records of run.py and writes its header: bench/find/fit.py RECORD... Needs scipy and the Python package
gpureg.

Prints what fits that have not seen a kind of part make of it."""

import argparse
import json
import pathlib
import re
import sys
import typing

import gpureg
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "bench/accuracy"), str(ROOT / "bench/find")]
from run import figures, print_table

from confidence.model_header import clang_format
from confidence.regressions import monotone

HEADER = ROOT / "src/localization/find/part_confidence_model.hpp"
# Direction in which each feature may move the odds, in the order of PartFeature.
SIGNS = {
    "supported": 1,
    "violated": -1,
    "occluded": -1,
    "contour": 1,
    "contour_length": 1,
    "log_area": 1,
    "residual": -1,
    "log_weakest": 1,
    "log_third_weakest": 1,
    "log_votes": 1,
    "rival": -1,
}
UNSEEN = {
    name: sign
    for name, sign in SIGNS.items()
    if name not in ("violated", "occluded", "contour", "contour_length")
}


class Shipped(typing.NamedTuple):
    bias: float
    steps: list


def features(evidence):
    """By the library, so that the fit and the confidence have the same ones."""
    return gpureg._core._part_features(evidence)


def samples(rows):
    """Features, labels, weights: each kind counts the same, and in it each scene."""
    x = np.array([features(f["evidence"]) for r in rows for f in r["found"]])
    y = np.array([f["instance"] >= 0 for r in rows for f in r["found"]])
    kinds = [r["kind"] for r in rows]
    weight = np.concatenate(
        [
            np.full(len(r["found"]), 1 / kinds.count(r["kind"]) / max(len(r["found"]), 1) ** 0.5)
            for r in rows
        ]
    )
    return x, y, weight


def fitted(rows):
    x, y, weight = samples(rows)
    # Few poses are correct: half of the quantiles are theirs, so that steps lie where the two meet.
    both = np.concatenate([x[~y], np.repeat(x[y], max((~y).sum() // max(y.sum(), 1), 1), 0)])
    return monotone(x, y, weight, list(SIGNS), SIGNS if rows[0]["view"] else UNSEEN, both)


def scored(rows, model):
    """The rows with the confidences of a model."""
    out = []
    for r in rows:
        confidence = (
            1
            / (1 + np.exp(-model.log_odds(np.array([features(f["evidence"]) for f in r["found"]]))))
            if r["found"]
            else []
        )
        out.append(
            {**r, "found": [{**f, "confidence": float(c)} for f, c in zip(r["found"], confidence)]}
        )
    return out


def unseen_kinds(rows):
    """Every kind scored by a fit on the others."""
    out = []
    for kind in dict.fromkeys(r["kind"] for r in rows):
        out += scored(
            [r for r in rows if r["kind"] == kind], fitted([r for r in rows if r["kind"] != kind])
        )
    return out


def print_calibration(rows):
    poses = np.array([(f["confidence"], f["instance"] >= 0) for r in rows for f in r["found"]])
    for low, high in ((0, 0.1), (0.1, 0.3), (0.3, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1.001)):
        of = poses[(poses[:, 0] >= low) & (poses[:, 0] < high)]
        if len(of):
            print(
                f"confidence {low} to {min(high, 1)}: {len(of)} poses, {of[:, 0].mean():.3f} said, {of[:, 1].mean():.3f} correct"
            )


def header(models, note):
    names = list(SIGNS)
    lines = [
        "// SPDX-License-Identifier: BSD-3-Clause",
        f"// Written by bench/find/fit.py: {note}.",
        "#pragma once",
        "",
        "#include <iterator>",
        "",
        '#include "localization/find/part_confidence.hpp"',
        "",
        "namespace gpureg::localization {",
        "",
        "/// What a feature adds on its way from one value to another one, as in confidence/regression.hpp.",
        "struct PartStep {",
        "  PartFeature feature;",
        "  double from, to, rise;",
        "};",
        "",
        "struct PartModel {",
        "  double bias;",
        "  const PartStep* steps;",
        "  std::size_t size;",
        "};",
        "",
    ]
    for name, model in models.items():
        steps = ",\n    ".join(
            f"{{PartFeature::{names[k]}, {a:.9g}, {b:.9g}, {rise:.9g}}}"
            for k, a, b, rise in model.steps
        )
        lines += [
            f"constexpr PartStep {name}Steps[] = {{{steps}}};",
            f"constexpr PartModel {name}{{{model.bias:.9g}, {name}Steps, std::size({name}Steps)}};",
            "",
        ]
    return "\n".join([*lines, "}  // namespace gpureg::localization", ""])


def shipped(name):
    """The model of the header."""
    text = HEADER.read_text()
    steps = re.findall(
        r"\{PartFeature::(\w+), (.+?), (.+?), (.+?)\}",
        text.split(f"{name}Steps[]")[1].split(";")[0],
        re.S,
    )
    bias = float(re.search(rf"PartModel {name}\{{(.+?),", text)[1])
    names = list(SIGNS)
    return Shipped(bias, [(names.index(f), *map(float, numbers)) for f, *numbers in steps])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("records", nargs="+")
    parser.add_argument("--tested", help="write the rows, each scored by a fit on the other kinds")
    parser.add_argument("--write", action="store_true", help=f"write {HEADER.relative_to(ROOT)}")
    arguments = parser.parse_args()
    rows = [
        json.loads(line)
        for path in arguments.records
        for line in pathlib.Path(path).read_text().splitlines()
    ]
    models = {}
    for name, view in (("kInView", True), ("kUnseen", False)):
        of = [r for r in rows if r["view"] == view]
        if not of:
            print(f"no record for {name}: it stays as it is")
            models[name] = shipped(name)
            continue
        print(
            f"== {'seen from a known viewpoint' if view else 'viewpoint not known'}: kinds that the fit has not seen"
        )
        tested = unseen_kinds(of)
        print_table(tested)
        print_calibration(tested)
        if arguments.tested and view:
            pathlib.Path(arguments.tested).write_text(
                "".join(
                    json.dumps({**r, "fit": "of fits on the other kinds"}) + "\n" for r in tested
                )
            )
        models[name] = fitted(of)
        for k, a, b, rise in models[name].steps:
            print(f"  {list(SIGNS)[k]} {a:.3f} .. {b:.3f}: {rise:+.2f}")
        print("bias", models[name].bias, figures(scored(of, models[name])))
    if arguments.write:
        kinds = len({r["kind"] for r in rows})
        HEADER.write_text(
            header(
                models,
                f"{len(rows)} scenes of {kinds} kinds of parts, {sum(len(r['found']) for r in rows)} poses",
            )
        )
        import subprocess

        if tool := clang_format():
            subprocess.run(
                [tool, "-i", f"--style=file:{ROOT / '.clang-format'}", str(HEADER)], check=True
            )


if __name__ == "__main__":
    main()
