"""From predictions under the controls to metrics, intervals and severities."""

import numpy as np
import pandas as pd
import pytest

from gpca.declarations.plan import Run
from gpca.evaluation.measures import POOLED, read_clustered, write_metrics
from gpca.experiments.controls import collect, collect_intervals, read_controls
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.control_samples import LABELS

RUN = Run({})


def rows_of(files, path):
    """Values by control, source, concept, method, metric and rival, and their differences."""
    write_metrics(collect_intervals(RUN, files), path)
    return read_clustered(path).set_index(["table", "source", "concept", "method", "metric", "against"]).sort_index()


def said(source, tested, control, explainer, wrong, samples=30):
    """Test samples of five objects of which the first so many are named wrongly, and are the most uncertain."""
    number = np.arange(samples)
    true = np.array(CONCEPTS)[number % 3]
    named = np.where(number < wrong, np.array(CONCEPTS)[(number + 1) % 3], true)
    scores = {f"score_{name}": np.where(named == name, 0.8, 0.1) for name in CONCEPTS}
    return pd.DataFrame(
        dict(zip(LABELS, (control, tested, explainer), strict=True))
        | {"sample": number, "split": "test", "object": [f"part_{n % 5}_1_{n}" for n in number]}
        | {"cluster": [f"part_{n % 5}" for n in number]}
        | {"concept_true": true, "concept_predicted": named, **scores}
        | {"bald": "" if explainer == "head" else 0.0, "entropy": np.where(number < wrong, 0.9, 0.2)}
        | {"abstained": False, "icp_calls": 0}
    )


@pytest.fixture
def files(tmp_path):
    paths = []
    for source, other in (("a", "b"), ("b", "a")):
        for seed in (100, 101):
            parts = [
                said(source, source, "paper", "gpca", 3),
                said(source, source, "density", "gpca", 9),
                said(source, other, "transfer", "gpca", 15),
                said(source, source, "paper", "head", 0),
                said(source, other, "transfer", "head", 6),
            ]
            paths.append(tmp_path / "controls" / source / f"seed{seed}.csv")
            write_csv(paths[-1], pd.concat(parts))
    return paths


def test_the_column_table_is_the_control_and_clusters_are_families_of_the_source(files):
    rows = collect(RUN, files).set_index(["table", "source", "method", "metric", "concept", "seed"])["value"]
    assert rows["density", "a", "gpca", "accuracy", "all", 100] == pytest.approx(0.7)
    assert rows["transfer", "b", "gpca", "accuracy", "a", 101] == pytest.approx(0.5)
    assert rows["paper", "a", "gpca", "auroc_error", "all", 100] == 1
    assert ("paper", "a", "head", "auroc_error", "all", 100) not in rows.index  # nothing is wrong
    assert rows["transfer", "b", "head", "test_samples", "a", 100] == 30
    assert set(read_controls(files)["cluster"]) == {f"{source}/part_{n}" for source in "ab" for n in range(5)}


def test_a_change_is_that_of_the_same_draws_of_objects_and_seeds(files, tmp_path):
    rows = rows_of(files, tmp_path / "control_intervals.csv")
    density = rows.loc["density", "a", "all", "gpca", "accuracy"]
    value, change = density.loc[""], density.loc["usual"]
    assert (value["samples"], value["seeds"], value["clusters"]) == (60, 2, 5)
    assert (value["value"], change["value"], change["other"]) == (pytest.approx(0.7), pytest.approx(-0.2), "paper")
    assert value["low"] < value["value"] < value["high"]
    # Both seeds and all objects err alike but for the first samples, so that the change hardly varies.
    assert change["low"] == pytest.approx(-0.2, abs=0.1)
    assert ("paper", "a", "all", "gpca", "accuracy", "usual") not in rows.index  # it would be compared with itself
    assert rows.loc[("transfer", POOLED, POOLED, "gpca", "accuracy", ""), "value"] == pytest.approx(0.5)
    assert rows.loc[("transfer", "b", "a", "gpca", "accuracy", ""), "samples"] == 60
    assert rows.loc[("paper", POOLED, "all", "gpca", "accuracy", ""), "samples"] == 120


def test_what_an_explainer_adds_is_that_of_the_same_control_and_draws(files, tmp_path):
    for path in files:
        known = pd.read_csv(path, keep_default_na=False)
        source = path.parent.name
        guesses = [said(source, source, control, "rule", 18).assign(icp_calls=4) for control in ("paper", "density")]
        write_csv(path, pd.concat([known, *guesses]))
    rows = rows_of(files, tmp_path / "control_intervals.csv")
    density = rows.loc["density", "a", "all", "gpca", "accuracy"]
    gain, lead = density.loc["trivial"], density.loc["rival"]
    assert (gain["other"], lead["other"]) == ("rule", "rule")
    assert gain["value"] == lead["value"] == pytest.approx(0.3)
    assert 0 < gain["low"] <= 0.3 <= gain["high"]
    rule = rows.loc["paper", POOLED, "all", "rule", "accuracy"]
    assert "trivial" not in rule.index and rule.loc["rival", "other"] == "head"
    assert rule.loc["rival", "value"] == pytest.approx(-0.6)
    assert rows.loc[("paper", "a", "all", "rule", "icp_calls", ""), "value"] == 4
    assert ("density", "a", "all", "rule", "icp_calls", "") not in rows.index


def test_a_control_of_some_seeds_is_compared_with_the_same_seeds_of_the_papers_protocol(files, tmp_path):
    parts = [said("a", "a", "paper", "gpca", 27)]
    write_csv(files[1], pd.concat(parts))  # another seed, in which all goes wrong
    density = rows_of(files, tmp_path / "control_intervals.csv").loc["density", "a", "all", "gpca", "accuracy"]
    assert density.loc["", "seeds"] == 1
    assert density["value"][["", "usual"]].tolist() == pytest.approx([0.7, -0.2])
