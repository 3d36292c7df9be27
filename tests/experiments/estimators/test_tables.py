"""Table XII."""

import pytest

from gpca.attribution.metrics import tidy
from gpca.errors import InputError
from gpca.experiments.estimators.tables import table12_uncertainty

SOURCES = {"ycb": {"title": "YCB", "stand_in": False}, "cups": {"title": "Cups", "stand_in": True}}
ESTIMATORS, METHODS = {"censi": "Censi", "brossard": "Brossard"}, {"point_to_point": "ICP", "point_to_plane": "Plane"}
VALUES = {"kl_rotation": 2.0, "nees": 3.0, "coverage": 0.5, "auroc_failed": 0.7, "no_estimate": 0.25}


def records(metric, value, step=0.01):
    return [
        ("estimators", source, name, metric, method, seed, value(source, name) + step * seed)
        for source in SOURCES
        for name in ("reference", *ESTIMATORS)
        for method in METHODS
        for seed in range(3)
    ]


@pytest.fixture
def metrics():
    found = records("test_samples", lambda source, _: {"ycb": 30, "cups": 10}[source], step=0)
    for metric, size in VALUES.items():
        of = {name: size * (1 + (name == "censi")) for name in ("reference", *ESTIMATORS)}
        found += records(metric, lambda source, name, of=of: of[name] * (1 + (source == "cups")))
    return tidy(found, "estimates")


@pytest.fixture
def seconds():
    return tidy(records("seconds", lambda *_: 0.02), "seconds")


def made(metrics, seconds, sources=SOURCES):
    return table12_uncertainty(metrics, seconds, sources, ESTIMATORS, METHODS, {"starts": 1000})


def test_methods_stand_apart_and_the_reference_comes_first(metrics, seconds):
    table = made(metrics, seconds)
    names = [tuple(key for key, _ in labels) for labels in table.rows]
    assert names == [(m, n) for m in METHODS for n in ("reference", "censi", "brossard")]
    assert table.rows[0][1][1] == "Reference, 1000 starts"


def test_sources_count_by_their_registrations(metrics, seconds):
    cell = made(metrics, seconds).cells[2, "kl_rotation"]  # Brossard's: 2 and, of a quarter, 4
    assert cell.mean == pytest.approx(2.5 + 0.01)
    assert (cell.seeds, cell.test_samples) == (3, 120)
    assert made(metrics, seconds).cells[2, "milliseconds"].mean == pytest.approx(30)


def test_the_reference_has_no_divergence_and_competes_with_none(metrics, seconds):
    table = made(metrics, seconds)
    assert (0, "kl_rotation") not in table.cells
    assert table.best() == {(2, "kl_rotation"), (5, "kl_rotation"), (1, "auroc_failed"), (4, "auroc_failed")}


def test_an_estimator_that_refuses_all_has_no_row_and_is_named(metrics, seconds):
    refused = (metrics["method"] == "censi") & ~metrics["metric"].isin(["no_estimate", "test_samples"])
    table = made(metrics[~(refused & (metrics["concept"] == "point_to_plane"))], seconds)
    assert [labels[1][0] for labels in table.rows] == ["reference", "censi", "brossard", "reference", "brossard"]
    assert "Left out, as they refuse every registration: Censi, of Plane." in table.markdown()
    assert "Left out" not in made(metrics, seconds).markdown()


def test_an_interval_beyond_the_value_of_a_divergence_is_left_out(metrics, seconds):
    wide = (metrics["metric"] == "kl_rotation") & (metrics["seed"] == 2) & (metrics["method"] == "brossard")
    metrics.loc[wide, "value"] *= 100
    table = made(metrics, seconds)
    assert table.cells[2, "kl_rotation"].half_width > table.cells[2, "kl_rotation"].mean
    assert "| Brossard | 85.67 | – |" in table.markdown()
    [record] = [r for r in table.records() if r[:3] == ("point_to_point", "brossard", "kl_rotation")]
    assert record[4] == 0 and record[5] > 2 * record[3]  # the CSV has it


def test_the_notes_say_what_was_counted(metrics, seconds):
    text = made(metrics, seconds).markdown()
    assert "Mean over 3 seeds; ±" in text
    assert "Registrations of each seed: 40 by ICP; 40 by Plane." in text
    assert "Monte-Carlo with 1000 starts" in text
    assert "stand-in" in text


def test_nothing_to_show_is_one_line(metrics, seconds):
    with pytest.raises(InputError, match="has nothing to show"):
        made(metrics[metrics["source"] == "none"], seconds)
