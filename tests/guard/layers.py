# SPDX-License-Identifier: BSD-3-Clause
"""Every folder includes only what the table of CONTRIBUTING.md (Layers) lets it include."""

import pathlib
import re

INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)
SOURCES = {".cpp", ".hpp", ".cu", ".cuh"}


def table(root: pathlib.Path) -> dict[str, set[str]]:
    """Folder -> folders and public headers that it may include, of the rows `folder` | `folder`, ..."""
    lines = (root / "CONTRIBUTING.md").read_text().partition("| folder | may include |")[2]
    out: dict[str, set[str]] = {}
    for line in lines.split("\n\n")[0].splitlines()[2:]:
        folders, allowed = (re.findall(r"`([^`]+)`", cell) for cell in line.split("|")[1:3])
        for folder in folders:
            out[folder] = {"*"} if "everything" in line else set(allowed)
    return out


def folder_of(root: pathlib.Path, include: str, folders: set[str]) -> str:
    """The folder of the table that a header belongs to; empty for those beside the file."""
    places = [f"include/{include}", f"src/{include}", include]
    found = next((place for place in places if (root / place).is_file()), "")
    return next((f for f in folders if found.startswith(f + "/")), "")


def complaints(root: pathlib.Path) -> list[str]:
    if not (root / "CONTRIBUTING.md").is_file():
        return []
    rows = table(root)
    found = [
        f"{path.relative_to(root).as_posix()} has no row in the table of CONTRIBUTING.md"
        for path in sorted((root / "src").iterdir())
        if path.is_dir() and path.relative_to(root).as_posix() not in rows
    ]
    for folder, allowed in rows.items():
        public = {header for header in allowed if header.startswith("gpureg/")}
        for path in sorted((root / folder).rglob("*")):
            if path.suffix not in SOURCES or "*" in allowed:
                continue
            for include in INCLUDE.findall(path.read_text()):
                to = folder_of(root, include, set(rows))
                if to in allowed | {"", folder}:
                    continue
                if to == "include/gpureg" and (not public or include in public):
                    continue
                name = path.relative_to(root).as_posix()
                found.append(f"{name} includes {include}, which CONTRIBUTING.md does not list")
    return found
