# SPDX-License-Identifier: BSD-3-Clause
"""The records in bench/results, as the tables read them."""

import json
import pathlib
import statistics

RESULTS = pathlib.Path(__file__).resolve().parents[2] / "bench/results"


def load(name):
    return json.loads((RESULTS / name).read_text())


def percent(value):
    return f"{100 * value:.1f}"


def mean(values):
    return statistics.fmean(values)


def source(record):
    return f"Made by `{record['command']}` at commit {record['commit'].rstrip('+')}"


def benchmarks(file="pipeline.json"):
    """Context and runs by name; of a benchmark that was repeated, the median."""
    record = load(file)
    runs = {
        run["name"].split("/real_time")[0].split("/iterations")[0]: run
        for run in record["benchmarks"]
        if run.get("aggregate_name", "median") == "median"
    }
    return record["context"], runs


def made_by(context):
    gpus = int(context.get("gpus", 1))
    return (
        f"Made by `scripts/gpu_check` at commit {context['commit']} on {'an' if gpus == 1 else f'one of {gpus}'} {context['gpu']}"
        f" and {context['num_cpus']} cores of its host."
    )
