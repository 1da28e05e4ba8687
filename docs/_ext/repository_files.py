# SPDX-License-Identifier: BSD-3-Clause
"""Links from pages to files of the repository, and pages that are files of its root.

A page links to a file as it does on the forge, relative to its own place:
``../include/gpureg/result.hpp``. On the site a link to a public header goes to its reference page,
and any other one to the forge, see conf.py. A file that does not exist is a warning.
"""

import os
import pathlib
import re

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging

DOCS = pathlib.Path(__file__).resolve().parents[1]
ROOT = DOCS.parent
LINK = re.compile(r"(?<=\])\((?!https?:|mailto:|#)([^()\s#]*[/.][^()\s#]*)(#[^()\s]+)?\)")
FENCE = re.compile(r"^(```.*?^```|    [^\n]*)$", re.DOTALL | re.MULTILINE)
logger = logging.getLogger(__name__)


def site_link(link: re.Match, folder: pathlib.Path, page: pathlib.Path, source: str) -> str:
    path, anchor = (folder / link[1]).resolve(), link[2] or ""
    if not path.is_relative_to(ROOT) or not path.exists():
        logger.warning("link to a file that does not exist: %s", link[1], location=source)
        return link[0]
    header = DOCS / "reference" / "cpp" / f"{path.stem}.md"
    if path.parent == ROOT / "include" / "gpureg" and header.exists():
        path = header
    if path.parent.parent == ROOT / "examples" and path.suffix in (".cpp", ".py"):
        path, anchor = DOCS / "examples.md", f"#{path.name.replace('.', '')}"
    elif path == ROOT / "examples" / "README.md":
        path = DOCS / "examples.md"
    elif path in (ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md"):
        path = DOCS / path.name.lower()
    if path.is_relative_to(DOCS) and path.suffix in (".md", ".png", ".webp"):
        return f"({os.path.relpath(path, page.parent)}{anchor})"
    return f"(repository:{path.relative_to(ROOT)}{anchor})"


def rewrite(text: str, folder: pathlib.Path, page: pathlib.Path, source: str) -> str:
    """The text with links as the site has them; those in code stay."""
    parts = FENCE.split(text)
    for k in range(0, len(parts), 2):
        parts[k] = LINK.sub(lambda link: site_link(link, folder, page, source), parts[k])
    return "".join(parts)


def read_page(app: Sphinx, name: str, content: list[str]) -> None:
    page = DOCS / f"{name}.md"
    content[0] = rewrite(content[0], page.parent, page, name)


def read_included(app: Sphinx, path: pathlib.Path, name: str, content: list[str]) -> None:
    if path.suffix == ".md":
        folder = (DOCS / path).resolve().parent
        content[0] = rewrite(content[0], folder, DOCS / f"{name}.md", name)


def resolve(app: Sphinx, tree: nodes.document) -> None:
    forge = app.config.repository_url.rstrip("/")
    for link in list(tree.findall(nodes.reference)):
        target = link.get("refuri", "")
        if not target.startswith("repository:"):
            continue
        path = target.removeprefix("repository:")
        if forge:
            kind = "tree" if (ROOT / path.split("#")[0]).is_dir() else "blob"
            link["refuri"] = f"{forge}/{kind}/main/{path}"
        else:
            text = nodes.inline("", "", *link.children, classes=["repository-file"])
            link.replace_self(text)


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_config_value("repository_url", "", "html")
    app.connect("source-read", read_page)
    app.connect("include-read", read_included)
    app.connect("doctree-read", resolve)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
