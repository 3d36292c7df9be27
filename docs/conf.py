"""Settings of Sphinx for the site, which `make docs` makes of the repository's pages and docstrings.

The source folder is that of the repository, so that the links of a page lead to the same files there and on the site.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
import gpca  # noqa: E402 (the site is made from a plain checkout)

project = "GP-CA Bench"
version = release = gpca.__version__
html_title = f"{project} {release}"
html_theme = "furo"
root_doc = "docs/README"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]

include_patterns = [
    *("*.md", "docs/*.md", "docs/*.rst", "*/README.md", "data/*/LICENSE.md", "examples/*/README.md"),
    *("results/*/README.md", "results/reference/*/*.md", "results/reference/*/tables/*.md", "gpca/model/shipped.md"),
]
exclude_patterns = [".*", "build", "downloads", "tests", "results/[!Rlr]*"]  # else all files of all runs are looked at

myst_heading_anchors = 4
suppress_warnings = [
    "toc.not_included",  # tables of the reference, to which pages link
    "myst.header",  # these have no heading
    "misc.highlighting_failure",  # rules of Snakemake are shown as Python
]

default_role = "literal"  # docstrings write `code` as Markdown does
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
napoleon_use_ivar = True
napoleon_numpy_docstring = False


def with_menu(_app, name: str, source: list[str]) -> None:
    """Give the index a table of contents of the pages that it lists, for the menu beside each page."""
    if name != root_doc:
        return
    parts = re.split(r"^## (.+)$", source[0], flags=re.MULTILINE)
    for head, text in zip(parts[1::2], parts[2::2], strict=True):
        pages = re.findall(r"\]\(([\w./]+)\.(?:md|rst)\)", text)
        source[0] += "\n".join(["", "```{toctree}", ":hidden:", f":caption: {head}", "", *pages, "```", ""])


def write_start(app, fault: Exception | None) -> None:
    """Lead from the folder itself, where servers and people look first, to the index."""
    if fault is None and app.builder.format == "html":
        page = f'<!doctype html><title>{project}</title><meta http-equiv="refresh" content="0; url={root_doc}.html">\n'
        Path(app.outdir, "index.html").write_text(page, encoding="utf-8")


def setup(app) -> None:
    """Let Sphinx call the two functions above."""
    app.connect("source-read", with_menu)
    app.connect("build-finished", write_start)
