"""The joint reading with the most close numbers is found, and its chance is that of a search on dealt numbers."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.comparison import joint_reading
from gpca.comparison.chance import is_close, p_value, permuted, weights
from gpca.comparison.published import Number, read_published
from gpca.experiments.joint_reading import names

from .made_up import ACCURACY, TOLERANCES, tidy

GRID = {choice: ["only"] for choice in joint_reading.CHOICES} | {
    "severities": ["protocol", "weaker"],
    "knobs": ["middle", "low"],
    "new_share": [0.33, 0.02],
}


def number(table, value, method, column="GP-CA", unit="%", metric="accuracy", upper=None):
    counterpart = replace(ACCURACY, methods=(method,), metrics=(metric,))
    return Number(table, "YCB", column, value, upper or value, 1, unit, "", "", counterpart, "")


def measured(values):
    return pd.concat(tidy([value], "shapes", method, metric, table=name)
                     for (name, method, metric), value in values.items())  # fmt: skip


SHAP, LABELS = number("I", 30.0, "shap"), number("III", 14.0, "bald", unit="labels", metric="labels_to_target")
KNOBS = {("protocol", "middle"): 0.5, ("protocol", "low"): 0.31, ("weaker", "middle"): 0.29, ("weaker", "low"): 0.9}
POOLS = {("protocol", 0.33): 100, ("protocol", 0.02): 90, ("weaker", 0.33): 4, ("weaker", 0.02): 20}


@pytest.fixture
def rows():
    joint = dict.fromkeys(joint_reading.CHOICES, "only")
    values = {}
    for (severities, knobs), value in KNOBS.items():
        name = joint_reading.part_name("knobs", joint | {"severities": severities, "knobs": knobs})
        values[name, "shap", "accuracy"] = value
    for (severities, new_share), value in POOLS.items():
        name = joint_reading.part_name("labels", joint | {"severities": severities, "new_share": new_share})
        values |= {(name, "bald", "labels_to_target"): value, (name, "bald", "reached"): float(value != 20)}
    return measured(values)


def test_one_reading_has_to_fit_all_tables(rows):
    found = joint_reading.search([SHAP, LABELS], [SHAP, LABELS], rows, GRID, TOLERANCES, deals=5)
    # Under weaker perturbations 20 labels would be close, but were stopped before the target.
    assert (found.joint["severities"], found.joint["knobs"], found.joint["new_share"]) == ("protocol", "low", 0.33)
    assert found.share == 0.5
    assert found.close.tolist() == [True, False]
    assert (found.readings, found.equals, found.protocol) == (8, 4, 0)
    assert [share for _, share in found.best] == [0.5] * 4 + [0] * 4
    reached = rows.assign(value=rows["value"].where(rows["metric"] != "reached", 1.0))
    found = joint_reading.search([SHAP, LABELS], [SHAP, LABELS], reached, GRID, TOLERANCES, deals=5)
    assert (found.joint["severities"], found.joint["knobs"], found.joint["new_share"]) == ("weaker", "middle", 0.02)
    assert (found.share, found.equals) == (1, 1)


def test_by_chance_other_numbers_of_the_same_unit_come_into_a_place(rows):
    other = number("I", 91.0, "gpca_paper", column="SHAP")
    found = joint_reading.search([SHAP], [SHAP, other], rows, GRID, TOLERANCES, deals=200)
    assert found.share == 1
    assert set(found.by_chance["unit"]) == {1.0}  # 91 is close to a reading too
    far = number("I", 70.0, "gpca_paper", column="SHAP")
    found = joint_reading.search([SHAP], [SHAP, far], rows, GRID, TOLERANCES, deals=200)
    assert found.by_chance["unit"].mean() == pytest.approx(0.5, abs=0.15)
    assert set(found.by_chance["column"]) == {1.0}  # it stands in another column


def test_values_are_means_over_the_seeds(rows):
    more = pd.concat([rows, rows.assign(seed=1, value=rows["value"] * 1.1)])
    assert joint_reading.values_of(SHAP, more)["knobs/protocol/middle"] == (pytest.approx(52.5), False)
    assert joint_reading.values_of(LABELS, rows)["labels/weaker/only/only/only/only/only/0.02"] == (20, True)


def test_deals_stay_within_their_group_and_are_the_same_every_time():
    printed = joint_reading.numbers_asked(read_published())
    for within, of in (("unit", lambda n: (n.table, n.unit)), ("column", lambda n: (n.table, n.column, n.unit))):
        dealt_D_K = permuted(printed, within, 50)
        np.testing.assert_array_equal(np.sort(dealt_D_K, axis=1), np.tile(np.arange(len(printed)), (50, 1)))
        group_K = np.unique([str(of(number)) for number in printed], return_inverse=True)[1]
        assert (group_K[dealt_D_K] == group_K).all()
        np.testing.assert_array_equal(dealt_D_K, permuted(printed, within, 50))
        assert len(np.unique(dealt_D_K, axis=0)) > 10


def test_each_table_weighs_the_same_each_value_counts_once_and_every_choice_matters():
    printed = joint_reading.numbers_asked(read_published())
    weight_K = weights(printed)
    assert weight_K.sum() == pytest.approx(1)
    table_K = np.array([number.table for number in printed])
    assert [weight_K[table_K == table].sum() for table in joint_reading.TABLES] == pytest.approx([0.2] * 5)
    assert len(printed) == 54
    assert len(joint_reading.numbers_asked(read_published(), ["ycb"])) == 25
    assert not [number for number in printed if number.same_as]
    assert {choice for of_part in joint_reading.PARTS.values() for choice in of_part} == set(joint_reading.CHOICES)


def test_close_is_within_the_second_tolerance_and_no_lower_bound():
    assert is_close(SHAP, 33.05, False, TOLERANCES["%"])
    assert not is_close(SHAP, 33.06, False, TOLERANCES["%"])
    assert not is_close(SHAP, 30, True, TOLERANCES["%"])
    assert not is_close(SHAP, float("nan"), False, TOLERANCES["%"])
    assert is_close(LABELS, 42, False, TOLERANCES["labels"])
    assert p_value(0.5, np.array([0.5, 0.4, 0.6])) == 3 / 4


def test_fixed_values_are_scored_beside_dealt_ones():
    far = number("I", 70.0, "gpca_paper", column="SHAP")
    records = {
        (table, metric): value
        for table, _, metric, value in joint_reading.scores_of_values(
            [SHAP, far], [(31, False), (71, False)], TOLERANCES, 100, "mine"
        )
    }
    assert records["all", "share"] == 1
    assert records["I", "close"] == records["all", "close"] == 2
    assert records["all", "expected_column"] == 1
    assert records["all", "expected_unit"] == pytest.approx(0.5, abs=0.2)
    assert records["all", "p_unit"] == pytest.approx(0.5, abs=0.2)


@pytest.mark.parametrize(
    ("seeds", "sources", "expected"), [([100], ["ycb"], [100]), ([], ["ycb"], []), ([100], ["linemod"], [])]
)
def test_a_run_without_seeds_or_without_the_source_has_no_joint_reading(seeds, sources, expected):
    section = {"seeds": seeds, "stands_for": "ycb", "source": "shapes", "choices": {"severities": ["protocol"]}}
    assert names({"joint_reading": section}, {source: {} for source in sources})["development_seed"] == expected
