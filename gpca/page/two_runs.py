"""Sets two runs side by side: what differs in their code and config, their verdicts, tables and figures."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os.path import commonpath, relpath
from pathlib import Path

from gpca.errors import InputError
from gpca.io.files import whole_file
from gpca.page.comparison import page_comparison
from gpca.page.page import read_provenance, render
from gpca.page.printed_table import PrintedTable, read_number, read_printed_table

SAME, DIFFERENT, APART, ALONE = "same", "different", "apart", "alone"  # what a cell is called, by how the two differ
CONFIG = "Config (SHA-256)"  # of all sections; which of them differ says more


@dataclass(frozen=True)
class TwoTables:
    """A table of both runs, cell by cell.

    Attributes:
        name, title, caption: as one of the runs has them.
        heads, labels: as in :class:`gpca.page.printed_table.PrintedTable`; those of the second alone come last.
        rows: the names of each row, and its cells ``{one, other, difference, kind}``.
        counts: of the kinds.
    """

    name: str
    title: str
    caption: str
    heads: Sequence[str]
    labels: int
    rows: Sequence[tuple[Sequence[str], Sequence[Mapping[str, str]]]]
    counts: Mapping[str, int]


def compare_tables(folders: tuple[Path, Path], titles: Mapping[str, str]) -> tuple[list[TwoTables], list[list[str]]]:
    """Return the tables that both folders have, and the names of those that only the first or only the second has.

    Args:
        folders: ``results/{run}`` of two runs, or their references.
        titles: what readers call the tables, in the order of the page.

    Raises:
        InputError: a folder without tables, or a table that is none.
    """
    names = []
    for folder in folders:
        names.append({path.stem for path in folder.glob("tables/*.md")})
        if not names[-1]:
            raise InputError(folder, "has no tables/*.md", "name the folder of a finished run, such as results/default")
    one, other = names
    shared = [name for name in titles if name in one & other] + sorted((one & other) - titles.keys())
    tables = [_two_tables(name, titles.get(name, name), folders) for name in shared]
    return tables, [sorted(one - other), sorted(other - one)]


def write_comparison(
    folders: tuple[Path, Path],
    tables: Sequence[TwoTables],
    alone: Sequence[Sequence[str]],
    titles: Mapping[str, str],
    path: Path,
) -> None:
    """Write the page of two runs; figures are shown from where they are.

    Args:
        folders: of the runs.
        tables, alone: as :func:`compare_tables` returns them.
        titles: of the tables and figures.
        path: the page.
    """
    text = render(
        "compare.html.jinja",
        names=_names(folders),
        facts=_facts(folders),
        sections=_differing_sections(folders),
        verdicts=_verdicts(folders),
        tables=tables,
        alone=alone,
        figures=_figures(folders, titles, path.parent),
    )
    with whole_file(path) as partial:
        partial.write_text(text, encoding="utf-8")


def _two_tables(name: str, title: str, folders: tuple[Path, Path]) -> TwoTables:
    one, other = (read_printed_table(folder / f"tables/{name}.md") for folder in folders)
    labels = min(one.labels, other.labels)
    heads = list(dict.fromkeys([*one.heads[labels:], *other.heads[labels:]]))
    of_one, of_other = _by_row(one, labels), _by_row(other, labels)
    rows = []
    for key in dict.fromkeys([*of_one, *of_other]):
        cells = [_cell(of_one.get(key, {}).get(head, ""), of_other.get(key, {}).get(head, "")) for head in heads]
        rows.append((key[:-1], cells))
    counts = Counter(cell["kind"] for _, cells in rows for cell in cells)
    return TwoTables(name, title, one.caption, [*one.heads[:labels], *heads], labels, rows, counts)


def _by_row(table: PrintedTable, labels: int) -> dict[tuple, dict[str, str]]:
    """Return names of a row, and how often they came before -> head -> text."""
    seen: Counter = Counter()
    rows = {}
    for row in table.rows:
        key = tuple(row[:labels])
        rows[*key, seen[key]] = dict(zip(table.heads[labels:], row[labels:], strict=True))
        seen[key] += 1
    return rows


def _cell(one: str, other: str) -> dict[str, str]:
    if one == other:
        return {"one": one, "other": "", "difference": "", "kind": SAME}
    cell = {"one": one, "other": other, "difference": "", "kind": DIFFERENT if one and other else ALONE}
    numbers = [read_number(text) for text in (one, other)]
    first, second = numbers
    if first is None or second is None:
        return cell
    difference = f"{second.value - first.value:+z.{max(first.decimals, second.decimals)}f}"
    return cell | {"difference": difference, "kind": APART if first.is_apart(second) else DIFFERENT}


def _names(folders: tuple[Path, Path]) -> list[str]:
    """Return the names of the runs; where these are the same, the paths from where they part."""
    paths = [folder.resolve() for folder in folders]
    names = [path.name for path in paths]
    return names if len(set(names)) > 1 else [relpath(path, commonpath(paths)) for path in paths]


def _tidy(folder: Path) -> list[Path]:
    """Return the files whose records say what a run was made with."""
    return sorted([*folder.glob("tables/*.csv"), *folder.glob("*.csv")])


def _facts(folders: tuple[Path, Path]) -> list[tuple[str, str, str]]:
    """Return what was recorded of either run, a line per kind of fact, where the two differ."""
    one, other = (read_provenance(_tidy(folder)) for folder in folders)
    kinds = [kind for kind in dict.fromkeys([*one, *other]) if kind != CONFIG]
    words = [{kind: ", ".join(facts.get(kind, ["–"])) for kind in kinds} for facts in (one, other)]
    lines = [(kind, words[0][kind], words[1][kind]) for kind in kinds]
    return [line for line in lines if line[1] != line[2]]


def _differing_sections(folders: tuple[Path, Path]) -> list[str]:
    """Return the sections of the config that are not the same in both runs, as far as files were made from them."""
    hashes = [_section_hashes(folder) for folder in folders]
    return sorted(
        section for section in hashes[0].keys() | hashes[1] if hashes[0].get(section) != hashes[1].get(section)
    )


def _section_hashes(folder: Path) -> dict[str, set[str]]:
    hashes: dict[str, set[str]] = {}
    for path in _tidy(folder):
        record = path.with_name(f"{path.name}.provenance.json")
        if record.is_file():
            for section, digest in (json.loads(record.read_text(encoding="utf-8"))["config_sha256"] or {}).items():
                hashes.setdefault(section, set()).add(digest)
    return hashes


def _verdicts(folders: tuple[Path, Path]) -> list[dict]:
    """Return the printed numbers whose verdicts differ, where both runs were compared with the paper."""
    compared = [page_comparison(folder / "comparison.csv") for folder in folders]
    one, other = ({} if each is None else _rows_of(each) for each in compared)
    return [
        {
            "table": key[0],
            "row": key[1],
            "column": key[2],
            "published": row["published"],
            "one": row,
            "other": other[key],
        }
        for key, row in one.items()
        if key in other and row["verdict"] != other[key]["verdict"]
    ]


def _rows_of(comparison: Mapping) -> dict[tuple[str, str, str], dict]:
    rows = [row for table in comparison["tables"] for row in table["rows"]]
    return {(row["table"], row["row"], row["column"]): row for row in rows}


def _figures(folders: tuple[Path, Path], titles: Mapping[str, str], beside: Path) -> list[dict]:
    """Return the figures of both runs: their titles, whether they are the same picture, and where each is."""
    one, other = ({path.stem: path for path in folder.glob("figures/*.png")} for folder in folders)
    shared = [name for name in titles if name in one.keys() & other] + sorted(
        name for name in one.keys() & other if name not in titles
    )
    return [
        {
            "name": name,
            "title": titles.get(name, name),
            "same": one[name].read_bytes() == other[name].read_bytes(),
            "paths": [relpath(path.resolve(), beside.resolve()) for path in (one[name], other[name])],
        }
        for name in shared
    ]
