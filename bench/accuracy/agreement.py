#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What loops of three add to the confidences of single pairs: `gpureg agree` on results of all pairs of a scene.

A run is SCENE_FOLDER=RESULT.json: what `gpureg batch --json` wrote for a scene whose folder has gt.log and gt.info, perhaps gt_all.log
and gt_all.info. The record has `gpureg evaluate`'s geometric figures before and after, the expected calibration error (10 bins) and
how many of the reports above 0.9 are right. SCENE_FOLDER is relative to the data's folder.

usage: agreement.py RUN... [--data DIR] [-o FILE]"""
import json
import pathlib
import tempfile

import record

parser = record.parser(__doc__, "agreement.json")
parser.add_argument("runs", nargs="+", metavar="RUN")
arguments = parser.parse_args()


def figures(folder, result, temporary):
    file = temporary / "scores.json"
    record.gpureg(arguments, "evaluate", result, "--ground-truth", folder, "--json", file)
    scene = json.loads(file.read_text())["scenes"][0]
    # The red kitchen has no gt_all.log: there the strict rule is the only one.
    rule = "geometric" if "geometric" in scene else "strict"
    score = scene[rule]
    pairs = [(pair["score"] or 0.0, pair[rule]) for pair in scene["pairs"] if pair["tried"]]
    error = 0.0
    for k in range(10):
        inside = [(c, right) for c, right in pairs if min(int(10 * c), 9) == k]
        error += abs(sum(c for c, _ in inside) - sum(right for _, right in inside)) / len(pairs)
    sure = [right for c, right in pairs if c > 0.9]
    return {"rule": rule, "raw_recall": 100 * score["raw_recall"], "R@P95": 100 * score["recall_at_precision"]["95"],
            "R@P99": 100 * score["recall_at_precision"]["99"], "AP": 100 * score["average_precision"], "calibration_error": error,
            "above_0.9": len(sure), "right_above_0.9": 100 * sum(sure) / len(sure) if sure else None}


def text(f):
    right = "none" if f["right_above_0.9"] is None else f"{f['right_above_0.9']:.1f} %"
    return (f"raw {f['raw_recall']:.1f}, R@P95 {f['R@P95']:.1f}, R@P99 {f['R@P99']:.1f}, AP {f['AP']:.1f}, calibration error "
            f"{f['calibration_error']:.3f}, {f['above_0.9']} above 0.9: {right} right")


scenes = []
with tempfile.TemporaryDirectory() as temporary:
    temporary = pathlib.Path(temporary)
    for run in arguments.runs:
        name, result = run.split("=")
        folder = record.data_folder(arguments, name)
        agreed = temporary / "agreed.json"
        record.gpureg(arguments, "agree", result, "--json", agreed)
        before, after = figures(folder, result, temporary), figures(folder, agreed, temporary)
        scenes.append({"scene": name, "options": json.loads(pathlib.Path(result).read_text())["options"], "before": before, "after": after})
        print(f"{name}\n  alone      {text(before)}\n  agreement  {text(after)}")
record.write(arguments, "bench/accuracy/agreement.py " + " ".join(f"{run.split('=')[0]}=RESULT.json" for run in arguments.runs),
             {"scenes": scenes})
