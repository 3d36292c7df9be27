"""Measures by seed, over seeds, and against rivals: one form of rows."""

import numpy as np
import pandas as pd
import pytest

from gpca.evaluation import measures as m
from gpca.evaluation.intervals import REPEATS, Clustered
from gpca.evaluation.measures import (
    ALL,
    TIDY_COLUMNS,
    Measure,
    compared,
    intervals,
    over_seeds,
    per_seed,
    write_metrics,
)

MEASURES = {
    "right": Measure("right"),
    "error": Measure(lambda rows: rows["error"], (0, np.inf), only=(ALL,), factor=100),
    "worst": Measure(statistic=lambda rows, weights: np.full(len(weights), rows["error"].max()), limits=(0, 1)),
}


@pytest.fixture
def samples():
    """Two methods on the same 24 samples of three families in two seeds; the second is always right."""
    random, frames = np.random.default_rng(0), []
    for method in ("gpca", "rule"):
        right = random.random(24) < (0.5 if method == "gpca" else 1.1)
        columns = {"table": "t", "source": "ycb", "method": method, "seed": np.repeat([0, 1], 12), "right": right}
        columns |= {"cluster": np.tile(["a", "b", "c"], 8), "error": np.linspace(0, 0.46, 24)}
        frames.append(pd.DataFrame(columns))
    return pd.concat(frames, ignore_index=True)


def parts(rows):
    return {ALL: np.ones(len(rows), bool), "a": (rows["cluster"] == "a").to_numpy(), "none": np.zeros(len(rows), bool)}


def draws(samples):
    return Clustered.drawn(samples["seed"], samples["cluster"], "tiny")


def value(rows, column="value", **wanted):
    for name, entry in wanted.items():
        rows = rows[rows[name] == entry]
    [found] = rows[column]
    return found


def test_values_by_seed_are_means_and_statistics_of_each_part(samples):
    rows = per_seed(samples, parts, MEASURES)
    assert tuple(rows.columns) == TIDY_COLUMNS
    own = samples[(samples["method"] == "gpca") & (samples["seed"] == 1)]
    about = {"method": "gpca", "seed": 1, "concept": ALL}
    assert value(rows, metric="right", **about) == own["right"].mean()
    assert value(rows, metric="error", **about) == pytest.approx(100 * own["error"].mean())
    assert value(rows, metric="worst", **about) == own["error"].max()
    assert value(rows, metric="test_samples", **about) == 12
    assert value(rows, metric="test_samples", method="gpca", seed=1, concept="a") == 4
    assert not ((rows["metric"] == "error") & (rows["concept"] == "a")).any() and "none" not in set(rows["concept"])
    counted = per_seed(samples, parts, {"test_samples": m.COUNT, "right": Measure("right")})
    assert counted["metric"].tolist()[:2] == ["test_samples", "right"]


def test_over_all_seeds_a_value_is_that_of_the_samples_with_the_interval_of_its_kind(samples):
    rows, drawn = over_seeds(samples, parts, MEASURES, draws(samples)), draws(samples)
    assert tuple(rows.columns) == m.COLUMNS
    of_gpca = (samples["method"] == "gpca").to_numpy()
    share = drawn.subset(of_gpca).share(samples["right"].to_numpy()[of_gpca])
    about = {"method": "gpca", "metric": "right", "concept": ALL}
    assert [value(rows, name, **about) for name in ("value", "low", "high")] == list(share)
    assert [value(rows, name, **about) for name in ("seeds", "clusters", "samples")] == [2, 3, 24]
    assert value(rows, "high", method="gpca", metric="worst", concept=ALL) == pytest.approx(0.46)
    always = rows[(rows["method"] == "rule") & (rows["metric"] == "right")]
    assert (always["low"] < 1).all() and (always["high"] == 1).all()


def test_a_difference_is_a_row_with_what_it_is_measured_against(samples):
    drawn = draws(samples).subset(np.arange(24))
    values = {"gpca": np.full(1 + REPEATS, 0.5), "rule": np.full(1 + REPEATS, 0.7), "chance": np.full(1 + REPEATS, 0.3)}
    values["gpca"][1:] += np.linspace(-0.2, 0.2, REPEATS)
    values["lost"] = np.full(1 + REPEATS, np.nan)
    against = {"rival": lambda method, names: names, "untrained": lambda method, names: ("chance",)}
    records = compared(("t", "ycb"), "right", ALL, values, drawn, m.SHARE, against)
    rows = intervals(records, "tiny").set_index(["method", "against"])
    assert "lost" not in set(rows.index.get_level_values("method"))
    assert rows.loc[("gpca", ""), "value"] == 0.5
    assert rows.loc[("gpca", "rival"), ["other", "value"]].tolist() == ["rule", pytest.approx(-0.2)]
    assert rows.loc[("rule", "rival"), "other"] == "gpca"
    gain = rows.loc[("gpca", "untrained")]
    assert (gain["other"], gain["value"]) == ("chance", pytest.approx(0.2)) and gain["low"] < 0.2 < gain["high"]
    assert ("chance", "untrained") not in rows.index  # no rival of itself
    least = compared(("t", "ycb"), "regret", ALL, values, drawn, (0, 1), against, least_is_best=True)
    assert intervals(least, "x").set_index(["method", "against"]).loc[("gpca", "rival"), "other"] == "chance"


def test_files_of_both_forms_are_read_back(samples, tmp_path):
    write_metrics(per_seed(samples, parts, MEASURES), tmp_path / "seeds.csv")
    assert tuple(m.read_rows(tmp_path / "seeds.csv").columns) == TIDY_COLUMNS
    write_metrics(over_seeds(samples, parts, MEASURES, draws(samples)), tmp_path / "intervals.csv")
    assert m.read_rows(tmp_path / "intervals.csv")["against"].eq("").all()
    drawn = draws(samples).subset(np.arange(24))
    values = {name: np.full(1 + REPEATS, share) for name, share in {"a": 0.5, "b": 0.4}.items()}
    records = compared(("t", "s"), "m", ALL, values, drawn, against={"rival": lambda method, names: names})
    write_metrics(intervals(records, "tiny"), tmp_path / "against.csv")
    rows = m.read_clustered(tmp_path / "against.csv")
    assert rows[list(m.AGAINST)].to_numpy().tolist() == [["", ""], ["rival", "b"], ["", ""], ["rival", "a"]]


def test_a_difference_from_what_was_measured_in_another_place_may_be_farther_than_values_here():
    def row(method, value, low, high, kind="", other=""):
        return ("hard", "ycb", method, "accuracy", ALL, kind, other, 2, 9, 200, value, low, high)

    measured = [row("gpca", 0.45, 0.4, 0.5), row("rule", 0.32, 0.3, 0.4)]
    differences = [
        row("gpca", -0.55, -0.6, -0.5, "usual", "paper"),
        row("gpca", 0.13, -0.3, 0.4, "rival", "rule"),
    ]
    rows = intervals(measured + differences, "controls", most=1.0)
    low, high = (value(rows, name, against="usual") for name in ("low", "high"))
    assert -1 < low < -0.6 < -0.55 < -0.5 < high < 0
    assert value(rows, "low", against="rival") == pytest.approx(-0.2)  # from the least here to the most
