"""Readings of the unstated: each way in which a printed number can lie to them, and the one that fits several."""

import pandas as pd
import pytest

from gpca.comparison.readings import chance_of, judge_readings, read_judged, summarize, with_readings
from gpca.errors import InputError
from gpca.experiments import reading_words

from .made_up import ACCURACY, LABELS, TOLERANCES, compared, number, tidy

WORDS = reading_words
KEY, OTHER = ("I", "YCB", "GP-CA"), ("I", "Cups", "GP-CA")
OF_CUPS = ACCURACY.__class__(**{**ACCURACY.__dict__, "sources": ("cups",)})


def readings(values, source="ycb"):
    """Rows of ``readings.csv``: two seeds of each reading."""
    parts = [tidy([value, value], source=source, table=f"start/{name}") for name, value in values.items()]
    return pd.concat(parts)


def judged(printed, values, here=0.97):
    numbers = [number(printed)]
    comparison = compared(numbers, {"metrics.csv": tidy([here, here])})
    return judge_readings(numbers, comparison, readings(values), TOLERANCES), comparison


@pytest.mark.parametrize(
    ("value", "where", "words"),
    [
        (0.515, "produced", "1 of 2 readings are close"),
        (0.30, "between", "none of 2 readings is close"),
        (0.60, "outside", "outside of all 2"),
    ],
)
def test_a_number_is_produced_or_between_readings_or_outside(value, where, words):
    found, comparison = judged(50.0, {"random": value, "kmeans": 0.97})
    of = summarize(found)[KEY]["start"]
    assert (of.where, of.nearest, of.readings, of.least, of.most) == (where, "random", 2, 100 * value, 97)
    [reason] = with_readings(comparison, found, WORDS)["reason"]
    assert words in reason


def test_the_joint_reading_fits_most_numbers_of_its_group():
    numbers = [number(50.0), number(60.0, row="Cups", counterpart=OF_CUPS)]
    results = {"metrics.csv": pd.concat([tidy([0.9, 0.9]), tidy([0.9, 0.9], source="cups")])}
    both = pd.concat([readings({"a": 0.5, "b": 0.52}), readings({"a": 0.9, "b": 0.59}, source="cups")])
    found = summarize(judge_readings(numbers, compared(numbers, results), both, TOLERANCES))
    assert [(of["start"].joint, of["start"].fitted, of["start"].touched) for of in found.values()] == [("b", 2, 2)] * 2
    assert found[KEY]["start"].nearest == "a"


def test_a_lower_bound_is_no_value_and_a_ratio_is_measured_by_its_logarithm():
    labels = number(14, decimals=0, unit="labels", counterpart=LABELS)
    own = tidy([200.0, 200.0], method="random", metric="labels_to_target", concept="overlap", table=LABELS.table)
    results = {"active_learning.csv": own}
    values = {"all": {"labels_to_target": 14, "reached": 0}, "few": {"labels_to_target": 130.5, "reached": 1}}
    frame = pd.concat(
        tidy([value], method="random", metric=metric, concept="overlap", table=f"pool/{name}")
        for name, metrics in values.items()
        for metric, value in metrics.items()
    )
    found = judge_readings([labels], compared([labels], results), frame, TOLERANCES).set_index("reading")
    assert found.loc["all", "at_least"]
    assert not found["close"].any()
    assert found.loc["few", "distance"] == pytest.approx(2)  # 14.5 × 3²


def test_what_was_judged_is_read_back_or_refused_even_if_infinitely_far(tmp_path):
    found, _ = judged(50.0, {"random": 0.5})
    path = tmp_path / "reading_verdicts.csv"
    found.to_csv(path, index=False)
    pd.testing.assert_frame_equal(read_judged(path), found, check_dtype=False)
    path.write_text(path.read_text().replace("50.0", "half"))
    with pytest.raises(InputError, match="column 'published' contains values that are not finite numbers"):
        read_judged(path)
    risk = number(0.0078, decimals=4, unit="risk")
    comparison = compared([risk], {"metrics.csv": tidy([0.003, 0.003])})
    found = judge_readings([risk], comparison, readings({"perfect": 0.0, "random": 0.004}), TOLERANCES)
    assert found["distance"].tolist()[0] == -float("inf") and not found["close"][0]
    path = tmp_path / "reading_verdicts.csv"
    found.to_csv(path, index=False)
    pd.testing.assert_frame_equal(read_judged(path), found, check_dtype=False)


def test_the_chance_is_the_share_of_the_span_within_the_tolerance():
    percent, labels = TOLERANCES["%"], TOLERANCES["labels"]
    assert chance_of([10, 50], [10, 50], percent) == pytest.approx(2 * 3 / 40)
    assert chance_of([10, 12, 50], [10, 12, 50], percent) == pytest.approx((2 + 3 + 3) / 40)  # overlaps count once
    assert chance_of([10, 14, 18], [10, 14, 18], percent) == 1
    assert chance_of([10], [10, 50], percent) == pytest.approx(3 / 40)  # the other is a lower bound
    assert chance_of([4, 36], [4, 36], labels) == 1  # by logarithms: a factor of 3 to either side
    assert chance_of([7], [7], percent) == 1
    assert chance_of([], [7], percent) == 0
    found, comparison = judged(50.0, {"random": 0.515, "kmeans": 0.97})
    assert summarize(found)[KEY]["start"].chance == pytest.approx(6 / 45.5)
    assert "13% of their span is" in with_readings(comparison, found, WORDS)["reason"][0]
