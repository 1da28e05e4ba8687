#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Record of how true the confidence is outside of furnished rooms, from the files of domains.py.

Pairs without a model have the confidences that the command gave: no other data than rooms taught them.
Pairs with a model are scored by a fit on the other domains of models (fit_models.py).

usage: domains_record.py FOLDER [--commit COMMIT] [-o bench/results/domains.json]
FOLDER: DOMAIN.json files of domains.py. Needs numpy, scikit-learn and the Python package gpureg."""

import argparse
import json
import pathlib

import fit_models
import record


def without_model(path):
    pairs = [p for p in json.loads(path.read_text())["pairs"] if "model" not in p["viewpoints"]]
    return fit_models.figures(
        [p["modes"][0]["confidence"] if p["modes"] else 0.0 for p in pairs],
        [p["correct"][:1] == [True] for p in pairs],
        [p["positive"] for p in pairs],
        [any(p["correct"]) for p in pairs],
    )


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
    domains = fit_models.tested(fit_models.runs_of(arguments.folder))
    domains.update({f.stem: without_model(f) for f in files if f.stem not in domains})
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
