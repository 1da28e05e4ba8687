#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the tables of measured figures in README.md, docs and bench/notes from the records in bench/results;
bench/tables says how.

A table stands between <!-- table NAME --> and <!-- end -->; no figure in it is typed by hand.
usage: readme_table.py          rewrite the tables
       readme_table.py --check  exit status 1 where a file does not say what the records say"""

import argparse
import pathlib
import re
import sys

from tables import accuracy, find, loops, maps, peers, scale, slam, speed

ROOT = pathlib.Path(__file__).resolve().parents[1]
FILES = ("README.md", "docs/*.md", "bench/notes/*.md")
TABLES = {
    **accuracy.TABLES,
    **peers.TABLES,
    **speed.TABLES,
    **maps.TABLES,
    **loops.TABLES,
    **find.TABLES,
    **scale.TABLES,
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
    for path in sorted(path for pattern in FILES for path in ROOT.glob(pattern)):
        text = path.read_text()
        new = rewritten(text)
        if new != text:
            stale.append(str(path.relative_to(ROOT)))
            if not check:
                path.write_text(new)
    if check and stale:
        sys.exit(f"error: {', '.join(stale)}: run bench/readme_table.py")


main()
