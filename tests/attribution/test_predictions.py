from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from gpca.attribution.predictions import read_predictions, read_timings, write_predictions, write_timings
from gpca.classifier.scores import Attribution
from gpca.errors import InputError
from gpca.io.csv_file import ANY, read_columns, read_csv, read_numbers, write_columns, write_csv
from gpca.pairs.perturbation import CONCEPTS


def attribution(n, seed=0, **changed):
    random = np.random.default_rng(seed)
    given = {"variances_N_C": random.uniform(size=(n, 3)), "bald_N": random.uniform(size=n), "icp_calls": np.arange(n)}
    return Attribution.of_scores(CONCEPTS, random.dirichlet([1, 1, 1], n), seconds=0.0, **(given | changed))


def prediction_file(path, **columns):
    """Five predictions by hand, some columns replaced."""
    rows = {"sample": range(5), "split": "test", "object": "cat", "cluster": "pet"}
    rows |= {"concept_true": "pose", "concept_predicted": "pose"}
    rows |= {f"score_{concept}": 0.25 for concept in CONCEPTS} | {"abstained": False, "icp_calls": 0}
    pd.DataFrame(rows | columns, index=range(5)).to_csv(path, index=False)
    return path


def test_the_prediction_file_has_the_columns_and_values_of_the_schema(tmp_path, registrations):
    made = attribution(len(registrations), abstained_N=np.arange(len(registrations)) == 4)
    path = tmp_path / "ycb" / "gpca" / "seed0.csv"
    write_predictions(path, registrations, made)
    rows = read_predictions(path)
    assert list(rows.columns) == [
        *("sample", "split", "object", "cluster", "concept_true", "concept_predicted"),
        *("score_noise", "score_pose", "score_overlap", "variance_noise", "variance_pose", "variance_overlap"),
        *("bald", "entropy", "abstained", "icp_calls"),
    ]
    same = {"sample": registrations.sample.astype(str), "object": registrations.object_name}
    same |= {"concept_true": registrations.concept, "concept_predicted": made.predicted_N}
    for name, column in (same | {"icp_calls": made.icp_calls_N}).items():
        assert rows[name].tolist() == column.tolist(), name
    assert rows.loc[4, "concept_predicted"] == "" and rows["abstained"].sum() == 1
    numbers = np.column_stack([made.scores_N_C, made.variances_N_C, made.bald_N])
    assert np.allclose(rows.filter(regex="score_|variance_|bald").astype(float), numbers, atol=5.1e-7)


def test_timings_survive_the_file_and_must_be_of_the_same_samples(tmp_path, registrations):
    path = tmp_path / "seed0.csv"
    first = replace(registrations.subset(np.arange(2)), sample=np.array([3, 3]), split=np.array(["train", "test"]))
    with pytest.raises(InputError, match="no such file"):
        read_timings(path, first)
    write_timings(path, first, np.array([0.5, 0.25]), np.array([0.125, 0.0]))
    seconds, icp_seconds = read_timings(path, first)
    assert (seconds.tolist(), icp_seconds.tolist()) == ([0.5, 0.25], [0.125, 0.0])
    for wrong in (first.subset(np.arange(1)), replace(first, split=first.split[::-1])):
        with pytest.raises(InputError, match="its samples differ from those of the registrations") as caught:
            read_timings(path, wrong)
        assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ({"concept_true": "dust"}, "unknown concept 'dust'"),
        ({"sample": 7}, "sample twice"),
        ({"score_pose": np.nan}, "'score_pose'"),
        ({"variance_pose": "wide"}, "'variance_pose'"),
        ({"icp_calls": "many"}, "'icp_calls'"),
        ({"score": 0.5}, "column 'score' is unknown"),
    ],
)
def test_faulty_predictions_are_refused(tmp_path, columns, expected):
    path = prediction_file(tmp_path / "seed0.csv", **columns)
    with pytest.raises(InputError, match=expected) as caught:
        read_predictions(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


def test_a_variance_may_be_empty_and_an_abstained_sample_needs_neither_concept_nor_scores(tmp_path):
    path = prediction_file(
        tmp_path / "seed0.csv",
        concept_predicted=["", *["pose"] * 4],
        abstained=["True", *["False"] * 4],
        score_noise=["", 0.1, 0.1, 0.1, 0.1],
        variance_noise=[np.nan, 0.1, 0.1, 0.1, 0.1],
    )
    rows = read_predictions(path)
    assert rows["abstained"].tolist() == [True, False, False, False, False]
    assert rows["score_noise"].isna().tolist() == rows["variance_noise"].isna().tolist() == rows["abstained"].tolist()


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, "no such file"),
        (b"", "is empty"),
        (b"sample,seconds\n", "no rows"),
        (b"sample\n1\n", "column 'seconds' is missing"),
        (b"\xff\xfe\x00", "not a readable CSV"),
        (b'a,b\n"1,2\n3', "not a readable CSV"),
        (b"sample,seconds,minutes\n1,2,3\n", "column 'minutes' is unknown"),
        (b"sample,seconds,split\n1,2,tset\n", "column 'split' is unknown"),
        (b'sample,seconds\n1,"2\n3"\n', "column 'seconds' contains a line break"),
    ],
)
def test_unreadable_files_are_refused_in_one_line(tmp_path, content, expected):
    path = tmp_path / "seed0.csv"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=expected) as caught:
        read_csv(path, ("sample", "seconds"))
    assert "\n" not in str(caught.value)


