#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the links inside a built site and inside the Markdown files of the repository.

    docs/_ext/check_links.py build/docs/html

Of a site every local link, image and anchor must exist. Of Markdown files every relative link must
be a file, and every anchor a heading. Links to other hosts are not followed. Exit status 1 where a
link is dead.
"""

import argparse
import html.parser
import pathlib
import re
import subprocess
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
MARKDOWN_LINK = re.compile(r"\]\(([^()\s]+)\)")
CODE = re.compile(r"^```.*?^```|^    [^\n]*$|`[^`\n]*`", re.DOTALL | re.MULTILINE)
HEADING = re.compile(r"^#+ +(.*)$", re.MULTILINE)


class Page(html.parser.HTMLParser):
    """Anchors and local links of one page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        for name, value in attributes:
            if name in ("id", "name") and value:
                self.anchors.add(value)
            elif name in ("href", "src") and value:
                self.links.append(value)


def is_local(link: str) -> bool:
    return not urllib.parse.urlsplit(link).scheme and not link.startswith("//")


def dead_links_of_site(site: pathlib.Path) -> tuple[int, list[str]]:
    pages = {path: Page(path.read_text()) for path in sorted(site.rglob("*.html"))}
    checked, dead = 0, []
    for path, page in pages.items():
        for link in filter(is_local, page.links):
            parts = urllib.parse.urlsplit(link)
            target = (
                (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            )
            anchor = urllib.parse.unquote(parts.fragment)
            checked += 1
            if not target.is_file():
                dead.append(f"{path.relative_to(site)}: {link}: no such file")
            elif anchor and target in pages and anchor not in pages[target].anchors:
                dead.append(f"{path.relative_to(site)}: {link}: no such anchor")
    return checked, dead


def heading_anchors(text: str) -> set[str]:
    """As forges make them: lower case, punctuation dropped, spaces become hyphens."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    words = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in HEADING.findall(text))
    return {heading.strip().replace(" ", "-") for heading in words}


def dead_links_of_markdown() -> tuple[int, list[str]]:
    listed = subprocess.run(
        ["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    checked, dead = 0, []
    for name in listed.stdout.split():
        path = ROOT / name
        for link in filter(is_local, MARKDOWN_LINK.findall(CODE.sub("", path.read_text()))):
            place, _, anchor = link.partition("#")
            target = (path.parent / place).resolve() if place else path
            checked += 1
            if not target.exists():
                dead.append(f"{name}: {link}: no such file")
            elif anchor and target.suffix == ".md":
                if anchor not in heading_anchors(target.read_text()):
                    dead.append(f"{name}: {link}: no such heading")
    return checked, dead


parser = argparse.ArgumentParser(
    description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
)
parser.add_argument("site", type=pathlib.Path, help="folder of the built site")
in_site, dead_in_site = dead_links_of_site(parser.parse_args().site.resolve())
in_markdown, dead_in_markdown = dead_links_of_markdown()
for line in dead_in_site + dead_in_markdown:
    print(f"dead link: {line}")
print(f"links: {in_site} in the site, {in_markdown} in Markdown files")
sys.exit(1 if dead_in_site or dead_in_markdown else 0)
