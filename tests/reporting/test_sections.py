from pathlib import Path

import pytest

from gpca.reporting.page.page import rendered_caption
from gpca.reporting.sections import (
    OTHER,
    SECTIONS,
    by_section,
    caption_files,
    listed_as,
    section_of,
    title_of_result,
)

CAPTIONS = Path(__file__).resolve().parents[2] / "workflow/report"
LISTED = [name for titles in SECTIONS.values() for name in titles]


def test_results_stand_in_the_papers_order_and_none_is_lost():
    names = ["table8_recovery", "mine", "table1_extended", "objects_ycb", "fig3_concepts", "table1_single_baselines"]
    assert by_section(names) == {
        "IV-A Datasets and controlled perturbations": ["fig3_concepts", "objects_ycb"],
        "IV-B Concept attribution accuracy": ["table1_single_baselines", "table1_extended"],
        "V Robotic deployment for action recovery": ["table8_recovery"],
        OTHER: ["mine"],
    }


def test_one_entry_stands_for_the_objects_of_every_source():
    assert title_of_result("objects_ycb") == "Objects: ycb"
    assert listed_as("objects_ycb") == "objects"
    assert section_of("objects_ycb") == section_of("fig3_concepts")
    assert caption_files("folder", ["objects_a", "objects_b", "runtime"]) == [
        "folder/objects.rst",
        "folder/runtime.rst",
    ]


def test_what_is_not_listed_has_its_own_name():
    assert title_of_result("mine") == "mine"
    assert section_of("mine") == OTHER


def test_no_name_is_listed_twice():
    assert len(set(LISTED)) == len(LISTED)


def test_every_caption_is_of_something_listed_and_everything_listed_has_one():
    captions = {path.stem for path in CAPTIONS.glob("*.rst")} - {"result", "workflow"}
    assert captions == set(LISTED)


@pytest.mark.parametrize("name", LISTED)
def test_a_caption_is_whole_text(name):
    html = str(rendered_caption(CAPTIONS / f"{name}.rst"))
    assert html.startswith("<p>")
    assert html.rstrip().endswith(".</p>")
    assert "``" not in html
