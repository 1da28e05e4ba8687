#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fits the confidence of scans on models, and leaves the other regressions of the header as they are.

FOLDER has files of domains.py (parts, figures, blocks, cad, cad_mesh). Each domain has the same weight. Every
domain is tested by a fit on the others; files of one domain begin with its name: cad.json,
cad_mesh.json.

usage: fit_models.py FOLDER [--header src/confidence/confidence_model.hpp]
Needs numpy, scikit-learn, the Python package gpureg, and clang-format for --header."""

import argparse
import json
import pathlib

import fit_confidence
import numpy as np

from confidence import model_header, regressions

MODEL = regressions.MODELS["model"]
DOMAINS = ("parts", "figures", "blocks", "cad", "cad_mesh")
BESIDE = "blocks"  # few right poses are among the modes: they teach what is wrong, not how to rank
DOMAIN_WEIGHT = 1000.0  # of all pairs of a domain together


class DomainRun(fit_confidence.Run):
    """The pairs of a domain (domains.py) that have the same kinds of evidence. A pose is correct by the rule of the
    domain.
    """

    def __init__(self, domain, pairs, free_space, model, weight):
        self.building, self.label, self.viewpoints = domain, domain, "mixed"
        kinds = [text for text, has in (("free space", free_space), ("model", model)) if has]
        self.name = ", ".join([domain, *kinds])
        self.free_space, self.model, self.weight = free_space, model, weight
        self.refined = pairs[0]["refined"]
        self.keys = [(k, k) for k in range(len(pairs))]
        self.modes_per_pair = np.array([len(p["modes"]) for p in pairs])
        self.pair = np.repeat(np.arange(len(pairs)), self.modes_per_pair)
        self.evidence = fit_confidence.columns([m["evidence"] for p in pairs for m in p["modes"]])
        i, j = np.array([p["points"] for p in pairs])[self.pair].T
        self.factor = fit_confidence.overlap_factor(self.evidence["overlap"], j, i)
        self.correct = np.concatenate([np.array(p["correct"], bool) for p in pairs])
        self.in_truth = np.array([p["positive"] for p in pairs])
        self.strict, self.listed, self.fragments = self.correct, set(), {}


def domain_runs(path):
    """The runs of a file of domains.py, one for each kind of evidence."""
    pairs = [p for p in json.loads(pathlib.Path(path).read_text())["pairs"] if p["modes"]]
    kinds = {}
    for p in pairs:
        observed = any(max(m["evidence"]["observed"]) > 0 for m in p["modes"])
        kinds.setdefault((observed, "model" in p["viewpoints"]), []).append(p)
    weight = DOMAIN_WEIGHT / len(pairs)
    name = pathlib.Path(path).stem
    return [DomainRun(name, of, *kind, weight) for kind, of in sorted(kinds.items())]


def figures(confidence, correct, positive, found):
    confidence, correct = np.array(confidence), np.array(correct, bool)
    bins = np.minimum((confidence * 10).astype(int), 9)
    reported, sure = confidence >= 0.5, confidence > 0.9
    return {
        "pairs": len(confidence),
        "true_pairs": int(sum(positive)),
        "among_modes": int(sum(found)),
        "first": int(correct.sum()),
        "reported": int((reported & correct).sum()),
        "reported_wrong": int((reported & ~correct).sum()),
        "sure": int(sure.sum()),
        "sure_wrong": int((sure & ~correct).sum()),
        "ECE": round(
            float(sum(abs((confidence - correct)[bins == b].sum()) for b in range(10)))
            / len(confidence),
            4,
        ),
    }


def runs_of(folder):
    """The runs with models, by file."""
    return {
        path.stem: [run for run in domain_runs(path) if run.has(MODEL)]
        for path in (folder / f"{name}.json" for name in DOMAINS)
    }


def fit(runs):
    """The regressions on the runs of files, by file."""
    ranked = [run for name, of in runs.items() if name != BESIDE for run in of]
    return fit_confidence.fit(ranked, runs.get(BESIDE, []), MODEL)


def tested(runs):
    """Figures of each file by a fit on the other domains."""
    out = {}
    for name, own in runs.items():
        domain = name.split("_")[0]
        regressions = fit({o: of for o, of in runs.items() if o.split("_")[0] != domain})
        parts = []
        for run in own:
            best, confidence, _ = fit_confidence.confidences(run, MODEL, regressions)
            found = np.bincount(run.pair[run.correct], minlength=len(run.keys)) > 0
            parts.append((confidence, run.correct[best], run.in_truth, found))
        out[name] = figures(*map(np.concatenate, zip(*parts)))
    return out


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--header", type=pathlib.Path)
    arguments = parser.parse_args()
    runs = runs_of(arguments.folder)
    for name, of in tested(runs).items():
        print(name, of)
    if arguments.header:
        model_header.write_header(arguments.header, {"model": fit(runs)})


if __name__ == "__main__":
    main()
