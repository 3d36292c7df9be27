"""Fill the numbers of the reference into the pages, or check that they are there.

    python docs/fill.py            # writes what differs, and lists it: read the sentences around it again
    python docs/fill.py --check    # writes nothing; the exit status is 1 if something differs

A page marks a number by a comment behind it, `98.7<!--gpca_paper-->`, and a longer passage by a line before it and one
behind it, `<!--begin verdicts-->` and `<!--end verdicts-->`. A sentence in words stands on a condition,
`<!--if best_gate-->`; where this no longer holds, the sentence has to be rewritten, and the exit status is 1.
docs/numbers.yaml defines all of them.
"""

from __future__ import annotations

import argparse
import csv
import math
import re
import shlex
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from statistics import fmean

import yaml

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
from benchmarks import markdown  # noqa: E402 (the script runs from a plain checkout)
from gpca.errors import InputError  # noqa: E402
from gpca.io.files import whole_file  # noqa: E402

DEFINITIONS = Path(__file__).with_name("numbers.yaml")
REFERENCES = ROOT / "results/reference"
NUMBER = re.compile(r"(?<![\w.])(-?\d[\d.]*)<!--(\w+)-->")
PASSAGE = re.compile(r"(?<=<!--begin )(\w+)-->\n(.*?)(?=<!--end \1-->)", re.DOTALL)
CONDITION = re.compile(r"<!--if (\w+)-->")
MARKER = re.compile(r"<!--(?:begin |if )?(\w+)-->")
LINK = re.compile(r"\]\([^)\s]*results/reference/(\w+)/")
NUMBER_OF_TEXT = re.compile(r"\[\[(.+?)\]\]")
OF_SEVERAL_ROWS: dict[str, Callable] = {"min": min, "max": max, "mean": fmean}
LINE = 120  # letters


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; exit with 1 if a page differs")
    check = parser.parse_args(arguments).check
    try:
        references, pages = read_definitions()
        texts = {page: (ROOT / page).read_text(encoding="utf-8") for page in pages}
        folders = {page: REFERENCES / reference for page, reference in references.items()}
        new = {page: filled(texts[page], pages[page], page, folders[page]) for page in pages}
        untrue = {page: no_longer_true(texts[page], pages[page], folders[page]) for page in pages}
        untrue = {page: [*lines, *links_elsewhere(texts[page], references[page])] for page, lines in untrue.items()}
    except KeyError as fault:
        print(f"fill: {DEFINITIONS.name}: lacks the key {fault}; add it", file=sys.stderr)
        return 2
    except (InputError, OSError, yaml.YAMLError) as fault:
        print(f"fill: {fault}", file=sys.stderr)
        return 2
    for page, (text, changes) in new.items():
        print("".join(f"{page}: {line}\n" for line in (*changes, *untrue[page])), end="")
        if changes and not check:
            with whole_file(ROOT / page) as partial:
                partial.write_text(text, encoding="utf-8")
    return int(any(untrue.values()) or (check and any(changes for _, changes in new.values())))


def read_definitions() -> tuple[dict[str, str], dict[str, dict]]:
    """Return of every page the name of the reference that its numbers are of, and what its markers are."""
    pages = yaml.safe_load(DEFINITIONS.read_text(encoding="utf-8"))
    usual = pages.pop("reference")
    return {page: markers.pop("reference", usual) for page, markers in pages.items()}, pages


def links_elsewhere(text: str, reference: str) -> list[str]:
    """Return a line about each link of a page to results of another reference than the one its numbers are of."""
    others = sorted({name for name in LINK.findall(text) if name != reference})
    return [f"links to results/reference/{name}, but its numbers are of {reference}" for name in others]


def filled(text: str, definitions: dict, page: str, folder: Path) -> tuple[str, list[str]]:
    """Return the page's text with the numbers of the reference in that folder, and a line about each that changed.

    Raises:
        InputError: the page marks what is not defined or the reverse, a marker has no number before it or no end, or
            the reference does not have what a definition names.
    """
    marked = set(MARKER.findall(text))
    fillable = {name for _, name in NUMBER.findall(text)} | {name for name, _ in PASSAGE.findall(text)}
    fillable |= set(CONDITION.findall(text))
    for names, fault, remedy in (
        (marked - fillable, "has no number before it, or no end", "write '0<!--NAME-->' or add '<!--end NAME-->'"),
        (marked - definitions.keys(), "is not defined", f"define it in docs/{DEFINITIONS.name}"),
        (definitions.keys() - marked, "is not on the page", f"remove it from docs/{DEFINITIONS.name}"),
    ):
        if names:
            raise InputError(f"{page}: marker '{min(names)}'", fault, remedy)
    changes = []

    def number(match: re.Match) -> str:
        old, name = match.groups()
        new = value(definitions[name], folder)
        if new != old:
            changes.append(f"{name}: {old} -> {new}")
        return f"{new}<!--{name}-->"

    def passage(match: re.Match) -> str:
        name, old = match.groups()
        new = passage_of(definitions[name], folder)
        wrapped = textwrap.fill(new, LINE, break_on_hyphens=False, subsequent_indent="  " * new.startswith("- "))
        new = f"\n{new if new.startswith('|') else wrapped}\n\n"
        if new != old:
            changes.append(f"{name}: written anew")
        return f"{name}-->\n{new}"

    return PASSAGE.sub(passage, NUMBER.sub(number, text)), changes


