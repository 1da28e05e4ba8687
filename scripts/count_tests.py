#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Adds up JUnit files: shows what failed, names what was skipped and why, and prints one closing
line.

Exit status 1 where anything failed or nothing ran."""

import argparse
import collections
import pathlib
import sys
import xml.etree.ElementTree as ElementTree

LINES = 40  # of a failed test's output, from the end

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("files", nargs="*", type=pathlib.Path, help="JUnit XML files")
parser.add_argument(
    "--failed", type=int, default=0, help="failures to add, such as a build that broke"
)
arguments = parser.parse_args()

passed, failed, skipped = 0, arguments.failed, 0
skipped_tests = collections.Counter()
for file in arguments.files:
    if not file.exists():  # a pattern that no file matches
        continue
    for case in ElementTree.parse(file).getroot().iter("testcase"):
        output = (
            (
                case.findtext("system-out")
                or case.findtext("failure")
                or case.findtext("error")
                or ""
            )
            .strip()
            .splitlines()
        )
        if case.find("skipped") is not None and case.get("status") != "fail":
            skipped += 1
            # GoogleTest's reason is the line before its own verdict.
            reason = [
                line.strip()
                for line in output
                if line.strip() and not line.startswith(("[", "Note:", "Running main()"))
            ]
            reason = [line for line in reason if "Skipped" not in line] or [case.get("name")]
            # pytest has it in a place of its own.
            skipped_tests[
                case.find("skipped").get("message")
                if case.find("skipped").get("type") == "pytest.skip"
                else reason[-1]
            ] += 1
        elif (
            case.find("failure") is not None
            or case.find("error") is not None
            or case.get("status") in ("fail", "notrun")
        ):
            failed += 1
            print(f"failed: {case.get('name')} ({file.stem})", *output[-LINES:], sep="\n  ")
        else:
            passed += 1
for reason, count in skipped_tests.most_common():
    print(f"skipped {count}: {reason}")
print(f"{passed} passed, {failed} failed, {skipped} skipped")
sys.exit(1 if failed or not passed else 0)
