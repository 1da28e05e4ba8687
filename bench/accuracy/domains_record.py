#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Record of how true the confidence is outside of furnished rooms, from the files of domains.py.

Pairs without a model have the confidences that the command gave: no other data than rooms taught them.
Pairs with a model are scored by a fit on the other domains of models (fit_confidence.py).

usage: domains_record.py FOLDER [--commit COMMIT] [-o bench/results/domains.json]
FOLDER: DOMAIN.json files of domains.py. Needs numpy, scikit-learn and the Python package gpureg."""

import argparse
import json
import pathlib

import fit_confidence
import numpy as np
import record

MODELS = ("parts", "figures", "cad", "cad_mesh")


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


def without_model(path):
    pairs = [p for p in json.loads(path.read_text())["pairs"] if "model" not in p["viewpoints"]]
    return figures(
        [p["modes"][0]["confidence"] if p["modes"] else 0.0 for p in pairs],
        [p["correct"][:1] == [True] for p in pairs],
        [p["positive"] for p in pairs],
        [any(p["correct"]) for p in pairs],
    )


def with_model(paths):
    """By domain; files of one domain begin with its name."""
    model, out = fit_confidence.MODELS["model"], {}
    runs = {
        path.stem: [
            r
            for r in fit_confidence.domain_runs(path, fit_confidence.DOMAIN_WEIGHT)
            if r.has(model)
        ]
        for path in paths
    }
    for name, own in runs.items():
        domain = name.split("_")[0]
        others = [r for other, of in runs.items() if other.split("_")[0] != domain for r in of]
        regressions = fit_confidence.fit(others, [], model)
        parts = []
        for run in own:
            best, confidence, _ = fit_confidence.confidences(run, model, regressions)
            found = np.bincount(run.pair[run.correct], minlength=len(run.keys)) > 0
            parts.append((confidence, run.correct[best], run.in_truth, found))
        out[name] = figures(*map(np.concatenate, zip(*parts)))
    return out


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--commit", default=record.commit())
    parser.add_argument(
        "-o", "--output", type=pathlib.Path, default=record.ROOT / "bench/results/domains.json"
    )
    arguments = parser.parse_args()
    files = sorted(arguments.folder.glob("*.json"))
    domains = with_model([f for f in files if f.stem in MODELS])
    domains.update({f.stem: without_model(f) for f in files if f.stem not in MODELS})
    content = {
        "command": "bench/accuracy/domains_record.py",
        "commit": arguments.commit,
        "domains": domains,
    }
    arguments.output.write_text(json.dumps(content, indent=1) + "\n")
    for name, of in domains.items():
        print(name, of)


if __name__ == "__main__":
    main()
