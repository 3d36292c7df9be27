"""Tables XI."""

import pandas as pd
import pytest
from gpca.experiments.registration_methods.tables import table11_limits, table11_registration, table11_severity

from gpca.errors import InputError
from gpca.evaluation.measures import COLUMNS, tidy
from gpca.pairs.perturbation import CONCEPTS

SOURCES = {"ycb": {"title": "YCB", "stand_in": False}, "cups": {"title": "Cups", "stand_in": True}}
METHODS = {
    "gicp": {"title": "GICP", "is_global": False},
    "huber": {"title": "Huber", "is_global": False},
    "fgr": {"title": "FGR", "is_global": True},
}
SUCCESS = {"gicp": 0.5, "huber": 0.7, "fgr": 0.2, "fgr+gicp": 0.6, "fgr+huber": 0.4}
KINDS = ("all", *CONCEPTS, *(f"{cause}_{severity}" for cause in CONCEPTS for severity in ("low", "high")))
ERRORS = {"failed": 0.1, "add": 0.05, "rotation_deg": 12.0, "translation": 0.03}


@pytest.fixture
def intervals():
    rows = []
    for method, success in SUCCESS.items():
        values = {("success", concept): success for concept in KINDS}
        values |= {(metric, "all"): value for metric, value in ERRORS.items()} | {("success_10", "all"): 0.9}
        for (metric, concept), value in values.items():
            samples = 120 if concept == "all" else 40
            own = ("registration_methods", "pooled", method, metric, concept, 3, 5, samples)
            rows.append((*own, value, 0.8 * value, 1.1 * value))
    return pd.DataFrame(rows, columns=[*COLUMNS])


@pytest.fixture
def seconds():
    """The slower source has a quarter of the pairs."""
    rows = [
        ("registration_methods", source, method, metric, "all", seed, value)
        for source, values in {"ycb": (30, 0.02), "cups": (10, 0.06)}.items()
        for method in SUCCESS
        for metric, value in zip(("test_samples", "seconds", "points"), (*values, 100 * values[1] * 1e2), strict=True)
        for seed in range(3)
    ]
    return tidy(rows, "seconds")


def made(intervals, seconds, sources=SOURCES, left_out=None):
    return table11_registration(intervals, seconds, seconds, sources, METHODS, "fgr", left_out or {})


def test_starts_stand_apart_and_global_methods_have_none(intervals, seconds):
    table = made(intervals, seconds)
    assert [tuple(key for key, _ in labels) for labels in table.rows] == [
        ("initial", "gicp"), ("initial", "huber"), ("none", "fgr"), ("fgr", "gicp"), ("fgr", "huber")
    ]  # fmt: skip
    assert [labels[0][1] for labels in table.rows[1:4]] == ["Initial pose", "None", "FGR"]


def test_cells_have_the_intervals_over_families_and_times_have_none(intervals, seconds):
    table = made(intervals, seconds)
    cell = table.cells[0, "success_all"]
    assert (cell.mean, cell.seeds, cell.test_samples) == (pytest.approx(50), 3, 120)
    assert cell.bounds == pytest.approx((40, 55))
    assert table.cells[3, "milliseconds"].mean == pytest.approx(30)
    assert table.cells[3, "points"].mean == pytest.approx(300)  # of the pairs of both sources
    assert table.cells[3, "rotation_deg"].mean == pytest.approx(12)
    assert table.cells[3, "translation"].bounds == pytest.approx((2.4, 3.3))
    assert {row for row, key in table.best() if key == "success_all"} == {1, 3}
    text = table.markdown()
    assert "Over 3 seeds, 40 test samples each; in brackets: the 95 % interval of a bootstrap over families" in text
    assert "| Initial pose | GICP | 50.0 (40.0 to 55.0) |" in text


def test_causes_and_severities_have_columns_and_their_pairs_are_counted(intervals):
    table = table11_severity(intervals, SOURCES, METHODS, "fgr", {})
    assert list(table.columns)[:3] == ["noise_low", "noise_middle", "noise_high"]
    assert (0, "noise_low") in table.cells and (0, "noise_middle") not in table.cells
    assert "Pairs of all seeds, by column: 40, 0, 40, 40, 0, 40, 40, 0, 40." in table.markdown()
    assert "Over 3 seeds, 40 test samples each" in table.markdown()  # of all causes together


def test_allowing_larger_errors_has_a_column_each(intervals):
    table = table11_limits(intervals, SOURCES, METHODS, "fgr", {}, [0.05, 0.1])
    assert list(table.columns) == ["success_5", "success_10"]
    assert table.cells[0, "success_10"].mean == pytest.approx(90) and (0, "success_5") not in table.cells


def test_what_is_left_out_and_what_stands_in_is_said(intervals, seconds):
    left_out = {"KISS-Matcher": "kiss_matcher"}
    text = made(intervals, seconds, left_out=left_out).markdown()
    assert "Left out, as the package is not installed: KISS-Matcher needs the package kiss_matcher." in text
    assert "partly on procedural stand-ins" in text
    real = made(intervals, seconds, {"ycb": SOURCES["ycb"]})
    assert real.cells[0, "milliseconds"].mean == pytest.approx(20)
    assert "stand-in" not in real.caption
    assert real.latex().count("{") == real.latex().count("}")


def test_nothing_to_show_is_a_fault(intervals, seconds):
    none = {"icp": {"title": "ICP", "is_global": False}}
    with pytest.raises(InputError, match="has nothing to show"):
        table11_registration(intervals, seconds, seconds, SOURCES, none, "fgr", {})
    with pytest.raises(InputError, match="has nothing to show"):
        table11_severity(intervals[:0], SOURCES, METHODS, "fgr", {})
