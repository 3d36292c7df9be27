"""Reasons quote values of the run: they are filled in, and those of the suite cite runs that the suite makes."""

import re

import pandas as pd
import pytest
import yaml

from gpca.code_files import ROOT
from gpca.comparison.citations import citations, cited_number, filled
from gpca.comparison.published import read_published, read_reasons, reason_of
from gpca.comparison.readings import READINGS
from gpca.comparison.values import read_results, value_of_run
from gpca.experiments.registry import experiments

from .made_up import number, tidy

REFERENCE = ROOT / "results/reference/full"
NUMBERS, REASONS = read_published(), read_reasons()
OF_REASONS = {reason: [n for n in NUMBERS if reason_of(n, [reason]) == reason.text] for reason in REASONS}


@pytest.fixture(scope="module")
def reference():
    files = {fields["file"] for reason in REASONS for fields in citations(reason.text)}
    return read_results(path for path in sorted(REFERENCE.glob("*.csv")) if path.name in files)


def test_a_reason_is_filled_with_the_mean_over_the_seeds_in_the_unit_that_it_names():
    text = "Longer training gives {metrics.csv attribution @ gpca accuracy all %} %. The paper is silent."
    results = {"metrics.csv": pd.concat([tidy([0.9, 0.8], method="gpca"), tidy([0.1, 0.1])])}
    assert filled(text, number(50.0), results) == "Longer training gives 85.0 %. The paper is silent."
    own = "Here it is {metrics.csv attribution @ @ @ @ share}."
    assert filled(own, number(50.0), results) == "Here it is 0.1."


def test_a_sentence_about_what_was_not_run_is_left_out():
    text = "It is {metrics.csv attribution @ gpca accuracy all %} %. The paper is silent."
    assert filled(text, number(50.0), {"metrics.csv": tidy([0.1])}) == "The paper is silent."
    assert filled(text, number(50.0), {}) == "The paper is silent."


def test_a_lower_bound_says_so():
    rows = [
        tidy([value], metric=metric, concept="overlap") for metric, value in (("labels_to_target", 60), ("reached", 0))
    ]
    text = "It takes {a.csv attribution @ @ labels_to_target overlap labels} labels."
    assert filled(text, number(50.0), {"a.csv": pd.concat(rows)}) == "It takes more than 60 labels."


@pytest.mark.parametrize("text", ["{metrics.csv attribution}", "{metrics.csv attribution @ @ accuracy all furlongs}"])
def test_a_citation_is_whole_and_has_a_known_unit(text):
    with pytest.raises(ValueError, match=r"shorter|longer|unknown unit"):
        citations(text)


@pytest.mark.parametrize("reason", REASONS, ids=lambda reason: f"{reason.table} {reason.row} {reason.column}")
def test_every_reason_cites_a_run_of_the_suite(reason, reference):
    cited = citations(reason.text)
    assert cited
    assert {fields["file"] for fields in cited} <= {tidy.file for each in experiments() for tidy in each.tidy}
    kept = [fields for fields in cited if fields["file"] in reference]
    found = [
        value_of_run(asked, reference)
        for fields in kept
        for of in OF_REASONS[reason]
        if (asked := cited_number(of, fields)) is not None
    ]
    # What the reference does not keep was made by the same steps.
    assert not kept or any(value is not None for value in found)


def test_no_reason_gives_up_and_none_quotes_a_number_that_stands_on_no_page():
    pages = " ".join(path.read_text() for path in sorted((ROOT / "docs").glob("*.md")))
    pages += " ".join(path.read_text() for path in sorted((ROOT / "config").glob("*.yaml")))
    for reason in REASONS:
        assert not re.search("not known|not measured", reason.text)
        plain = re.sub(r"\{[^}]*\}|[\w/]+\.\w+|Table [IV]+|1e-\d+|3/2", "", reason.text)
        for typed in re.findall(r"\d+(?:\.\d+)?", plain):
            assert re.search(rf"(?<![\d.]){re.escape(typed)}(?![\d])", pages), (reason, typed)


def test_readings_that_reasons_cite_are_of_the_grid():
    grid = yaml.safe_load((ROOT / "config/readings.yaml").read_text())["readings"]["groups"]
    for reason in REASONS:
        for fields in citations(reason.text):
            if fields["file"] == READINGS:
                group, *values = fields["table"].split("/")
                assert len(values) == len(grid[group])
                for value, choice in zip(values, grid[group].values(), strict=True):
                    assert value in {f"{known:g}" if isinstance(known, float) else str(known) for known in choice}
