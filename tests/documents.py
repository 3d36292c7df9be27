"""The project's texts, as several tests read them: pages, command lines, and blocks that belong into a file."""

import os
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
NOT_OURS = {"__pycache__", "data", "build", "gpca_bench.egg-info"}  # the last two are left by pip
HIDDEN = {".ci", ".github", ".gitignore", ".pre-commit-config.yaml", ".snakemake-workflow-catalog.yml"}


def our_files():
    """All text files of the project; of results/ only what git keeps, of hidden ones those of `HIDDEN`."""
    for folder, folders, names in os.walk(ROOT):
        here = Path(folder).relative_to(ROOT)
        kept = {"reference"} if here == Path("results") else set(folders) - NOT_OURS
        folders[:] = sorted(name for name in folders if name in kept and (name[0] != "." or name in HIDDEN))
        for name in sorted(name for name in names if name[0] != "." or name in HIDDEN):
            path = Path(folder, name)
            if path.suffix not in {".png", ".pdf", ".npz", ".pt", ".log", ".so", ".ply"}:
                yield path


def relative(path):
    return str(path.relative_to(ROOT))


PAGES = [path for path in our_files() if path.suffix == ".md" and "reference" not in path.parts]


def code_in(text):
    """Command lines in fenced blocks, without their comments, and spans of code in the running text."""
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    lines = command_lines(text)
    return [code for code in (*lines, *re.findall(r"`([^`\n]+)`", prose)) if code and not code.startswith("#")]


def command_lines(text):
    """Command lines in fenced blocks, without their comments."""
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return [line.split("  #")[0].strip() for block in blocks for line in block.splitlines()]


def tasks_beside_a_clone():
    """The six tasks that docs/tasks.md shows whole: title -> text."""
    _, beside, _ = re.split(r"^## .+$", (ROOT / "docs/tasks.md").read_text(), flags=re.MULTILINE)
    _, *parts = re.split(r"^### (.+) \(\d+ minutes\)$", beside, flags=re.MULTILINE)
    return dict(zip(parts[::2], parts[1::2], strict=True))


def section(page, anchor):
    """The text below the heading with that anchor, up to the next one of its level."""
    parts = re.split(r"^(##+ .+)$", page.read_text(), flags=re.MULTILINE)
    found = [text for head, text in zip(parts[1::2], parts[2::2], strict=True) if anchor_of(head) == anchor]
    assert found, f"{relative(page)} has no heading '{anchor}'"
    return found[0]


def anchor_of(heading):
    """The anchor that is made from a heading's text."""
    name = re.sub(r"\]\(.*?\)", "", heading.lstrip("# "))
    return re.sub(r"[^\w -]", "", name).strip().lower().replace(" ", "-")


def commands(program):
    """Every different command of that program on any page."""
    found = {code for page in PAGES for code in code_in(page.read_text()) if code.startswith(program)}
    assert found, f"no page names a command of {program}"
    return sorted(found)


def blocks_of(page):
    """Fenced blocks of a page whose first line names the file they belong to, in order: (file, text)."""
    return blocks_in((ROOT / page).read_text())


def blocks_in(text):
    """The same, of a text."""
    fenced = re.findall(r"^```\w+\n# (\S+\.\w+)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert fenced
    return fenced


def block(file, containing="", page="docs/adding.md"):
    """The one block of the page that belongs into that file and contains that text."""
    [text] = [text for name, text in blocks_of(page) if name == file and containing in text]
    return text
