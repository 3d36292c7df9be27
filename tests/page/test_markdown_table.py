import pytest

from gpca.errors import InputError
from gpca.page.markdown_table import ShownCell, read_markdown_table
from gpca.reporting.tables.table import Cell, Column, Table


@pytest.fixture
def table():
    return Table(
        name="t",
        caption="Accuracy | all (%)",
        row_heads={"source": "Dataset"},
        rows=((("a", "A|B"),), (("c", "C"),)),
        column_head="explainer",
        columns={"x": Column("X"), "y": Column("Y", interval=False)},
        cells={(0, "x"): Cell(97.7, 0.4, 3, 270), (1, "x"): Cell(90.0, 1.0, 3, 270), (1, "y"): Cell(5.0, 0.0, 3, 270)},
        compared=([(0, "x"), (1, "x")],),
        footnotes=("First.", "Second."),
    )


def test_what_a_table_writes_is_read_again(table, tmp_path):
    table.write(tmp_path / "t.csv", tmp_path / "t.md", tmp_path / "t.tex")
    shown = read_markdown_table(tmp_path / "t.md")
    assert shown.caption == "Accuracy | all (%)"
    assert shown.heads == ("Dataset", "X", "Y")
    assert shown.label_columns == 1
    assert shown.rows == (
        (ShownCell("A|B", False), ShownCell("97.7 ± 0.4", True), ShownCell("–", False)),
        (ShownCell("C", False), ShownCell("90.0 ± 1.0", False), ShownCell("5.0", False)),
    )
    assert shown.footnotes == ("First.", "Second.")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "is empty"),
        ("**Caption**\n", "is not a caption with a table below it"),
        ("| A |\n| :-- |\n| 1 |\n", "is not a caption with a table below it"),
        ("**Caption**\n\n| A | B |\n| :-- | --: |\n| 1 |\n", "contains rows of different lengths"),
    ],
)
def test_another_text_is_refused(text, fault, tmp_path):
    path = tmp_path / "t.md"
    path.write_text(text)
    with pytest.raises(InputError, match=f"t.md: {fault}; regenerate it"):
        read_markdown_table(path)


def test_missing_and_unreadable_files_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"t\.md: no such file"):
        read_markdown_table(tmp_path / "t.md")
    (tmp_path / "t.md").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"t\.md: is not readable text"):
        read_markdown_table(tmp_path / "t.md")
