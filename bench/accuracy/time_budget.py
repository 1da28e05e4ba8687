#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Times and recall of alignment within a time budget: pairs of a scene's gt.log, prepared once,
through the Python package.

Correct: Redwood's rule for reports, on pairs that are not consecutive. The pairs are evenly chosen
among those of the truth. Times are wall time; a machine with other work to do overruns more.

usage: time_budget.py [--budgets 20 50 100 300 1000] [--pairs 24] [--scene redkitchen/fragments]
[--backend auto] [--data DIR] [-o FILE] Needs the package gpureg."""

import statistics

import gpureg
import record
from fit_confidence import MAX_ERROR, MIN_SEPARATION, blocks, errors

OVERRUN = 1.1  # times the budget: a run that took longer is counted

parser = record.parser(__doc__, "time_budget.json")
parser.add_argument(
    "--budgets", type=float, nargs="+", default=[20, 50, 100, 300, 1000], help="milliseconds"
)
parser.add_argument("--pairs", type=int, default=24)
parser.add_argument("--scene", default="redkitchen/fragments")
arguments = parser.parse_args()
folder = record.data_folder(arguments, arguments.scene)


def correct(truth, information, pose):
    return bool(errors(truth, information, pose[None])[0] <= MAX_ERROR)


context = {"auto": gpureg.Context.best, "cpu": gpureg.Context.cpu, "cuda": gpureg.Context.cuda}[
    arguments.backend
]()
options = gpureg.RegistrationOptions()
truth, information = blocks(folder / "gt.log", 5), blocks(folder / "gt.info", 7)
keys = sorted(key for key in truth if key[1] - key[0] >= MIN_SEPARATION)
keys = [
    keys[k * len(keys) // min(arguments.pairs, len(keys))]
    for k in range(min(arguments.pairs, len(keys)))
]
fragments = gpureg.FragmentSet.from_directory(folder)
numbers = sorted({number for key in keys for number in key})
clouds = dict(
    zip(
        numbers,
        gpureg._core.prepare_batch(
            context,
            [
                fragments.load(fragments.numbers.index(number), options.prepare)
                for number in numbers
            ],
            options.prepare,
        ),
    )
)
gpureg.align(
    clouds[keys[0][1]], clouds[keys[0][0]], context=context
)  # first use of the context is not what is measured

rows = []
for budget in arguments.budgets:
    runs = []
    for i, j in keys:
        timed = gpureg.align_within(clouds[j], clouds[i], budget, options=options, context=context)
        found = timed.result.has_candidate and correct(
            truth[i, j], information[i, j], timed.result.target_from_source
        )
        runs.append(
            (
                timed.milliseconds,
                timed.levels,
                timed.quality,
                timed.highest_quality,
                found,
                timed.result.aligned,
            )
        )
    ms, levels, quality, highest, found, aligned = map(list, zip(*runs))
    more = [
        t for t, n in zip(ms, levels) if n > 1
    ]  # where the lowest level alone is over, that is said below
    row = {
        "budget_ms": budget,
        "mean_ms": statistics.fmean(ms),
        "median_ms": statistics.median(ms),
        "most_ms": max(ms),
        "lowest_level_over": sum(t > budget and n == 1 for t, n in zip(ms, levels)),
        "over_by_10_percent": sum(t > OVERRUN * budget for t in more),
        "mean_quality": statistics.fmean(quality),
        "mean_highest_quality": statistics.fmean(highest),
        "right": 100 * statistics.fmean(found),
        "aligned": 100 * statistics.fmean(aligned),
    }
    rows.append(row)
    print(
        f"{budget:6g} ms: used {row['mean_ms']:.1f} in the mean, {row['most_ms']:.1f} at most; {row['over_by_10_percent']} over by 10 %, "
        f"{row['lowest_level_over']} by the lowest level; quality up to {row['mean_highest_quality']:.1f}; right {row['right']:.1f} %"
    )
record.write(
    arguments,
    f"bench/accuracy/time_budget.py --pairs {len(keys)} --backend {context.backend} --scene {arguments.scene}",
    {"backend": context.description, "scene": arguments.scene, "pairs": len(keys), "budgets": rows},
)
