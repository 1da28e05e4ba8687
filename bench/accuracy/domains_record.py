#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Record of how true the confidence is outside of furnished rooms, from the files of domains.py.

Pairs without a model have the confidences that the command gave: no other data than rooms taught them.
Pairs with a model are scored by a fit on the other domains of models (fit_models.py).

Pairs of several seeds count together; the calibration errors of the seeds are kept beside it. With --only
the record keeps all other domains, and the commits that made them.

usage: domains_record.py FOLDER [--only street,hall] [--commit COMMIT] [-o bench/results/domains.json]
FOLDER: DOMAIN.json files of domains.py. Needs numpy, scikit-learn and the Python package gpureg."""

import json
import pathlib

import domains
import fit_models
import record


def figures_of(pairs):
    return fit_models.figures(
        [p["modes"][0]["confidence"] if p["modes"] else 0.0 for p in pairs],
        [p["correct"][:1] == [True] for p in pairs],
        [p["positive"] for p in pairs],
        [any(p["correct"]) for p in pairs],
    )


def without_model(path):
    pairs = [p for p in json.loads(path.read_text())["pairs"] if "model" not in p["viewpoints"]]
    seeds = {}
    for p in pairs:
        seeds.setdefault(p["seed"] % domains.SCENE_STEP, []).append(p)
    return {
        **figures_of(pairs),
        "seeds": sorted(seeds),
        "ECE_of_seeds": [figures_of(seeds[seed])["ECE"] for seed in sorted(seeds)],
    }


def main():
    parser = record.plain_parser(__doc__)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--commit", default=record.commit())
    parser.add_argument(
        "-o", "--output", type=pathlib.Path, default=record.ROOT / "bench/results/domains.json"
    )
    parser.add_argument("--only", default="", help="domains without models")
    arguments = parser.parse_args()
    only = arguments.only.split(",") if arguments.only else []
    if only:
        content = json.loads(arguments.output.read_text())
        new = {name: without_model(arguments.folder / f"{name}.json") for name in only}
    else:
        content = {"command": "bench/accuracy/domains_record.py", "domains": {}}
        content["commit"] = arguments.commit
        new = fit_models.tested(fit_models.runs_of(arguments.folder))
        files = sorted(arguments.folder.glob("*.json"))
        new.update({f.stem: without_model(f) for f in files if f.stem not in new})
    for name, of in new.items():
        content["domains"][name] = {**of, "commit": arguments.commit}
        print(name, of)
    record.save(arguments.output, content)


if __name__ == "__main__":
    main()
