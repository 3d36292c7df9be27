"""Tables XI."""

import pytest

from gpca.attribution.metrics import tidy
from gpca.errors import InputError
from gpca.experiments.registration_methods.tables import table11_limits, table11_registration, table11_severity
from gpca.pairs.perturbation import CONCEPTS

SOURCES = {"ycb": {"title": "YCB", "stand_in": False}, "cups": {"title": "Cups", "stand_in": True}}
METHODS = {
    "gicp": {"title": "GICP", "is_global": False},
    "huber": {"title": "Huber", "is_global": False},
    "fgr": {"title": "FGR", "is_global": True},
}
SUCCESS = {"gicp": 0.5, "huber": 0.7, "fgr": 0.2, "fgr+gicp": 0.6, "fgr+huber": 0.4}
KINDS = ("all", *CONCEPTS, *(f"{cause}_{severity}" for cause in CONCEPTS for severity in ("low", "high")))


def records(metric, of, seeds=3):
    return [
        ("registration_methods", source, method, metric, concept, seed, of(source, method, concept) + 0.02 * seed)
        for source in SOURCES
        for method in SUCCESS
        for concept in KINDS
        for seed in range(seeds)
    ]


def samples(source, _method, _concept):
    return {"ycb": 30, "cups": 10}[source]


@pytest.fixture
def metrics():
    rows = records("success", lambda source, method, _: SUCCESS[method] + (0.2 if source == "cups" else 0))
    for name, size in {"failed": 0.1, "add": 0.05, "rotation_deg": 12.0, "translation": 0.03}.items():
        rows += records(name, lambda *_, size=size: size)
    rows += [(*row[:-1], samples(*row[1:4:2], "")) for row in records("test_samples", lambda *_: 0)]
    return tidy(rows, "registration methods")


@pytest.fixture
def seconds():
    return tidy([row for row in records("seconds", lambda *_: 0.025) if row[4] == "all"], "seconds")


def made(metrics, seconds, sources=SOURCES, left_out=None):
    return table11_registration(metrics, seconds, sources, METHODS, "fgr", left_out or {})


def test_starts_stand_apart_and_global_methods_have_none(metrics, seconds):
    table = made(metrics, seconds)
    assert [tuple(key for key, _ in labels) for labels in table.rows] == [
        ("initial", "gicp"), ("initial", "huber"), ("none", "fgr"), ("fgr", "gicp"), ("fgr", "huber")
    ]  # fmt: skip
    assert [labels[0][1] for labels in table.rows[1:4]] == ["Initial pose", "None", "FGR"]


def test_sources_count_by_their_pairs_and_intervals_are_over_the_seeds(metrics, seconds):
    table = made(metrics, seconds)
    cell = table.cells[0, "success_all"]
    assert cell.mean == pytest.approx(100 * (0.75 * 0.5 + 0.25 * 0.7 + 0.02))
    assert (cell.seeds, cell.test_samples) == (3, 120)
    assert cell.half_width == pytest.approx(4.3027 * 2 / 3**0.5, rel=1e-3)
    assert table.cells[3, "milliseconds"].mean == pytest.approx(45)
    assert table.cells[3, "rotation_deg"].mean == pytest.approx(12.02)
    assert {row for row, key in table.best() if key == "success_all"} == {1, 3}
    assert "Mean over 3 seeds, 40 test samples each" in table.markdown()


def test_causes_and_severities_have_columns_and_their_pairs_are_counted(metrics):
    table = table11_severity(metrics, SOURCES, METHODS, "fgr", {})
    assert list(table.columns)[:3] == ["noise_low", "noise_middle", "noise_high"]
    assert (0, "noise_low") in table.cells and (0, "noise_middle") not in table.cells
    assert "Pairs of all seeds, by column: 120, 0, 120, 120, 0, 120, 120, 0, 120." in table.markdown()


def test_allowing_larger_errors_has_a_column_each(metrics):
    own = records("success_10", lambda *_: 0.9) + [row for row in records("test_samples", samples) if row[4] == "all"]
    for row in (row for row in metrics.itertuples(index=False) if row.metric == "success"):
        own.append(tuple(row))
    table = table11_limits(tidy(own, "methods"), SOURCES, METHODS, "fgr", {}, [0.05, 0.1])
    assert list(table.columns) == ["success_5", "success_10"]
    assert table.cells[0, "success_10"].mean == pytest.approx(92) and (0, "success_5") not in table.cells


def test_what_is_left_out_and_what_stands_in_is_said(metrics, seconds):
    left_out = {"KISS-Matcher": "kiss_matcher"}
    text = made(metrics, seconds, left_out=left_out).markdown()
    assert "Left out, as the package is not installed: KISS-Matcher needs the package kiss_matcher." in text
    assert "partly on procedural stand-ins" in text
    real = made(metrics, seconds, {"ycb": SOURCES["ycb"]})
    assert real.cells[0, "success_all"].mean == pytest.approx(52)
    assert "stand-in" not in real.caption
    assert real.latex().count("{") == real.latex().count("}")


def test_nothing_to_show_is_a_fault(metrics, seconds):
    with pytest.raises(InputError, match="has nothing to show"):
        table11_registration(metrics, seconds, SOURCES, {"icp": {"title": "ICP", "is_global": False}}, "fgr", {})
    with pytest.raises(InputError, match="has nothing to show"):
        table11_severity(metrics, {}, METHODS, "fgr", {})
