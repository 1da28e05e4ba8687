#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Recall, precision and time of the preset loopsmart against the number of quadruples that it scores.

    bench/accuracy/survivors.py [--scenes NAME...] [--caps N...] [--seeds N...] [--backend cuda]
                                [--data DIR] [--gpureg COMMAND] [-o record.json]

All pairs of a scene are one batch. `gpureg evaluate` counts by the strict rule. Needs the package
gpureg.
"""

import json
import pathlib
import tempfile
import time

import gpureg
import record

SCENES = {
    "red kitchen": "redkitchen/fragments",
    "house A": "house/A",
    "house B": "house/B",
    "hospital E": "hospital/E",
}
CAPS = (1 << 18, 16384, 8192, 4096)


def pair_record(i, j, result):
    """What `gpureg evaluate` reads of a pair."""
    return {
        "i": i,
        "j": j,
        "status": "aligned" if result.aligned else "not_aligned",
        "reason": str(result.reason),
        "score": result.score,
        "inlier_ratio": result.inlier_ratio,
        "inlier_rmse": result.inlier_rmse,
        "T_ij": result.target_from_source.flatten().tolist() if result.has_candidate else None,
        "statistics": {},
        "ms": {"total": 0},
    }


def evaluate(arguments, folder, pairs):
    with tempfile.TemporaryDirectory() as temporary:
        result, scores = (pathlib.Path(temporary) / name for name in ("r.json", "s.json"))
        result.write_text(json.dumps({"pairs": pairs}))
        record.gpureg(arguments, "evaluate", result, "--ground-truth", folder, "--json", scores)
        return json.loads(scores.read_text())["scenes"][0]["strict"]


def rows_of(arguments, context, name):
    folder = record.data_folder(arguments, SCENES[name])
    fragments = gpureg.FragmentSet.from_directory(folder)
    options = gpureg.RegistrationOptions.loopsmart()
    loaded = [fragments.load(k, options.prepare) for k in range(len(fragments.numbers))]
    clouds = gpureg._core.prepare_batch(context, loaded, options.prepare)
    pairs = [(j, i) for i in range(len(clouds)) for j in range(i + 1, len(clouds))]
    for cap in arguments.caps:
        for seed in arguments.seeds:
            options.quadruples.max_survivors, options.seed = cap, seed
            gpureg.align_batch(clouds, pairs[:5], options=options, context=context)
            start = time.perf_counter()
            results = gpureg.align_batch(clouds, pairs, options=options, context=context)
            ms = 1e3 * (time.perf_counter() - start) / len(pairs)
            found = [
                pair_record(fragments.numbers[i], fragments.numbers[j], result)
                for (j, i), result in zip(pairs, results, strict=True)
            ]
            scores = evaluate(arguments, folder, found)
            row = {
                "scene": name,
                "max_survivors": cap,
                "seed": seed,
                "recall": 100 * scores["recall"],
                "precision": 100 * scores["precision"],
                "recall_of_candidates": 100 * scores["raw_recall"],
                "recall_at_95": 100 * scores["recall_at_precision"]["95"],
                "ms_per_pair": ms,
            }
            print(json.dumps(row), flush=True)
            yield row


def main():
    parser = record.parser(__doc__, "survivors.json")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--caps", nargs="+", type=int, default=CAPS)
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    arguments = parser.parse_args()
    context = gpureg.Context.cpu() if arguments.backend == "cpu" else gpureg.Context.best()
    rows = [row for name in arguments.scenes for row in rows_of(arguments, context, name)]
    command = f"python3 bench/accuracy/survivors.py --backend {arguments.backend}"
    record.write(arguments, command, {"rows": rows})


if __name__ == "__main__":
    main()
