"""The map of verdicts."""

from types import SimpleNamespace

from gpca.comparison.verdicts import PAPER_TOO_WIDE, judged_once
from gpca.experiments import claims
from gpca.process.code_files import ROOT

from ..figures import assert_words_are_large_enough_and_inside, words_of

RUN = SimpleNamespace(stand_ins=lambda: "")


def test_every_mean_has_a_cell_with_its_difference_and_those_that_no_run_decides_are_apart():
    comparison = claims.read_comparison(ROOT / "results/reference/full/comparison.csv")
    figure = claims.verdicts(RUN, comparison)
    assert_words_are_large_enough_and_inside(figure)
    words = words_of(figure)
    once = judged_once(comparison)
    cells = [claims._words(row) for row in once.to_dict("records")]
    assert sorted(word for word in words if word in set(cells)) == sorted(cells)
    assert len(cells) == 89
    by_paper = (once["reason"] == PAPER_TOO_WIDE).sum()
    assert f"{by_paper} {claims.BY_PAPER}" in words
    assert f"{(once['verdict'] == 'inconclusive').sum() - by_paper} inconclusive" in words


def test_factors_and_lower_bounds_have_signs():
    row = {"difference": -2.04, "factor": float("nan"), "at_least": "False", "unit": "%"}
    shown = [
        row,
        row | {"factor": 0.25},
        row | {"factor": 31.4, "at_least": "True"},
        row | {"difference": float("nan")},
    ]
    assert [claims._words(each) for each in shown] == ["-2.0", "÷4.0", ">×31", ""]
