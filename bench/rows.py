#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""JSON of the records in bench/results: one row a line.

    bench/rows.py FILE.json...    writes the files again in this layout

A container without containers is a line. One with containers is a line too if it is short.
"""

import json
import pathlib
import sys

SHORT = 700  # characters


def height(value: object) -> int:
    """Levels of containers."""
    if isinstance(value, dict):
        value = list(value.values())
    return 1 + max(map(height, value), default=0) if isinstance(value, list) else 0


def dumps(value: object, indent: int = 0) -> str:
    line = json.dumps(value, ensure_ascii=False)
    levels = height(value)
    if levels < 2 or (isinstance(value, dict) and levels == 2 and len(line) <= SHORT and indent):
        return line
    space = " " * (indent + 1)
    if isinstance(value, dict):
        rows = [
            f"{space}{json.dumps(key, ensure_ascii=False)}: {dumps(item, indent + 1)}"
            for key, item in value.items()
        ]
    else:
        rows = [space + dumps(item, indent + 1) for item in value]
    begin, end = "{}" if isinstance(value, dict) else "[]"
    return "\n".join([begin, ",\n".join(rows), " " * indent + end])


def main() -> None:
    for name in sys.argv[1:]:
        path = pathlib.Path(name)
        path.write_text(dumps(json.loads(path.read_text())) + "\n")


if __name__ == "__main__":
    main()
