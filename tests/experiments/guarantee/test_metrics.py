"""Files of scores, and what is collected, tabulated and drawn of them."""

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.evaluation.measures import ALL, POOLED
from gpca.experiments.guarantee.answers import BY_FAMILY, BY_SAMPLE, CONFIDENT, FAMILIES, PLAIN, answers_of, conditions
from gpca.experiments.guarantee.figure import draw_guarantee
from gpca.experiments.guarantee.metrics import (
    COLUMNS,
    COVERAGE,
    FALSE_ALARMS,
    MISSED,
    SIZE,
    UNSURE,
    collect,
    read_guarantee,
)
from gpca.experiments.guarantee.scored import Scored
from gpca.experiments.guarantee.settings import GuaranteeSettings
from gpca.experiments.guarantee.tables import table19_guarantee, table19_shift
from gpca.guarantee.guarantee import STATES
from gpca.io.csv_file import write_csv

SECTION = {
    **{"level": 0.8, "missed": 0.05, "false_alarms": 0.05, "family_risk": 0.2, "confidence": 0.9},
    **{"nonconformity": "probability", "explainers": ["mine"]},
}
PROMISED = {name: value for name, value in SECTION.items() if name != "explainers"}
EXPLAINERS = {"mine": "Mine", "other": "Not asked"}
SOURCES = {"tools": {"title": "Tools", "stand_in": False}, "cups": {"title": "Cups", "stand_in": True}}


@pytest.fixture(scope="module")
def files(scored, tmp_path_factory):
    path = tmp_path_factory.mktemp("scores") / "mine.csv"
    scored.save(path)
    return [path]


@pytest.fixture(scope="module")
def measured(files):
    path = files[0].with_name("guarantee.csv")
    write_csv(path, collect(files, SECTION))
    return read_guarantee(path)


def value(measured, condition, source, variant, metric, concept=ALL):
    rows = measured[
        (measured["condition"] == condition)
        & (measured["source"] == source)
        & (measured["variant"] == variant)
        & (measured["metric"] == metric)
        & (measured["concept"] == concept)
    ]
    assert len(rows) == 1
    return rows.iloc[0]


def test_scores_survive_the_file(scored, files):
    read = Scored.load(files[0])
    assert read.family.tolist() == scored.family.tolist() and read.taught.tolist() == scored.taught.tolist()
    assert np.abs(read.scores - scored.scores).max() < 1e-6
    text = files[0].read_text().replace(",several,", ",sundry,")
    (files[0].parent / "spoiled.csv").write_text(text)
    with pytest.raises(InputError, match="unknown state 'sundry'; its states are nominal, noise"):
        Scored.load(files[0].parent / "spoiled.csv")
    with pytest.raises(InputError, match="no files with scores were given; name an explainer"):
        collect([], SECTION)


def test_measures_are_shares_of_the_answers(files, measured):
    assert tuple(measured.columns) == COLUMNS
    scored = Scored.load(files[0])
    settings = GuaranteeSettings(**PROMISED)
    answers = answers_of(scored, conditions(scored)[0], settings)
    state = scored.state[answers.row]
    for variant in (PLAIN, BY_SAMPLE, BY_FAMILY):
        inside = answers.sets[variant]
        holds = (inside & (state[:, None] == np.array(STATES))).any(axis=1)
        assert value(measured, FAMILIES, POOLED, variant, COVERAGE)["value"] == pytest.approx(holds.mean(), abs=1e-6)
        assert value(measured, FAMILIES, POOLED, variant, SIZE)["value"] == pytest.approx(
            inside.sum(axis=1).mean(), abs=1e-6
        )
        several = value(measured, FAMILIES, POOLED, variant, COVERAGE, "several")
        assert several["value"] == pytest.approx(holds[state == "several"].mean(), abs=1e-6)
    calls = answers.calls[CONFIDENT]
    missed = value(measured, FAMILIES, POOLED, CONFIDENT, MISSED)
    assert missed["value"] == pytest.approx((calls[state != "nominal"] == "good").mean(), abs=1e-6)
    # Each of 240 samples is asked about by two models.
    assert value(measured, FAMILIES, POOLED, BY_SAMPLE, COVERAGE)["samples"] <= 240 * 3
    assert value(measured, FAMILIES, POOLED, BY_SAMPLE, COVERAGE)["clusters"] == 12