def test_further_columns_other_orders_and_quotes_are_read_too(tmp_path):
    (tmp_path / "a.csv").write_text("sample,score_pose,own\n1,2,3\n")
    assert list(read_csv(tmp_path / "a.csv", ["sample"], ["score_*", "own"])) == ["sample", "score_pose", "own"]
    assert len(read_csv(tmp_path / "a.csv", ["sample"], ANY)) == 1
    path = tmp_path / "seconds.csv"
    path.write_text('seconds,split\n0.5,"test"\n')
    rows = read_columns(path, ("split", "seconds"), ("seconds",))
    assert (list(rows["split"]), list(rows["seconds"])) == (["test"], [0.5])


def test_columns_are_written_and_read_as_by_pandas(tmp_path):
    random = np.random.default_rng(0)
    columns = {
        "sample": np.arange(300),
        "split": np.array(["train", "test"] * 150),
        "object": np.array(["a cup", 'a "cup"', "a, cup", "", " é", "1.0"] * 50),
        "seconds": random.normal(size=300) * 10.0 ** random.integers(-9, 9, size=300),
        "score_pose": np.where(np.arange(300) % 7, random.random(300), np.nan).astype(np.float32),
        "abstained": np.arange(300) % 2 == 0,
    }
    write_csv(tmp_path / "pandas.csv", pd.DataFrame(columns), "%.6f")
    write_columns(tmp_path / "own.csv", columns)
    assert (tmp_path / "own.csv").read_bytes() == (tmp_path / "pandas.csv").read_bytes()
    names = ("sample", "split", "seconds")
    write_columns(tmp_path / "own.csv", {name: columns[name] for name in names})
    own, expected = (read(tmp_path / "own.csv", names, ("seconds",)) for read in (read_columns, read_numbers))
    assert isinstance(own, dict)
    for name in names:
        assert list(own[name]) == list(expected[name])


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (None, "no such file"),
        ("", "is empty"),
        ("split,seconds\n", "no rows"),
        ("split\ntest\n", "column 'seconds' is missing"),
        ("split,seconds,minutes\ntest,2,3\n", "column 'minutes' is unknown"),
        ("split,seconds\ntset,2\n", "a split that is neither"),
        ("split,seconds\ntest,2_0\n", "not finite numbers"),
        ("split,seconds\ntest,inf\n", "not finite numbers"),
        ("split,seconds\ntest\n", "not finite numbers"),
        ('split,seconds\n"te\x07st",2\n', "a line break or another control character"),
    ],
)
def test_faulty_columns_are_refused_as_by_pandas(tmp_path, content, expected):
    path = tmp_path / "seconds.csv"
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match=expected):
        read_columns(path, ("split", "seconds"), ("seconds",))
