"""The numbers that pages print are those of the reference, or of the page that has them all."""

import re

import pytest

from docs import fill
from gpca.errors import InputError

from .documents import ROOT

PAPERS_TABLES = (  # and the eighth, which is ours
    *("table1_single_baselines", "table2_per_concept", "table3_active_learning", "table4_kernels"),
    *("table5_learners", "table6_backbones", "table7_runtime", "table8_recovery"),
)
TABLE = "source,explainer,mean,n\ncups,gpca,98.74,8\ncups,forest,99,9\nmine,gpca,-3.2,8\n"


@pytest.fixture
def reference(tmp_path):
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables/table9.csv").write_text(TABLE)
    (tmp_path / "report.md").write_text("Of 7 numbers, 3 fit.\n")
    return tmp_path


def test_all_pages_have_the_numbers_of_the_reference(capsys):
    assert fill.main(["--check"]) == 0, capsys.readouterr().out


@pytest.mark.parametrize(("run", "name"), [("default", "default"), ("full", "full protocol")])
def test_the_readme_has_the_times_of_the_page_of_all_targets(run, name):
    page = (ROOT / "docs/appendix.md").read_text()
    block = page.split(f"<!-- times of results/{run} -->")[1].split(f"<!-- end of results/{run} -->")[0]
    rows = re.findall(r"^\| `tables/(\w+)\.md` \| \d+ \| [\d.]+ \| ([\d.]+) \|", block, re.MULTILINE)
    minutes = {table: f"{float(wall):.0f}" for table, wall in rows}
    [shown] = re.findall(rf"^\| {name} \| ([\d |]+) \|$", (ROOT / "README.md").read_text(), re.MULTILINE)
    assert shown.split(" | ") == [minutes[table] for table in PAPERS_TABLES]


@pytest.mark.parametrize(
    ("definition", "text"),
    [
        ("table9 cups gpca .1f", "98.7"),
        ("table9 mine .0f", "-3"),
        ("table9:n cups gpca .0f", "8"),
        ("table9 gpca source=c*s .2f", "98.74"),
        ("max table9 cups|mine .0f", "99"),
        ("min table9 source=[!c]* .1f", "-3.2"),
        ("mean table9 cups .2f", "98.87"),
        ("count table9 cups d", "2"),
        ("count table9:n d", "2"),
        ("table9 forest minus table9 cups gpca .2f", "0.26"),
        (r"read report.md '(\d+) fit'", "3"),
    ],
)
def test_a_definition_stands_for_a_number_of_the_reference(reference, definition, text):
    assert fill.value(definition, reference) == text


@pytest.mark.parametrize(
    ("definition", "fault"),
    [
        ("table9 gpca .1f", "matches 2 rows"),
        ("table9 cup .1f", "matches 0 rows"),
        ("table8 cups .1f", "no such file"),
        ("table9 place=cups .1f", "cannot be read .*place"),
        ("table9 mine gpca", "cannot be read .*format"),
        (r"read report.md '(\d+)'", "matches 2 times"),
    ],
)
def test_a_definition_that_is_not_one_number_is_refused(reference, definition, fault):
    with pytest.raises(InputError, match=fault):
        fill.value(definition, reference)


PAGE = "It has 97.5<!--own--> %, the **other 1<!--other-->**.\n<!--begin all-->\nold\n<!--end all-->\n<!-- a note -->\n"
CELLS = {"head": "who", "columns": {"cups": "cups .0f", "mine": "mine .1f"}, "rows": {"GP-CA": "table9 gpca"}}
CELLS["rows"] |= {"forest": "table9 forest"}
NUMBERS = {"own": "table9 cups gpca .1f", "other": "table9 forest .0f", "all": CELLS}


def test_a_page_is_filled_once_and_keeps_its_words(reference):
    text, changes = fill.filled(PAGE, NUMBERS, "page.md", reference)
    assert "It has 98.7<!--own--> %, the **other 99<!--other-->**.\n" in text
    assert "\n| GP-CA | 99 | -3.2 |\n| forest | 99 | – |\n\n<!--end all-->\n<!-- a note -->" in text
    assert changes == ["own: 97.5 -> 98.7", "other: 1 -> 99", "all: written anew"]
    assert fill.filled(text, NUMBERS, "page.md", reference) == (text, [])


