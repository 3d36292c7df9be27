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
root_doc = "README"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_gallery.gen_gallery"]

EXECUTED = "build/docs/executed"  # where the tutorial is put as it ran
include_patterns = [
    *("*.md", "docs/*.md", "docs/*.rst", "*/README.md", "data/*/LICENSE.md", "examples/*/README.md"),
    *("results/*/README.md", "results/reference/*/*.md", "results/reference/*/tables/*.md", "gpca/model/shipped.md"),
    f"{EXECUTED}/tutorial.rst",
]
# Else all files of all runs and of all packages are looked at.
exclude_patterns = [".*", "build/[!d]*", "build/docs/[!e]*", "downloads", "tests", "results/[!Rlr]*"]

myst_heading_anchors = 4
suppress_warnings = [
    "toc.not_included",  # tables of the reference, to which pages link
    "myst.header",  # these have no heading
    "misc.highlighting_failure",  # rules of Snakemake are shown as Python
]

sphinx_gallery_conf = {  # runs the tutorial, and shows what it printed and drew
    "examples_dirs": "docs",
    "gallery_dirs": EXECUTED,
    "filename_pattern": r"/tutorial\.py$",
    "ignore_pattern": r"^(?!tutorial\.py$)",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "write_computation_times": False,
}

default_role = "literal"  # docstrings write `code` as Markdown does
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
napoleon_use_ivar = True
napoleon_numpy_docstring = False


def with_menu(_app, name: str, source: list[str]) -> None:
    """Lead to the tutorial as it ran, and give the first page a table of contents for the menu beside each page."""
    source[0] = re.sub(r"\]\((?:docs/)?tutorial\.py\)", f"](/{EXECUTED}/tutorial.rst)", source[0])
    if name != root_doc:
        return
    rows = re.findall(r"^\| (.+?) \| (.*\]\(docs/.*) \|$", source[0].split("## Documentation")[1], flags=re.MULTILINE)
    for head, text in rows:
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
