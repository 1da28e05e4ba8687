#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/reference/command.md: what `gpureg VERB --help` prints, for every verb.

scripts/command_reference.py build/cpu/bin/gpureg           write the page
scripts/command_reference.py build/cpu/bin/gpureg --check   exit status 1 where it would change
"""

import argparse
import os
import pathlib
import re
import subprocess
import sys

PAGE = pathlib.Path(__file__).resolve().parents[1] / "docs" / "reference" / "command.md"
HEAD = """# The command
Written by `scripts/command_reference.py` from the output of `gpureg VERB --help`.
"""


def help_of(command: str, *verb: str) -> str:
    environment = {**os.environ, "COLUMNS": "100"}
    done = subprocess.run(
        [command, *verb, "--help"], capture_output=True, text=True, check=True, env=environment
    )
    return "\n".join(line.rstrip() for line in done.stdout.strip().splitlines())


def page(command: str) -> str:
    overview = help_of(command)
    listed = re.split(r"^subcommands:\n", overview, flags=re.IGNORECASE | re.MULTILINE)[1]
    verbs = [line.split()[0] for line in listed.split("\n\n")[0].splitlines()]
    parts = [HEAD, f"```text\n{overview}\n```\n"]
    parts += [f"## gpureg {verb}\n```text\n{help_of(command, verb)}\n```\n" for verb in verbs]
    return "\n".join(parts)


def words(text: str) -> list[str]:
    """Versions of CLI11 differ in layout and punctuation alone."""
    return re.findall(r"[a-z0-9_]+", text.lower())


parser = argparse.ArgumentParser(
    description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
)
parser.add_argument("command", help="the command gpureg")
parser.add_argument("--check", action="store_true")
arguments = parser.parse_args()

text = page(str(pathlib.Path(arguments.command).resolve()))
if not arguments.check:
    PAGE.write_text(text)
elif words(PAGE.read_text()) != words(text):
    print(
        f"docs/reference/command.md is not what the command says: run scripts/command_reference.py {arguments.command}"
    )
    sys.exit(1)
