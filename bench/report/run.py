#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One self-contained page from records of the benchmarks; nothing is measured, no network is needed
to look at it.

usage: run.py [RECORD.json ...] [--pictures SCENE PRESET PAGE.html] [-o out/report.html]
Without records: those of bench/results. --pictures: pairs drawn by `gpureg report RESULT.json
--clouds ... -o PAGE.html`. Needs matplotlib."""

import argparse
import pathlib

import page


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("records", nargs="*", type=pathlib.Path, metavar="RECORD")
    parser.add_argument(
        "--pictures", nargs=3, action="append", default=[], metavar=("SCENE", "PRESET", "PAGE")
    )
    parser.add_argument("-o", "--output", type=pathlib.Path, default=page.ROOT / "out/report.html")
    arguments = parser.parse_args()
    records = arguments.records
    if not records:
        results = page.ROOT / "bench/results"
        records = [
            path
            for path in sorted(results.glob("*.json"))
            if path.name.startswith(("peers_", "redwood", "fgr", "pipeline_"))
        ]
    page.write(
        arguments.output,
        records,
        {
            (scene, preset): pathlib.Path(path).read_text()
            for scene, preset, path in arguments.pictures
        },
    )


main()
