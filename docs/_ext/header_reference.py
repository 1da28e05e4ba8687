# SPDX-License-Identifier: BSD-3-Clause
"""Directive ``header``: everything that one public header declares, in its order."""

import pathlib
import re
import xml.etree.ElementTree as ElementTree

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.nodes import nested_parse_with_titles

KINDS = ("class", "struct", "enum", "typedef", "function", "variable")


def compounds(folder: pathlib.Path, pattern: str) -> list[ElementTree.Element]:
    return [ElementTree.parse(f).getroot().find("compounddef") for f in folder.glob(pattern)]


def signature(member: ElementTree.Element) -> str:
    types = ("".join(p.find("type").itertext()) for p in member.findall("param"))
    return f"{member.findtext('qualifiedname')}({', '.join(types)})"


def declared(folder: pathlib.Path, header: str) -> list[tuple[int, str, str]]:
    """(line, kind, name) of what a header of include/gpureg declares, members of classes left out."""
    found = []

    def add(node: ElementTree.Element, name: str) -> None:
        location = node.find("location")
        if location.get("file").endswith(f"gpureg/{header}") and node.get("kind") in KINDS:
            found.append((int(location.get("line")), node.get("kind"), name))

    for kind in ("class", "struct"):
        for compound in compounds(folder, f"{kind}gpureg_*.xml"):
            add(compound, compound.findtext("compoundname"))
    for compound in compounds(folder, "namespacegpureg*.xml"):
        for member in compound.iter("memberdef"):
            function = member.get("kind") == "function"
            add(member, signature(member) if function else member.findtext("qualifiedname"))
    return sorted(found)


class Header(Directive):
    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        environment = self.state.document.settings.env
        folder = pathlib.Path(environment.config.breathe_projects["gpureg"])
        header = self.arguments[0]
        environment.note_dependency(str(folder / "index.xml"))
        lines = []
        for _, kind, text in declared(folder, header):
            lines += [f"```{{doxygen{kind}}} {re.sub(r' +', ' ', text)}"]
            lines += [":members:", ":undoc-members:"] if kind in ("class", "struct") else []
            lines += ["```", ""]
        container = nodes.container()
        nested_parse_with_titles(self.state, StringList(lines, source=header), container)
        return container.children


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("header", Header)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