def test_promises_stand_beside_what_they_are_of(measured):
    rows = measured[measured["concept"] == ALL]
    assert set(rows[rows["metric"] == COVERAGE]["promised"]) == {0.8}
    assert rows[rows["metric"].isin([SIZE, UNSURE])]["promised"].isna().all()
    by_family = rows[rows["variant"] == BY_FAMILY]
    assert set(by_family[by_family["metric"].isin([MISSED, FALSE_ALARMS])]["promised"]) == {0.2}
    inside = rows.dropna(subset=["low", "high"])
    assert (inside["low"] <= inside["value"] + 1e-6).all() and (inside["value"] <= inside["high"] + 1e-6).all()


def test_no_interval_of_a_share_has_zero_width(measured):
    shares = measured[measured["metric"].isin([COVERAGE, MISSED, FALSE_ALARMS, UNSURE])].dropna(subset=["low"])
    assert (shares["high"] > shares["low"]).all()


def test_every_condition_is_measured_where_it_is_tested(measured):
    places = {name: set(rows["source"]) for name, rows in measured.groupby("condition")}
    assert places == {
        FAMILIES: {POOLED, "tools", "cups"},
        "from_tools": {"cups"},
        "from_cups": {"tools"},
        "milder": {POOLED, "tools", "cups"},
        "harder": {POOLED, "tools", "cups"},
        "frames": {"real_rgbd"},
    }
    assert set(measured[measured["concept"] != ALL]["source"]) == {POOLED}


def test_the_tables_say_what_was_promised_and_measured(measured):
    table = table19_guarantee(measured, EXPLAINERS, SOURCES, PROMISED)
    text = table.markdown()
    covered = value(measured, FAMILIES, POOLED, BY_SAMPLE, COVERAGE)
    numbers = " to ".join(f"{100 * covered[name]:.1f}" for name in ("low", "high"))
    assert f"| Mine | By sample | {100 * covered['value']:.1f} ({numbers})" in text
    assert "| Mine | By sample, with confidence | – | – | – | – |" in text and "Not asked" not in text
    assert "sets that hold the state in 80 % of the cases" in text and "by family 20 % each" in text
    worst = min(value(measured, FAMILIES, POOLED, PLAIN, COVERAGE, state)["value"] for state in STATES)
    assert table.cells[0, "worst_state"].mean == pytest.approx(100 * worst)
    shift = table19_shift(measured, EXPLAINERS, SOURCES, PROMISED).markdown()
    heads = [line.split(" | ")[:3] for line in shift.splitlines() if line.startswith("| ")][2:]
    assert heads == [
        ["| Other families", "Tools", "Mine"],
        ["| Other families", "Cups (procedural stand-in)", "Mine"],
        ["| Tools alone", "Cups (procedural stand-in)", "Mine"],
        ["| Cups (procedural stand-in) alone", "Tools", "Mine"],
        ["| The milder half", "All together", "Mine"],
        ["| The harder half", "All together", "Mine"],
        ["| Simulated pairs", "Depth frames", "Mine"],
    ]
    with pytest.raises(InputError, match="has nothing to show"):
        table19_guarantee(measured, {"other": "Not asked"}, SOURCES, PROMISED)


def test_the_figure_is_drawn_the_same_way_twice(measured, same_bytes):
    same_bytes(lambda: draw_guarantee(measured, EXPLAINERS, PROMISED))
    with pytest.raises(InputError, match="has no results for these explainers"):
        draw_guarantee(measured, {"other": "Not asked"}, PROMISED)
