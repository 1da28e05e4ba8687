# SPDX-License-Identifier: BSD-3-Clause
"""Finds fragments and truth of a scene in the usual layouts, and names missing files."""

import pathlib
import re
import sys


def fragment_numbers(folder):
    numbers = {}
    for path in folder.iterdir():
        match = re.fullmatch(r"cloud_bin_(\d+)\.(ply|pcd)", path.name)
        if match:
            numbers[int(match[1])] = path
    return numbers


def first_with(folders, name):
    return next((folder for folder in folders if (folder / name).exists()), None)


class Scene:
    """`name`, `fragments` (folder), `truth` (folder with gt.log and gt.info), `recall_logs`
    (3DMatch's logs of true poses).
    """

    def __init__(self, folder, name):
        folder = pathlib.Path(folder)
        self.name = name
        if not folder.is_dir():
            sys.exit(f"error: there is no folder {folder}")
        self.fragments = next(
            (
                f
                for f in (folder, folder / "fragments", folder / f"{folder.name}-fragments-ply")
                if f.is_dir() and fragment_numbers(f)
            ),
            None,
        )
        if self.fragments is None:
            sys.exit(f"error: {folder}: there is no cloud_bin_<i>.ply or .pcd")
        # Beside the fragments, or in a sibling as 3DMatch and Redwood have it.
        siblings = [
            folder.parent / f"{prefix}{folder.name}-evaluation" for prefix in ("", "iclnuim-")
        ]
        self.truth = first_with(
            [
                self.fragments,
                folder,
                folder / "evaluation",
                folder / f"{folder.name}-evaluation",
                *siblings,
            ],
            "gt.log",
        )
        if self.truth is None:
            sys.exit(
                f"error: {folder}: there is no gt.log beside the fragments, nor in {siblings[0]}"
            )
        self.recall_logs = sorted(self.truth.glob("official_*_gt.log"))
        self.recall_logs = [log for log in self.recall_logs if "predator" not in log.name]
        if self.truth.name.endswith("-evaluation") and not self.truth.name.startswith("iclnuim-"):
            self.recall_logs.append(self.truth / "gt.log")
        self.check()

    def check(self):
        """Every fragment that the truth names must be there."""
        there = fragment_numbers(self.fragments)
        block = 0
        for number, line in enumerate((self.truth / "gt.log").read_text().splitlines(), 1):
            if not line.strip():
                continue
            if block % 5 == 0:
                fields = line.split()
                if len(fields) != 3 or not all(field.isdigit() for field in fields):
                    sys.exit(
                        f"error: {self.truth / 'gt.log'}:{number}: a block starts with '{line.strip()[:40]}', expected i j n"
                    )
                for index in map(int, fields[:2]):
                    if index not in there:
                        sys.exit(
                            f"error: {self.truth / 'gt.log'}:{number}: pair {fields[0]} {fields[1]}: there is no cloud_bin_{index}.ply in {self.fragments}"
                        )
            block += 1
