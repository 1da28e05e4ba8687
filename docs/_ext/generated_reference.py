# SPDX-License-Identifier: BSD-3-Clause
"""Writes the reference pages before Sphinx looks for them: one for each public header, and one with
what ``gpureg VERB --help`` prints. git ignores them.

GPUREG_COMMAND: the command, build/cpu/bin/gpureg if not set.
"""

import os
import pathlib
import re
import subprocess

from sphinx.application import Sphinx

DOCS = pathlib.Path(__file__).resolve().parents[1]
ROOT = DOCS.parent
HEADERS = ROOT / "include" / "gpureg"
PAGES = DOCS / "reference"
INCLUDE = re.compile(r'^#include "gpureg/([^"]+)"', re.MULTILINE)


def included_by(header: str) -> set[str]:
    """The header and every public header that it brings."""
    found, waiting = set(), [header]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += INCLUDE.findall((HEADERS / name).read_text())
    return found


def header_page(stem: str) -> str:
    """A folder of the same name holds the parts of a header, or headers of one subject."""
    whole = [f"{stem}.hpp"] if (HEADERS / f"{stem}.hpp").exists() else []
    parts = sorted(f"{stem}/{path.name}" for path in (HEADERS / stem).glob("*.hpp"))
    included = "\n".join(f"#include <gpureg/{name}>" for name in whole or parts)
    shown = "".join(f"\n```{{header}} {name}\n```\n" for name in [*whole, *parts])
    return f"# {whole[0] if whole else stem}\n```cpp\n{included}\n```\n{shown}"


def toctree(caption: str, stems: list[str]) -> str:
    pages = "\n".join(f"cpp/{stem}" for stem in stems)
    return f"```{{toctree}}\n:caption: {caption}\n:maxdepth: 1\n{pages}\n```\n"


def cpp_page(stems: list[str]) -> str:
    core = {pathlib.PurePath(name).stem for name in included_by("gpureg.hpp")}
    return "\n".join(
        [
            "# C++ reference\nOne page for each public header.\n",
            toctree("With gpureg/gpureg.hpp", [stem for stem in stems if stem in core]),
            toctree("Included by name", [stem for stem in stems if stem not in core]),
        ]
    )


def help_of(command: str, *verb: str) -> str:
    environment = {**os.environ, "COLUMNS": "100"}
    done = subprocess.run(
        [command, *verb, "--help"], capture_output=True, text=True, check=True, env=environment
    )
    text = "\n".join(line.rstrip() for line in done.stdout.strip().splitlines())
    return f"```text\n{text}\n```\n"


def command_page(command: pathlib.Path) -> str:
    if not command.exists():
        return "# The command\n`gpureg --help` lists the verbs, `gpureg VERB --help` the options.\n"
    overview = help_of(str(command))
    listed = re.split(r"^subcommands:\n", overview, flags=re.IGNORECASE | re.MULTILINE)[1]
    verbs = [line.split()[0] for line in listed.split("\n\n")[0].splitlines()]
    pages = [f"## gpureg {verb}\n{help_of(str(command), verb)}" for verb in verbs]
    return "\n".join(["# The command\n" + overview, *pages])


def write(path: pathlib.Path, text: str) -> None:
    """Leaves an equal page as it is, so that Sphinx need not read it again."""
    if not path.exists() or path.read_text() != text:
        path.write_text(text)


def write_pages(app: Sphinx) -> None:
    (PAGES / "cpp").mkdir(exist_ok=True)
    folders = {path.parent.name for path in HEADERS.glob("*/*.hpp")}
    stems = sorted({path.stem for path in HEADERS.glob("*.hpp")} - {"gpureg"} | folders)
    for page in (PAGES / "cpp").glob("*.md"):
        if page.stem not in stems:
            page.unlink()
    for stem in stems:
        write(PAGES / "cpp" / f"{stem}.md", header_page(stem))
    write(PAGES / "cpp.md", cpp_page(stems))
    command = os.environ.get("GPUREG_COMMAND", ROOT / "build/cpu/bin/gpureg")
    write(PAGES / "command.md", command_page(pathlib.Path(command)))


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("builder-inited", write_pages, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
