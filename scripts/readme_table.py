#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the tables of measured figures in README.md and docs from the records in bench/results;
scripts/tables says how.

A table stands between <!-- table NAME --> and <!-- end -->; no figure in it is typed by hand.
usage: readme_table.py          rewrite the tables
       readme_table.py --check  exit status 1 where a file does not say what the records say"""

import argparse
import pathlib
import re
import sys

from tables import accuracy, loops, maps, peers, slam, speed

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGES = (
    "accuracy",
    "usage",
    "experiments",
    "benchmarks",
    "performance",
    "maps",
    "loops",
    "sensors",
    "slam_demo",
)
FILES = ["README.md", *(f"docs/{page}.md" for page in PAGES)]
TABLES = {
    **accuracy.TABLES,
    **peers.TABLES,
    **speed.TABLES,
    **maps.TABLES,
    **loops.TABLES,
    **slam.TABLES,
}


def rewritten(text):
    def table(match):
        return match[1] + "\n" + "\n".join(TABLES[match[2]]()) + "\n" + match[3]

    return re.sub(r"(<!-- table (\w+) -->)\n.*?(<!-- end -->)", table, text, flags=re.DOTALL)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--check", action="store_true")
    check = parser.parse_args().check
    stale = []
    for name in FILES:
        text = (ROOT / name).read_text()
        new = rewritten(text)
        if new != text:
            stale.append(name)
            if not check:
                (ROOT / name).write_text(new)
    if check and stale:
        sys.exit(f"error: {', '.join(stale)}: run scripts/readme_table.py")


main()
