from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.metrics import collect, collect_timings, read_uncertainties
from gpca.attribution.predictions import write_predictions as written_by_the_suite
from gpca.classifier.scores import Attribution
from gpca.errors import InputError
from gpca.evaluation.measures import read_metrics

CONCEPTS = ("noise", "pose", "overlap")
TRUE = np.array(["noise", "noise", "pose", "pose", "pose"])
PREDICTED = np.array(["noise", "pose", "pose", "pose", "noise"])
SURE = np.zeros(5, dtype=bool)


def write_predictions(path, true=TRUE, predicted=PREDICTED, abstained=SURE, **columns):
    rows = pd.DataFrame(
        {"sample": range(len(true)), "split": "test", "object": "cat", "cluster": "pet", "concept_true": true}
        | {"concept_predicted": predicted}
        | {f"score_{concept}": 0.25 for concept in CONCEPTS}
        | {"abstained": abstained, "icp_calls": 0}
        | columns
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    rows.to_csv(path, index=False)
    return path


def value(metrics, metric, concept="all", seed=0):
    chosen = metrics[(metrics.metric == metric) & (metrics.concept == concept) & (metrics.seed == seed)]
    assert len(chosen) == 1
    return chosen.value.item()


def test_collect_is_tidy_and_looks_at_test_rows_only(tmp_path):
    split = ["test", "test", "test", "test", "train"]
    abstained = [False, False, True, False, False]
    first = write_predictions(tmp_path / "ycb" / "gpca" / "seed0.csv", split=split, abstained=abstained)
    second = write_predictions(tmp_path / "ycb" / "gpca" / "seed11.csv", predicted=TRUE)
    metrics = collect([first, second])
    assert list(metrics.columns) == ["table", "source", "method", "metric", "concept", "seed", "value"]
    assert (set(metrics.source), set(metrics.method)) == ({"ycb"}, {"gpca"})
    assert [value(metrics, "accuracy", of) for of in ("all", "noise", "pose")] == [2 / 4, 1 / 2, 1 / 2]
    assert [value(metrics, "test_samples", of) for of in ("all", "pose")] == [4, 2]
    assert value(metrics, "abstention_rate") == 1 / 4
    assert value(metrics, "accuracy", seed=11) == 1
    assert "overlap" not in set(metrics.concept)


def test_what_the_suite_writes_is_collected(tmp_path):
    """So the two ends of the prediction file cannot drift apart."""
    scores = np.array([[0.7, 0.2, 0.1], [0.1, 0.8, 0.1]])
    abstained = np.array([False, True])
    attribution = Attribution.of_scores(CONCEPTS, scores, seconds=0.1, icp_calls=[3, 4], abstained_N=abstained)
    labels = {"split": ["test"] * 2, "object_name": ["cat"] * 2, "cluster": ["pet"] * 2, "concept": ["noise", "pose"]}
    path = tmp_path / "ycb" / "gpca" / "seed0.csv"
    written_by_the_suite(path, SimpleNamespace(sample=np.arange(2), **labels), attribution)
    metrics = collect([path])
    assert [value(metrics, name) for name in ("accuracy", "icp_calls")] == [0.5, 3.5]


def test_confusion_is_collected_per_true_concept_and_sums_to_its_samples(tmp_path):
    abstained = [False, False, True, False, False]
    path = write_predictions(tmp_path / "ycb" / "gpca" / "seed0.csv", abstained=abstained, icp_calls=[0, 0, 5, 5, 10])
    metrics = collect([path])
    # noise: noise, pose; pose: (abstained), pose, noise.
    expected = {"noise": (1, 1, 0, 0), "pose": (1, 1, 0, 1)}
    for concept, counts in expected.items():
        names = [f"predicted_as_{name}" for name in (*CONCEPTS, "abstained")]
        assert tuple(value(metrics, name, concept) for name in names) == counts
        assert sum(counts) == value(metrics, "test_samples", concept)
    assert value(metrics, "icp_calls") == 4


def uncertainty_file(path, observed, clean, **columns):
    rows = {"sample": range(len(observed)), "split": "test", "uncertainty_observed": observed}
    path.parent.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(rows | {"uncertainty_clean": clean} | columns).to_csv(path, index=False)
    return path


def test_the_limit_of_uncertainties_is_the_95th_percentile_of_the_clean(tmp_path):
    path = uncertainty_file(tmp_path / "seed0.csv", [95.0, *np.zeros(99), 1000.0], np.arange(101.0))
    observed, limit = read_uncertainties(path)
    assert limit == 95 and observed["test", "100"] == 1000


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ({"uncertainty_clean": "low"}, "'uncertainty_clean' contains values that are not finite numbers"),
        ({"uncertainty_observed": np.inf}, "'uncertainty_observed' contains values that are not finite numbers"),
        ({"sample": 3}, "contains a sample twice"),
        ({"split": "tset"}, "'split'"),
    ],
)
def test_a_faulty_file_of_uncertainties_is_refused_in_one_line(tmp_path, columns, expected):
    path = uncertainty_file(tmp_path / "seed0.csv", np.ones(5), np.ones(5), **columns)
    with pytest.raises(InputError, match=expected) as caught:
        read_uncertainties(path)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)


def test_timings_are_means_over_the_test_samples(tmp_path):
    path = tmp_path / "ycb" / "gpca" / "seed3.csv"
    path.parent.mkdir(parents=True)
    path.write_text("sample,split,seconds,icp_seconds\n0,test,0.5,0.25\n1,test,1.5,0.75\n0,train,9,9\n")
    timings = collect_timings([path])
    assert [value(timings, f"{name}_per_sample", seed=3) for name in ("seconds", "icp_seconds")] == [1.0, 0.5]
    for row, expected in (("0,train,9,9", "no test rows"), ("0,test,nan,9", "'seconds'")):
        path.write_text(f"sample,split,seconds,icp_seconds\n{row}\n")
        with pytest.raises(InputError, match=expected):
            collect_timings([path])


def test_files_of_training_rows_or_of_other_names_are_refused(tmp_path):
    path = write_predictions(tmp_path / "ycb" / "gpca" / "seed0.csv", split="train")
    with pytest.raises(InputError, match="no test rows"):
        collect([path])
    with pytest.raises(InputError, match="is not named"):
        collect([write_predictions(tmp_path / "ycb" / "gpca" / "zero.csv")])
    with pytest.raises(InputError, match="no files"):
        collect([])


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda rows: rows.drop(columns="method"), "column 'method' is missing"),
        (lambda rows: rows.assign(value="much"), "'value'"),
        (lambda rows: rows.assign(seed="zero"), "'seed'"),
        (lambda rows: rows[:0], "no rows"),
    ],
)
def test_faulty_metrics_are_refused(tmp_path, change, expected):
    metrics = collect([write_predictions(tmp_path / "ycb" / "gpca" / "seed0.csv")])
    change(metrics).to_csv(tmp_path / "metrics.csv", index=False)
    with pytest.raises(InputError, match=expected):
        read_metrics(tmp_path / "metrics.csv")
