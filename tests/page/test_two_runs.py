"""Two runs side by side: `gpca compare`, and how printed tables are read back."""

import os
import re

import numpy as np
import pytest

from gpca.__main__ import main
from gpca.comparison.verdicts import COMPARISON_COLUMNS
from gpca.page.two_runs import _cell, compare_tables, read_number, read_printed_table
from gpca.reporting.tables.table import Cell, Column, Table
from tests.accessible import faults_of
from tests.page.small_run import Page


@pytest.mark.parametrize(
    ("text", "value", "bounds"),
    [
        ("97.7 ± 0.4", 97.7, (97.3, 98.1)),
        ("-62.4 (-67.4 to -56.2)", -62.4, (-67.4, -56.2)),
        ("> 52.0", 52.0, (np.nan, np.nan)),
        ("97.7 (+1.2; 0.4 to 1.9)", 97.7, (np.nan, np.nan)),  # the brackets hold another number
    ],
)
def test_a_printed_number_has_a_value_and_perhaps_an_interval(text, value, bounds):
    number = read_number(text)
    assert number.value == value
    assert (number.low, number.high) == pytest.approx(bounds, nan_ok=True)


def test_intervals_are_apart_if_they_have_nothing_in_common():
    assert read_number("–") is None
    kinds = [_cell("97.0 ± 0.5", other)["kind"] for other in ("97.9 ± 0.5", "95.0 (94.0 to 96.0)", "12.0")]
    assert kinds == ["different", "apart", "different"]


def test_a_table_is_read_back_as_it_was_written(tmp_path):
    table = Table(
        name="mine",
        caption="Shares (%), a | b",
        row_heads={"source": "Dataset", "explainer": "Explainer"},
        rows=((("a", "A|B"), ("x", "X")), (("c", "C"), ("x", "X"))),
        column_head="metric",
        columns={"accuracy": Column("Accuracy (%)"), "n": Column("n", decimals=0, interval=False)},
        cells={(0, "accuracy"): Cell(97.7, 0.4, 3, 270), (1, "accuracy"): Cell(33.3, 2.0, 3, 270)},
        compared=([(0, "accuracy"), (1, "accuracy")],),
        footnotes=("A footnote | of it.",),
    )
    table.write(tmp_path / "mine")
    read, printed = read_printed_table(tmp_path / "mine.md"), table.printed()
    assert (read.caption, read.heads, read.labels) == (table.caption, printed["heads"], 2)
    assert read.rows == [[text for text, _ in row] for row in printed["rows"]]


def test_cells_are_compared_by_the_names_of_their_rows_and_columns(two_runs):
    [table], alone = compare_tables(two_runs, {"table9_long": "Table IX"})
    assert (table.title, table.labels, alone) == ("Table IX", 1, [["only_here"], []])
    rows = {labels[0]: cells for labels, cells in table.rows}
    assert rows["row 3"][0] == {
        "one": "53.0 ± 0.4", "other": "63.0 ± 0.4", "difference": "+10.0", "kind": "apart",
    }  # fmt: skip
    assert rows["row 0"][0]["kind"] == "same"
    assert rows["row 12"][0]["kind"] == "alone"  # in the second run alone
    assert dict(table.kinds) == {"same": 11, "apart": 1, "alone": 1}


def test_the_page_and_the_lines_say_how_much_differs(two_runs, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["compare", *map(str, two_runs)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said == [
        "table9_long  2 of 13 entries differ, 1 with intervals apart",
        f"only in {two_runs[0]}: only_here",
        "compare.html",
    ]
    page = Page((tmp_path / "compare.html").read_text())
    assert faults_of(page.text) == []
    assert page.stack == []
    assert len(set(page.ids)) == len(page.ids)
    assert [link for link in page.links if link.startswith("#") and link[1:] not in page.ids] == []
    assert all((tmp_path / source).is_file() for source in page.sources)
    assert len(page.sources) == 2
    assert "Sections of the config that differ: causes." in page.text
    assert ">abc<" in page.text and ">def with uncommitted changes<" in page.text
    assert '<td class="apart">53.0 ± 0.4<span class="line">63.0 ± 0.4 <small>+10.0</small></span></td>' in page.text
    assert re.findall(r"(?:https?:)?//[\w-]+\.[\w.-]+", page.text) == []


def test_a_folder_without_tables_is_refused(two_runs, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    assert main(["compare", str(two_runs[0]), str(tmp_path / "empty")]) == 2
    assert "has no tables/*.md" in capsys.readouterr().err
    assert main(["compare", str(two_runs[0]), str(tmp_path / "none")]) == 2
    assert "none: no such folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "spoil"),
    [
        ("tables/*.md", lambda path: (path.unlink(), os.mkfifo(path))),
        ("metrics.csv.provenance.json", lambda path: path.write_text('{"libraries": ["numpy"]}')),
        ("metrics.csv.provenance.json", lambda path: path.write_text('{"device": {"name": {}}}')),
        ("metrics.csv.provenance.json", os.mkdir),
        ("comparison.csv", lambda path: path.write_text(f"{','.join(COMPARISON_COLUMNS)}\n{',' * 99}\n"[:400])),
    ],
)
def test_a_damaged_run_is_named_with_its_file(two_runs, tmp_path, capsys, name, spoil):
    (two_runs[0] / "metrics.csv").touch()
    path = next(two_runs[0].glob(name), two_runs[0] / name)
    spoil(path)
    assert main(["compare", *map(str, two_runs), "--out", str(tmp_path / "page.html")]) == 2
    said = capsys.readouterr().err
    assert path.name in said and len(said.splitlines()) == 1
