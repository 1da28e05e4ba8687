# SPDX-License-Identifier: BSD-3-Clause
"""Imports the Python package from the checkout, where nothing is compiled.

The stubs ``_core.pyi`` stand in for the compiled module: they are Python. They have no docstrings,
so a class or field without one gets what the C++ header says about its namesake.
"""

import __future__

import importlib.machinery
import importlib.util
import pathlib
import sys
import xml.etree.ElementTree as ElementTree
from typing import Any

from sphinx.application import Sphinx
from sphinx.util import logging

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python"
logger = logging.getLogger(__name__)


class StubLoader(importlib.machinery.SourceFileLoader):
    def source_to_code(self, data: Any, path: Any, **_: Any) -> Any:
        # Stubs name types before they are defined.
        flags = __future__.annotations.compiler_flag
        return compile(data, path, "exec", flags=flags, dont_inherit=True)


def import_package() -> None:
    name, path = "gpureg._core", PACKAGE / "gpureg" / "_core.pyi"
    loader = StubLoader(name, str(path))
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    sys.path.insert(0, str(PACKAGE))
    writes_bytecode, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    module.__version__ = ""
    loader.exec_module(module)
    import gpureg

    gpureg._core = module
    sys.dont_write_bytecode = writes_bytecode


def text_of(node: ElementTree.Element | None) -> str:
    return " ".join("".join(node.itertext()).split()) if node is not None else ""


def header_comments(folder: pathlib.Path) -> dict[str, str]:
    """Comments of the C++ classes and their members, by Python's names."""
    comments = {}
    for file in [*folder.glob("structgpureg_*.xml"), *folder.glob("classgpureg_*.xml")]:
        compound = ElementTree.parse(file).getroot().find("compounddef")
        name = compound.findtext("compoundname").split("::")[-1]
        for key, node in [
            (name, compound),
            *((f"{name}.{m.findtext('name')}", m) for m in compound.iter("memberdef")),
        ]:
            parts = (text_of(node.find(f"{kind}description")) for kind in ("brief", "detailed"))
            comments.setdefault(key, "\n\n".join(part for part in parts if part))
    return comments


def describe(app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    if any(line.strip() for line in lines):
        return
    comments = app.gpureg_comments
    comment = comments.get(name.removeprefix("gpureg."), "")
    if comment:
        # Words of C++ are no markup of reStructuredText.
        lines[:] = [line.replace("*", r"\*").replace("_", r"\_") for line in comment.split("\n")]


def public_name(app: Sphinx, environment: Any, node: Any, content: Any) -> Any:
    """What users import from gpureg is documented there, wherever it is defined."""
    if node.get("refdomain") != "py":
        return None
    name = f"gpureg.{node['reftarget'].split('.')[-1]}"
    return environment.get_domain("py").resolve_xref(
        environment, node["refdoc"], app.builder, "obj", name, node, content
    )


def everything_public_is_on_a_page(app: Sphinx, environment: Any) -> None:
    import gpureg

    documented = environment.get_domain("py").objects
    for name in gpureg.__all__:
        if f"gpureg.{name}" not in documented and not name.startswith("_"):
            logger.warning("gpureg.%s is not in docs/reference/python.md", name)


def start(app: Sphinx) -> None:
    app.gpureg_comments = header_comments(pathlib.Path(app.config.breathe_projects["gpureg"]))


def setup(app: Sphinx) -> dict[str, bool]:
    import_package()
    app.connect("builder-inited", start)
    app.connect("env-check-consistency", everything_public_is_on_a_page)
    app.connect("missing-reference", public_name)
    app.connect("autodoc-process-docstring", describe)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