@pytest.mark.parametrize(
    ("comparison", "holds"),
    [
        ("table9 cups gpca reaches max table9 gpca", True),
        ("table9 cups gpca above max table9 gpca", False),
        ("max table9 mine above 0", False),
        ("table9 forest minus table9 cups gpca above 0.2", True),
    ],
)
def test_a_sentence_stands_on_comparisons_with_the_reference(reference, comparison, holds):
    lines = fill.no_longer_true("The best<!--if best-->.", {"best": [comparison]}, reference)
    assert lines == ([] if holds else [f"best: no longer holds ({comparison}); rewrite the sentence"])
    with pytest.raises(InputError, match="cannot be read"):
        fill.no_longer_true("The best<!--if best-->.", {"best": ["table9 forest"]}, reference)


@pytest.mark.parametrize(
    ("mine", "said"),
    [
        ("99.5", "- Mine is best: 99.5."),
        ("98", "- A forest is best, not mine."),
        ("-3", "- A forest is best, not mine."),
    ],
)
def test_a_sentence_is_about_the_best_row_and_is_chosen_by_the_numbers(reference, mine, said):
    (reference / "tables/own.csv").write_text(f"{TABLE}mine,own,{mine},8\n")
    cases = [
        {"if": ["own BEST above max own RIVALS"], "text": "- Title is best: [[own BEST .1f]]."},
        {"text": "- Title is best, not mine."},
    ]
    best = {"own": "mine", "forest": "a forest", "lacking": "none"}
    lead = {"of": "own", "words": {"RIVALS": "gpca|forest"}, "best": best, "cases": cases}
    text, _ = fill.filled("<!--begin lead-->\n<!--end lead-->\n", {"lead": lead}, "page.md", reference)
    assert text == f"<!--begin lead-->\n\n{said}\n\n<!--end lead-->\n"


@pytest.mark.parametrize(
    ("page", "fault"),
    [
        (PAGE + "5<!--own_two-->", "marker 'own_two': is not defined"),
        (PAGE.replace("1<!--other-->", ""), "marker 'other': is not on the page"),
        (PAGE.replace("1<!--other", "one<!--other"), "marker 'other': has no number before it"),
        (PAGE.replace("end all", "end some"), "marker 'all': has no number before it, or no end"),
    ],
)
def test_a_marker_without_a_definition_a_number_or_an_end_is_refused(reference, page, fault):
    with pytest.raises(InputError, match=fault):
        fill.filled(page, NUMBERS, "page.md", reference)


def test_what_differs_is_written_unless_it_is_only_checked(reference, monkeypatch, capsys):
    page, definitions = reference / "page.md", reference / "numbers.yaml"
    own = f"reference: {reference.name}\n"
    page.write_text("A share of 1<!--own--> %.\n")
    definitions.write_text(own + "page.md: {own: table9 cups gpca .1f}\n")
    for name, value in (("ROOT", reference), ("DEFINITIONS", definitions), ("REFERENCES", reference.parent)):
        monkeypatch.setattr(fill, name, value)
    assert (fill.main(["--check"]), page.read_text()) == (1, "A share of 1<!--own--> %.\n")
    assert (fill.main([]), page.read_text()) == (0, "A share of 98.7<!--own--> %.\n")
    assert capsys.readouterr().out.splitlines() == ["page.md: own: 1 -> 98.7"] * 2
    page.write_text("The best<!--if best-->.\n")
    definitions.write_text(own + "page.md: {best: [table9 mine above 0]}\n")
    assert fill.main([]) == 1
    page.write_text("A share of 1<!--own--> %.\n")
    definitions.write_text(f"reference: none\npage.md: {{reference: {reference.name}, own: table9 cups gpca .1f}}\n")
    assert fill.main([]) == 0
    definitions.write_text(own + "page.md: {own: table8 cups .1f}\n")
    assert fill.main([]) == 2
    assert "no such file" in capsys.readouterr().err


def test_links_go_to_the_reference_that_the_numbers_are_of():
    page = "[one](results/reference/full/tables/a.md) [two](../results/reference/default/b.md) results/reference/old/"
    assert fill.links_elsewhere(page, "default") == ["links to results/reference/full, but its numbers are of default"]
    assert len(fill.links_elsewhere(page, "full")) == 1
