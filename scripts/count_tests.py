#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Adds up JUnit files: names what failed and prints one closing line. Exit status 1 where anything failed or nothing ran."""
import argparse
import sys
import xml.etree.ElementTree as ElementTree

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("files", nargs="+", help="JUnit XML files")
parser.add_argument("--failed", type=int, default=0, help="failures to add, such as a build that broke")
arguments = parser.parse_args()

passed, failed, skipped = 0, arguments.failed, 0
for file in arguments.files:
    for case in ElementTree.parse(file).getroot().iter("testcase"):
        if case.find("failure") is not None or case.get("status") in ("fail", "notrun") and case.find("skipped") is None:
            failed += 1
            print(f"failed: {case.get('name')} ({file})")
        elif case.find("skipped") is not None:
            skipped += 1
        else:
            passed += 1
print(f"{passed} passed, {failed} failed, {skipped} skipped")
sys.exit(1 if failed or not passed else 0)
