"""A table's files: what readers get of a large one, and what stands in front of its caption."""

import csv
import json
from dataclasses import replace

from gpca.reporting.tables.table import MOST_COLUMNS, MOST_ROWS, Cell, Column, Table, short

HEADS = {"source": "Dataset", "method": "Explainer", "reads": "Reads"}
KEYS = ("error", "accuracy", "calls", "n", "seconds", "more")


def large(methods, sources=("cups", "pooled")):
    """Explainers by sources; the k-th has 10 k of everything, and the first does not compete for accuracy."""
    rows = [
        ((source, source.title()), (method, method.title()), ("x", "X")) for source in sources for method in methods
    ]
    cells = {(row, key): Cell(10.0 * (row % len(methods)), 1, 3, 9) for row in range(len(rows)) for key in KEYS}
    columns = {key: Column(key.title(), limits=(0, 1000)) for key in KEYS}
    rivals = [row for row in range(len(rows)) if row % len(methods)]
    groups = tuple([(row, "accuracy") for row in rivals if rows[row][0][0] == source] for source in sources)
    return Table("table9_mine", "What", HEADS, tuple(rows), "metric", columns, cells, compared=groups)


def test_readers_get_pooled_rows_the_best_first_and_the_trivial_ones_last(tmp_path):
    table = large(["oracle", "forest", "gpca", "rule", "net", "chance"])
    part = short(table)
    assert [labels[0][0] for labels in part.rows] == ["net", "gpca", "forest", "oracle", "rule", "chance"]
    assert list(part.row_heads) == ["method"]
    assert list(part.columns) == ["accuracy", "error", "calls", "n", "seconds"]
    without_calls = {place: cell for place, cell in table.cells.items() if place[1] != "calls"}
    assert "calls" not in short(replace(table, cells=without_calls)).columns
    table.write(tmp_path / "mine")
    markdown = (tmp_path / "mine.md").read_text()
    assert markdown.startswith("**Table IX: What**\n\n| Explainer | Accuracy |")
    assert "| Net | 40.0 ± 1.0 |" in markdown
    assert "6 of 12 rows and 5 of 6 columns of numbers; table9_mine.csv has all." in markdown
    page = json.loads((tmp_path / "mine.json").read_text())
    assert (len(page["rows"]), len(page["short"]["rows"])) == (12, 6)
    with (tmp_path / "mine.csv").open() as file:
        assert len(list(csv.reader(file))) == 1 + 12 * len(KEYS)


def test_where_the_best_of_a_row_is_left_out_nothing_in_it_is_bold():
    keys = [f"k{number}" for number in range(8)]
    for best in ("k0", "k7"):
        cells = {(0, key): Cell(2.0 if key == best else 1.0, 0.1, 3, 9) for key in keys}
        columns, across = {key: Column(key) for key in keys}, [(0, key) for key in keys]
        whole = Table("mine", "What", {"row": "Row"}, ((("a", "A"),),), "metric", columns, cells, compared=(across,))
        part = short(whole)
        assert list(part.columns) == keys[: MOST_COLUMNS - 1]
        assert (whole.best(), part.best()) == ({(0, best)}, {(0, best)} & set(part.cells))


def test_of_many_rows_those_of_datasets_the_rule_the_paper_and_plugins_stay(tmp_path, monkeypatch):
    methods = ["oracle", "gpca", *(f"net{k}" for k in range(20)), "rule"]
    part = short(large(methods, ("cups", "cans", "cars")))
    assert len(part.rows) <= MOST_ROWS
    assert len(part.row_heads) + len(part.columns) == MOST_COLUMNS
    for source in ("cups", "cans", "cars"):
        shown = [labels[1][0] for labels in part.rows if labels[0][0] == source]
        assert shown == ["net19", "net18", "net17", "gpca", "rule"]
    assert len(short(large(methods, ("pooled",))).rows) == MOST_ROWS
    (tmp_path / "my_plugin_of_tables.py").write_text("EXPLAINERS = {'net0': None}\n")
    assert "net0" not in {key for labels in short(large(methods, ("pooled",))).rows for key, _ in labels}
    monkeypatch.setattr("gpca.process.plugins.named", lambda: [str(tmp_path / "my_plugin_of_tables.py")])
    monkeypatch.syspath_prepend(str(tmp_path))
    shown = [key for labels in short(large(methods, ("pooled",))).rows for key, _ in labels]
    assert {"net0", "gpca", "net19"} <= set(shown)
