# SPDX-License-Identifier: BSD-3-Clause
"""Writes and reads src/confidence/confidence_model.hpp. Needs numpy, the Python package gpureg and clang-format."""

import pathlib
import re
import shutil
import subprocess

import numpy as np

from confidence.regressions import ALL_MODELS, REGRESSIONS, Regression, library

ROOT = pathlib.Path(__file__).resolve().parents[3]


def constant(name):
    """The C++ constant of a model: kFreeSpace for free_space."""
    return "k" + "".join(word.capitalize() for word in name.split("_"))


def steps_of(name, stage):
    return f"{constant(name)}{stage.capitalize()}Steps"


def header(models):
    """C++ of the models by name, each a dictionary of regressions; not yet formatted."""
    names = library()._confidence_feature_names()

    def regression(of, constant):
        if of.steps:
            return f"additive({of.bias:.9g}, {constant})"
        weights = ", ".join(
            f"{{Feature::{name}, {weight:.9g}}}"
            for name, weight in zip(names, of.weights)
            if weight != 0
        )
        return f"{{weights({{{weights}}}), {of.bias:.9g}}}"

    lines = [
        "// SPDX-License-Identifier: BSD-3-Clause",
        "// Written by bench/accuracy/fit_confidence.py; docs/accuracy.md has its accuracy.",
        "#pragma once",
        "",
        '#include "confidence/regression.hpp"',
        "",
        "namespace gpureg::confidence {",
        "",
    ]
    for name, of in models.items():
        for stage in REGRESSIONS:
            if of[stage].steps:
                listed = ", ".join(
                    f"{{Feature::{names[k]}, {start:.9g}, {end:.9g}, {rise:.9g}}}"
                    for k, start, end, rise in of[stage].steps
                )
                lines += [f"constexpr Step {steps_of(name, stage)}[] = {{{listed}}};", ""]
        three = ", ".join(regression(of[stage], steps_of(name, stage)) for stage in REGRESSIONS)
        lines += [f"constexpr ConfidenceModel {constant(name)}{{{three}}};", ""]
    return "\n".join([*lines, "}  // namespace gpureg::confidence", ""])


def read_header(text):
    """The models of header(), by name."""
    names = library()._confidence_feature_names()
    models = {}
    for name in ALL_MODELS:
        body = re.search(rf"ConfidenceModel {constant(name)}\{{(.*?)\}};", text, re.DOTALL)
        if body is None:
            raise ValueError(f"the header has no {constant(name)}")
        found = re.findall(
            r"additive\(([^,]+),\s*(\w+)\)|weights\(\{(.*?)\}\),\s*([^}\s]+)\s*\}",
            body[1] + "}",
            re.DOTALL,
        )
        models[name] = {}
        for stage, (bias, steps, weights, linear_bias) in zip(REGRESSIONS, found, strict=True):
            of, listed = dict(re.findall(r"\{Feature::(\w+),\s*([^}\s]+)\s*\}", weights)), []
            if steps:
                table = re.search(rf"Step {steps}\[\] = \{{(.*?)\}};", text, re.DOTALL)[1]
                listed = re.findall(r"\{Feature::(\w+),([^}]+)\}", table)
            if unknown := (of.keys() | {feature for feature, _ in listed}) - set(names):
                raise ValueError(f"the library has no feature {sorted(unknown)[0]}")
            models[name][stage] = Regression(
                np.array([float(of.get(feature, 0)) for feature in names]),
                float(bias or linear_bias),
                [(names.index(f), *map(float, numbers.split(","))) for f, numbers in listed],
            )
    return models


def clang_format():
    """The formatter of scripts/format, or another one, or None."""
    own = ROOT / "build/format-venv/bin/clang-format"
    return str(own) if own.exists() else shutil.which("clang-format")


def write_header(path, models):
    """Regressions that were not fitted stay as the header has them."""
    shipped = read_header((ROOT / "src/confidence/confidence_model.hpp").read_text())
    models = {name: models.get(name, shipped.get(name)) for name in ALL_MODELS}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(header(models))
    tool = clang_format()
    if tool is None:
        print(f"{path} is not formatted, as there is no clang-format: run scripts/format")
    else:
        style = f"--style=file:{ROOT / '.clang-format'}"
        subprocess.run([tool, "-i", style, str(path)], check=True)
