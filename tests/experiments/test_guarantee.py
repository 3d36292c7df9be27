"""Files of scores, and what is collected, tabulated and drawn of them."""

import numpy as np
import pytest

from gpca.config.check import check
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, POOLED
from gpca.experiments.guarantee import COLUMNS, collect, read_guarantee, table19_guarantee, table19_shift
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.guarantee import answers as asked
from gpca.guarantee.answers import BY_FAMILY, BY_SAMPLE, COVERAGE, FALSE_ALARMS, FAMILIES, MISSED, PLAIN, SIZE, UNSURE
from gpca.guarantee.guarantee import STATES
from gpca.io.csv_file import write_csv
from gpca.reporting.tables.cells import rows_where
from tests.config.configs import changed
from tests.guarantee.scored import scored_samples

SECTION = {**{"level": 0.8, "missed": 0.05, "false_alarms": 0.05, "family_risk": 0.2}, **{"explainers": ["reenact"]}}
PROMISED = {name: value for name, value in SECTION.items() if name != "explainers"}
SOURCES = {
    "tools": {"title": "Tools", "kind": "procedural", "stand_in": False},
    "cups": {"title": "Cups", "kind": "procedural"},
}
TITLE = explainer_entry("reenact", CAUSES).title


def run(*explainers):
    return Run({"guarantee": SECTION | ({"explainers": list(explainers)} if explainers else {}), "sources": SOURCES})


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    scored = scored_samples()
    path = tmp_path_factory.mktemp("scores") / "reenact.csv"
    scored.save(path)
    return [path]


@pytest.fixture(scope="module")
def measured(files):
    path = files[0].with_name("guarantee.csv")
    write_csv(path, collect(run(), files))
    return read_guarantee(path)


def value(measured, condition, source, variant, metric, concept=ALL):
    named = {"condition": condition, "source": source, "variant": variant, "metric": metric, "concept": concept}
    [(_, row)] = rows_where(measured, **named).iterrows()
    return row


def test_measures_are_shares_of_the_answers(files, measured):
    assert tuple(measured.columns) == COLUMNS
    scored = asked.Scored.load(files[0])
    answers = asked.answers_of(scored, asked.conditions(scored)[0], asked.GuaranteeSettings(**PROMISED))
    state = scored.state[answers.row]
    for variant in (PLAIN, BY_SAMPLE, BY_FAMILY):
        inside = answers.sets[variant]
        holds = (inside & (state[:, None] == np.array(STATES))).any(axis=1)
        assert value(measured, FAMILIES, POOLED, variant, COVERAGE)["value"] == pytest.approx(holds.mean(), abs=1e-6)
        size = value(measured, FAMILIES, POOLED, variant, SIZE)["value"]
        assert size == pytest.approx(inside.sum(axis=1).mean(), abs=1e-6)
        several = value(measured, FAMILIES, POOLED, variant, COVERAGE, "several")
        assert several["value"] == pytest.approx(holds[state == "several"].mean(), abs=1e-6)
    calls = answers.calls[BY_SAMPLE]
    missed = value(measured, FAMILIES, POOLED, BY_SAMPLE, MISSED)
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
    table = table19_guarantee(run("reenact", "reenact_committee"), measured)
    text = table.markdown()
    covered = value(measured, FAMILIES, POOLED, BY_SAMPLE, COVERAGE)
    numbers = " to ".join(f"{100 * covered[name]:.1f}" for name in ("low", "high"))
    assert f"| {TITLE} | By sample | {100 * covered['value']:.1f} ({numbers})" in text
    assert "sets that hold the state in 80 % of the cases" in text and "by family 20 % each" in text
    worst = min(value(measured, FAMILIES, POOLED, PLAIN, COVERAGE, state)["value"] for state in STATES)
    assert table.cells[0, "worst_state"].mean == pytest.approx(100 * worst)
    shift = table19_shift(run(), measured).markdown()
    heads = [line.split(" | ")[:3] for line in shift.splitlines() if line.startswith("| ")][2:]
    assert heads == [
        ["| Other families", "Tools", TITLE],
        ["| Other families", "Cups (procedural stand-in)", TITLE],
        ["| Tools alone", "Cups (procedural stand-in)", TITLE],
        ["| Cups (procedural stand-in) alone", "Tools", TITLE],
        ["| The milder half", "All together", TITLE],
        ["| The harder half", "All together", TITLE],
        ["| Simulated pairs", "Depth frames", TITLE],
    ]
    with pytest.raises(InputError, match="has nothing to show"):
        table19_guarantee(run("reenact_committee"), measured)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("level", 1.0, "guarantee.level: 1.0 should be less than 1"),
        ("explainers", ["oracle"], "guarantee.explainers: no explainer 'oracle'; choose one of chance, "),
        ("explainers", ["chance"], "guarantee.explainers: explainer 'chance' reads neither descriptors nor"),
    ],
)
def test_a_fault_of_the_config_is_one_line_that_names_the_key(key, value, message):
    with pytest.raises(InputError) as caught:
        check(changed(f"guarantee.{key}", value))
    assert str(caught.value).startswith(f"config key {message}")