def no_longer_true(text: str, definitions: dict, folder: Path) -> list[str]:
    """Return a line about each comparison behind a sentence of the page that the reference contradicts."""
    lines = []
    for name in CONDITION.findall(text):
        for comparison in definitions[name]:
            if not holds(comparison, folder):
                lines.append(f"{name}: no longer holds ({comparison}); rewrite the sentence")
    return lines


def holds(comparison: str, folder: Path) -> bool:
    """Whether a comparison, X above Y or X reaches Y, is true of the reference."""
    with _named(comparison):
        greater, word, less = re.split(r" (above|reaches) ", comparison)
        difference = _difference(shlex.split(greater), folder) - _difference(shlex.split(less), folder)
    return difference > 0 or (difference == 0 and word == "reaches")


def passage_of(definition: str | dict, folder: Path) -> str:
    """Return the text of a longer passage: a table, a sentence chosen by the numbers, or what a file says."""
    if isinstance(definition, str):
        return value(definition, folder)
    return table(definition, folder) if "head" in definition else sentence(definition, folder)


def sentence(definition: dict, folder: Path) -> str:
    """Return the first of the `cases` that holds, with its `words` put in, perhaps about the best of some rows."""
    texts, most = dict(definition.get("words", {})), -math.inf
    for row, title in definition.get("best", {}).items():
        rows, column = _matching([*shlex.split(definition["of"]), f"explainer={row}"], folder)
        if rows and (number := float(rows[0][column])) > most:
            most = number
            texts |= {"BEST": row, "TITLE": title, "Title": title[0].upper() + title[1:]}
    for case in definition["cases"]:
        *comparisons, text = [_with(each, texts) for each in (*case.get("if", []), case["text"])]
        if all(holds(comparison, folder) for comparison in comparisons):
            return NUMBER_OF_TEXT.sub(lambda match: value(match[1], folder), text)
    raise InputError("cases", "none of them holds", "end them with one without 'if'")


def _with(text: str, words: dict[str, str]) -> str:
    for word, put in words.items():
        text = text.replace(word, put)
    return text


def table(definition: dict, folder: Path) -> str:
    """Return a Markdown table whose cells are of the words of their row and column, with a dash where none has them."""
    columns, rows = definition["columns"], definition["rows"]

    def cell(words: str) -> str:
        return value(words, folder) if _matching(shlex.split(words)[:-1], folder)[0] else "–"

    lines = [[title, *(cell(f"{row} {column}") for column in columns.values())] for title, row in rows.items()]
    return "\n".join(markdown.table([definition["head"], *columns], lines))


def value(definition: str, folder: Path) -> str:
    """Return the text that a definition of docs/numbers.yaml stands for.

    Raises:
        InputError: the reference does not have it, or has it more than once.
    """
    with _named(definition):
        words = shlex.split(definition)
        return _read(words, folder) if words[0] == "read" else format(_difference(words[:-1], folder), words[-1])


@contextmanager
def _named(definition: str) -> Iterator[None]:
    """Name the definition that cannot be read."""
    try:
        yield
    except InputError:
        raise
    except (KeyError, IndexError, ValueError, re.error) as fault:
        raise InputError(definition, f"cannot be read ({fault!r})", "see the head of docs/numbers.yaml") from fault


def _read(words: list[str], folder: Path) -> str:
    _, name, pattern = words
    matches = re.findall(pattern, _text(folder / name), re.MULTILINE | re.DOTALL)
    if len(matches) != 1:
        raise InputError(" ".join(words), f"matches {len(matches)} times", "name a pattern that matches once")
    return matches[0]


def _difference(words: list[str], folder: Path) -> float:
    if "minus" not in words:
        return _number(words, folder)
    at = words.index("minus")
    return _number(words[:at], folder) - _number(words[at + 1 :], folder)


def _number(words: list[str], folder: Path) -> float:
    if len(words) == 1:
        return float(words[0])
    if words[0] == "read":
        return float(_read(words, folder))
    if words[0] == "count":
        rows, column = _matching(words[1:], folder)
        return len({row[column] for row in rows}) if ":" in words[1] else len(rows)
    combine = OF_SEVERAL_ROWS.get(words[0])
    rows, column = _matching(words[1:] if combine else words, folder)
    if not rows or (len(rows) > 1 and not combine):
        raise InputError(" ".join(words), f"matches {len(rows)} rows", "name the words of one row, or min, max, mean")
    return (combine or fmean)(float(row[column]) for row in rows)


def _matching(words: list[str], folder: Path) -> tuple[list[dict[str, str]], str]:
    """Return the rows of the table `words[0]` in which every other word stands, and the column of the number."""
    name, _, column = words[0].partition(":")
    rows = _rows(folder / (name if name.endswith(".csv") else f"tables/{name}.csv"))
    return [row for row in rows if all(_stands_in(row, word) for word in words[1:])], column or "mean"


def _stands_in(row: dict[str, str], word: str) -> bool:
    key, equals, pattern = word.rpartition("=")
    cells = [row[key]] if equals else row.values()
    return any(fnmatchcase(cell, choice) for cell in cells for choice in pattern.split("|"))


@cache
def _rows(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(_text(path).splitlines()))


@cache
def _text(path: Path) -> str:
    if not path.is_file():
        raise InputError(path, "no such file", "name a file of the reference")
    return path.read_text(encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
