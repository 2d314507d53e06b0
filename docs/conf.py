"""How Sphinx builds the documentation: `make docs`. No page loads anything from the network."""

from __future__ import annotations

from sphinx.application import Sphinx

import feedplan

project = "feedplan"
author = "The feedplan developers"
copyright = author
version = release = feedplan.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc"]
# The pages are Markdown, as README.md is, so that they can include parts of it.
source_suffix = {".md": "markdown"}
myst_heading_anchors = 3
myst_enable_extensions = ["deflist"]

# Code blocks without a language have no colours.
highlight_language = "none"

html_theme = "furo"
html_title = f"feedplan {version}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_show_copyright = False
html_copy_source = False

# Docstrings are plain text with names in single backticks.
default_role = "code"
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
maximum_signature_line_length = 80
add_module_names = False


def as_written(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Makes reStructuredText of plain docstrings: escapes `|`; indented lines after a colon become code."""
    for place, line in enumerate(lines):
        words = line.split("`")
        words[::2] = [word.replace("|", r"\|") for word in words[::2]]
        lines[place] = "`".join(words)
        after = next((line for line in lines[place + 1 :] if line.strip()), "")
        is_paragraph = place + 1 < len(lines) and not lines[place + 1].strip()
        if line.endswith(":") and is_paragraph and _indent(after) > _indent(line):
            lines[place] += ":"


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("autodoc-process-docstring", as_written)
