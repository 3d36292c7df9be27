import numpy as np
import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.metrics import (
    accuracy,
    collect,
    collect_timings,
    concept_accuracy,
    mean_interval,
    read_metrics,
    read_predictions,
    write_metrics,
)

CONCEPTS = ("noise", "pose", "overlap")
TRUE = np.array(["noise", "noise", "pose", "pose", "pose"])
PREDICTED = np.array(["noise", "pose", "pose", "pose", "noise"])
SURE = np.zeros(5, dtype=bool)


def write_predictions(path, true=TRUE, predicted=PREDICTED, abstained=SURE, **columns):
    rows = pd.DataFrame(
        {"sample": range(len(true)), "split": "test", "object": "cat", "concept_true": true}
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


def test_accuracy_counts_abstained_samples_as_wrong():
    assert accuracy(TRUE, PREDICTED, SURE) == 3 / 5
    assert accuracy(TRUE, PREDICTED, np.array([True, True, False, False, False])) == 2 / 5
    with pytest.raises(ValueError, match="no samples"):
        accuracy(TRUE[:0], PREDICTED[:0], SURE[:0])


def test_concept_accuracy_is_recall_and_leaves_out_absent_concepts():
    assert concept_accuracy(TRUE, PREDICTED, SURE, CONCEPTS) == {"noise": 1 / 2, "pose": 2 / 3}


def test_mean_interval_against_a_worked_example():
    # Three repeats 1, 2, 3: s = 1, t_2(0.975) = 4.302653, half-width 4.302653 / sqrt(3).
    mean, low, high = mean_interval([1, 2, 3])
    assert mean == 2
    assert high - mean == pytest.approx(2.484138, abs=1e-6)
    assert mean - low == pytest.approx(high - mean)


def test_mean_interval_covers_the_true_mean_as_often_as_it_says():
    draws = np.random.default_rng(0).normal(size=(2000, 5))
    covered = [low <= 0 <= high for _, low, high in map(mean_interval, draws)]
    assert np.mean(covered) == pytest.approx(0.95, abs=0.02)


def test_mean_interval_of_one_none_and_unfinished_repeats():
    mean, low, high = mean_interval([0.7])
    assert mean == 0.7
    assert np.isnan([low, high]).all()
    assert np.isnan(mean_interval([0.7, np.nan])).all()
    with pytest.raises(ValueError, match="no repeats"):
        mean_interval([])


def test_collect_is_tidy_and_looks_at_test_rows_only(tmp_path):
    split = ["test", "test", "test", "test", "train"]
    abstained = [False, False, True, False, False]
    first = write_predictions(tmp_path / "ycb" / "gpca" / "seed0.csv", split=split, abstained=abstained)
    second = write_predictions(tmp_path / "ycb" / "gpca" / "seed11.csv", predicted=TRUE)
    metrics = collect([first, second])
    assert list(metrics.columns) == ["table", "source", "method", "metric", "concept", "seed", "value"]
    assert set(metrics.source) == {"ycb"}
    assert set(metrics.method) == {"gpca"}
    assert value(metrics, "accuracy") == 2 / 4
    assert value(metrics, "accuracy", "noise") == 1 / 2
    assert value(metrics, "accuracy", "pose") == 1 / 2
    assert value(metrics, "test_samples") == 4
    assert value(metrics, "test_samples", "pose") == 2
    assert value(metrics, "abstention_rate") == 1 / 4
    assert value(metrics, "accuracy", seed=11) == 1
    assert "overlap" not in set(metrics.concept)


def test_an_abstained_sample_needs_neither_concept_nor_scores(tmp_path):
    path = write_predictions(
        tmp_path / "ycb" / "gpca" / "seed0.csv",
        predicted=["", *PREDICTED[1:]],
        abstained=["True", "False", "0", "0", "false"],
        score_noise=["", 0.1, 0.1, 0.1, 0.1],
    )
    assert value(collect([path]), "accuracy", "noise") == 0


def test_an_explainer_without_variances_leaves_them_empty(tmp_path):
    path = write_predictions(tmp_path / "ycb" / "shap" / "seed0.csv", variance_noise=[np.nan, 0.1, 0.1, 0.1, 0.1])
    assert read_predictions(path)["variance_noise"].isna().tolist() == [True, False, False, False, False]
    write_predictions(path, variance_noise="wide")
    with pytest.raises(InputError, match="variance_noise"):
        read_predictions(path)


def test_what_the_suite_writes_can_be_read(tmp_path):
    # The writer's own frame, so that the two ends of the prediction file cannot drift apart.
    from types import SimpleNamespace

    from gpca.attribution import Attribution, write_predictions

    scores = np.array([[0.7, 0.2, 0.1], [0.1, 0.8, 0.1]])
    nothing = np.full(2, np.nan)
    attribution = Attribution(
        CONCEPTS, scores, nothing[:, None] + scores, nothing, np.array([False, True]), *[nothing] * 3
    )
    labels = {"split": ["test"] * 2, "object_name": ["cat"] * 2, "concept": ["noise", "pose"]}
    path = tmp_path / "ycb" / "gpca" / "seed0.csv"
    write_predictions(path, SimpleNamespace(sample=np.arange(2), **labels), attribution)
    assert value(collect([path]), "accuracy") == 0.5


def test_metrics_survive_the_file_unchanged_and_have_the_same_bytes(tmp_path):
    metrics = collect([write_predictions(tmp_path / "ycb" / "gpca" / "seed0.csv")])
    write_metrics(metrics, tmp_path / "a.csv")
    write_metrics(read_metrics(tmp_path / "a.csv"), tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    pd.testing.assert_frame_equal(read_metrics(tmp_path / "a.csv"), metrics, check_dtype=False)


def test_timings_are_means_per_sample(tmp_path):
    path = tmp_path / "ycb" / "gpca" / "seed3.csv"
    path.parent.mkdir(parents=True)
    path.write_text("sample,seconds,icp_seconds\n0,0.5,0.25\n1,1.5,0.75\n")
    timings = collect_timings([path])
    assert value(timings, "seconds_per_sample", seed=3) == 1.0
    assert value(timings, "icp_seconds_per_sample", seed=3) == 0.5


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ({"concept_true": "dust"}, "unknown concept 'dust' in 'concept_true'"),
        ({"concept_predicted": ""}, "unknown concept ''"),
        ({"abstained": "perhaps"}, "'abstained'"),
        ({"split": "validation"}, "'split'"),
        ({"sample": 7}, "sample twice"),
        ({"score_pose": "high"}, "'score_pose'"),
        ({"score_pose": np.nan}, "'score_pose'"),
        ({"split": "train"}, "no test rows"),
    ],
)
def test_faulty_rows_are_refused(tmp_path, columns, expected):
    path = write_predictions(tmp_path / "ycb" / "gpca" / "seed0.csv", **columns)
    with pytest.raises(InputError, match=expected) as caught:
        collect([path])
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("column", ["sample", "split", "object", "concept_true", "concept_predicted", "abstained"])
def test_a_missing_column_is_named(tmp_path, column):
    path = write_predictions(tmp_path / "seed0.csv")
    pd.read_csv(path).drop(columns=column).to_csv(path, index=False)
    with pytest.raises(InputError, match=f"column '{column}' is missing"):
        read_predictions(path)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, "no such file"),
        (b"", "is empty"),
        (b"sample,split,object,concept_true,concept_predicted,abstained\n", "no rows"),
        (b"\xff\xfe\x00", "not a readable CSV"),
        (b'a,b\n"1,2\n3', "not a readable CSV"),
    ],
)
def test_unreadable_files_are_refused_in_one_line(tmp_path, content, expected):
    path = tmp_path / "seed0.csv"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=expected) as caught:
        read_predictions(path)
    assert "\n" not in str(caught.value)


def test_file_names_carry_source_explainer_and_seed(tmp_path):
    with pytest.raises(InputError, match="is not named"):
        collect([write_predictions(tmp_path / "ycb" / "gpca" / "zero.csv")])
    with pytest.raises(InputError, match="no files"):
        collect([])
