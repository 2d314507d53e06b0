"""The documentation is complete and its links resolve; `make docs` also checks the built pages."""

from __future__ import annotations

import os
import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import feedplan

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))
TEXTS = [*PAGES, *ROOT.glob("*.md")]
# The folder in which `make docs` has built the pages.
BUILT = os.environ.get("FEEDPLAN_DOCS")
built = pytest.mark.skipif(BUILT is None, reason="make docs builds the pages and checks them")

_DIRECTIVE = re.compile(r"^```\{(include|literalinclude)\} (\S+)\n((?::.*\n)*)", re.MULTILINE)
_MARK = re.compile(r':(start-after|start-at|end-before|end-at): "?(.*?)"?$', re.MULTILINE)
_LINK = re.compile(r"\]\(([^)\s]+)\)")


def name_of(file: Path) -> str:
    return file.relative_to(ROOT).as_posix()


def test_every_public_name_is_once_in_the_reference() -> None:
    text = (DOCS / "api.md").read_text("utf-8")
    shown = re.findall(r"^\.\. auto(?:class|exception|function):: (\w+)(?:\(\))?$", text, re.MULTILINE)
    assert sorted(shown) == sorted(feedplan.__all__)


def test_every_page_is_in_the_contents() -> None:
    text = (DOCS / "index.md").read_text("utf-8")
    contents = text.split("```{toctree}\n:hidden:\n", 1)[1].split("```", 1)[0].split()
    assert sorted(["index", *contents]) == [page.stem for page in PAGES]


@pytest.mark.parametrize("page", TEXTS, ids=name_of)
def test_links_resolve_to_files_and_headings(page: Path) -> None:
    for link in _LINK.findall(page.read_text("utf-8")):
        parts = urlsplit(link)
        if parts.scheme:
            continue
        file = page.parent / unquote(parts.path) if parts.path else page
        assert file.is_file(), link
        headings = re.findall(r"^#+ (.*)", file.read_text("utf-8"), re.MULTILINE) if parts.fragment else []
        anchors = [re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings]
        assert not parts.fragment or parts.fragment in anchors, link


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_included_parts_of_other_files_exist(page: Path) -> None:
    for _, path, options in _DIRECTIVE.findall(page.read_text("utf-8")):
        file = page.parent / path
        if file.parent == ROOT / "docs" / ".." / "out" / "examples":  # the output of a script
            assert (ROOT / "examples" / f"{file.stem}.py").is_file(), path
            continue
        lines = file.read_text("utf-8").splitlines()
        places = [
            [number for number, line in enumerate(lines) if mark in line]
            for _, mark in _MARK.findall(options)
        ]
        assert all(places), f"{path}: {options}"
        assert sorted(places) == places, f"{path}: {options}"
        if file.suffix == ".md":
            assert all(len(found) == 1 for found in places), f"{path}: {options}"


def test_each_section_of_the_first_page_is_shown() -> None:
    """Every section of README.md except the first, which begins the first page, and the last is on a page."""
    shown = "".join(page.read_text("utf-8") for page in PAGES)
    headings = re.findall(r"^###? .*", (ROOT / "README.md").read_text("utf-8"), re.MULTILINE)
    missing = [heading for heading in headings[1:-1] if f':start-after: "{heading}"' not in shown]
    assert missing == []


def test_numbered_examples_are_shown() -> None:
    shown = "".join(page.read_text("utf-8") for page in PAGES)
    scripts = sorted(path.stem for path in (ROOT / "examples").glob("[0-9]_*.py"))
    assert len(scripts) == 4
    for script in scripts:
        assert f"literalinclude}} ../examples/{script}.py" in shown
        assert f"literalinclude}} ../out/examples/{script}.txt" in shown


def test_files_and_commands_named_to_contributors_exist() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    makefile = (ROOT / "Makefile").read_text("utf-8")
    for target in re.findall(r"\bmake ([a-z]+)\b", text):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target
    folders = "tests|feedplan|solvers|docs|examples|page|benchmarks"
    for path in re.findall(rf"(?<![\w./-])(?:{folders})/[\w./-]*", text):
        if not re.search(r"my[-_]", path):  # a file that the reader writes
            assert (ROOT / path.rstrip(".")).exists(), path


class Page(HTMLParser):
    """What a page loads, the targets of its links, and its ids."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.links: list[str] = []
        self.ids: set[str] = set()
        self.feed(file.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.ids |= {given["id"]} if "id" in given else set()
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        else:
            self.loads += [given[name] for name in ("src", "href") if name in given]


@built
def test_built_pages_load_nothing_from_elsewhere_and_their_links_resolve() -> None:
    folder = ROOT / str(BUILT)
    pages = {file.resolve(): Page(file) for file in folder.glob("*.html")}
    assert {page.stem for page in PAGES} <= {file.stem for file in pages}
    for file, page in pages.items():
        for link in page.loads + page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                assert link in page.links or parts.scheme == "data", f"{file.name} loads {link}"
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            assert target.exists(), f"{file.name}: {link}"
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].ids, f"{file.name}: {link}"
    for style in folder.rglob("*.css"):
        assert not re.search(r"(?:url\(|@import)\s*['\"]?(?:https?:)?//", style.read_text("utf-8")), style
