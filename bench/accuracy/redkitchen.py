#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Recall and precision on the 190 pairs of 20 real fragments (7-Scenes red kitchen, 3DMatch),
Redwood's protocol.

`gpureg batch` and `gpureg evaluate` for each seed; the record holds evaluate's JSON.
usage: redkitchen.py [--preset loopsmart] [--seeds 1 2 3] [--backend auto] [--scene
redkitchen/fragments] [--data DIR] [-o FILE]"""

import json
import pathlib
import statistics
import tempfile

import record

parser = record.parser(__doc__, "redkitchen_loopsmart.json")
parser.add_argument("--preset", default="loopsmart")
parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
parser.add_argument(
    "--scene",
    default="redkitchen/fragments",
    help="a folder of the data with fragments and their ground truth",
)
parser.set_defaults(output=None)
arguments = parser.parse_args()
if arguments.output is None:
    arguments.output = record.ROOT / f"bench/results/redkitchen_{arguments.preset}.json"
folder = record.data_folder(arguments, arguments.scene)

runs, batch = [], {}
with tempfile.TemporaryDirectory() as temporary:
    temporary = pathlib.Path(temporary)
    result, scores = temporary / "result.json", temporary / "scores.json"
    for seed in arguments.seeds:
        record.gpureg(
            arguments,
            "batch",
            folder,
            "--voxel-size",
            0.05,
            "--preset",
            arguments.preset,
            "--backend",
            arguments.backend,
            "--seed",
            seed,
            "-o",
            temporary / "result.log",
            "--json",
            result,
            "--quiet",
        )
        record.gpureg(arguments, "evaluate", result, "--ground-truth", folder, "--json", scores)
        batch, scene = json.loads(result.read_text()), json.loads(scores.read_text())["scenes"][0]
        for detail in ("pairs", "curve"):  # of every pair: too much for a record
            for part in (scene, scene["strict"], scene["geometric"]):
                part.pop(detail, None)
        scene.update(scene=arguments.scene, result=f"seed {seed}", ground_truth=arguments.scene)
        runs.append(
            {"seed": seed, "evaluate": scene, "peak_memory_mib": round(batch["peak_memory_mib"])}
        )
        strict = scene["strict"]
        print(
            f"seed {seed}: best candidates right {100 * strict['raw_recall']:.1f} %, reported recall "
            f"{100 * strict['recall']:.1f} % at precision {100 * strict['precision']:.1f} %, {scene['ms']['pair']:.1f} ms per pair"
        )


def mean(*path):
    values = []
    for run in runs:
        value = run["evaluate"]
        for key in path:
            value = value[key]
        values.append(value)
    return statistics.fmean(values)


options = batch["options"]
options.pop("seed", None)
command = (
    f"bench/accuracy/redkitchen.py --preset {arguments.preset} --seeds {' '.join(map(str, arguments.seeds))} "
    f"--backend {batch['environment']['backend']} --scene {arguments.scene}"
)
record.write(
    arguments,
    command,
    {
        "environment": batch["environment"],
        "preset": arguments.preset,
        "options": options,
        "pairs": len(batch["pairs"]),
        "mean": {
            "raw_recall": mean("strict", "raw_recall"),
            "recall": mean("strict", "recall"),
            "precision": mean("strict", "precision"),
            "ms_per_pair": mean("ms", "pair"),
            "ms_per_fragment": mean("ms", "fragment"),
        },
        "runs": runs,
    },
)
