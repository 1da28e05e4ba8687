# SPDX-License-Identifier: BSD-3-Clause
"""Prints a suppression for abidiff that keeps a library's public functions only.

    python3 scripts/checks/public_symbols.py LIBRARY.so HEADERS

Tests and components use functions of private headers, and the compiler adds instances of
templates: a release may drop all of these. A function is public if its name and the names of its
classes and namespaces occur in the headers.
"""

import pathlib
import re
import subprocess
import sys


def output(*command: str, text: str = "") -> list[str]:
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def main() -> None:
    library, headers = sys.argv[1:]
    files = pathlib.Path(headers).rglob("*.hpp")
    words = set(re.findall(r"\w+", " ".join(file.read_text() for file in files)))
    rows = [row.split() for row in output("nm", "-D", "--defined-only", library)]
    symbols = [row[-1].split("@")[0] for row in rows if row[-2] == "T"]
    public = []
    for symbol, plain in zip(symbols, output("c++filt", text="\n".join(symbols)), strict=True):
        name = plain.replace("[abi:cxx11]", "").split("(")[0]
        parts = re.findall(r"\w+", name)
        if "gpureg" in parts and all(part in words for part in parts):
            public.append(re.escape(symbol))
    if not public:
        sys.exit(f"error: {library} has no function of {headers}")
    print("[suppress_function]\n  symbol_name_not_regexp = ^(" + "|".join(public) + ")$")


if __name__ == "__main__":
    main()
