import math

import pandas as pd
import pytest

from gpca.active_learning import curves as module
from gpca.active_learning.curves import POOL_COLUMNS, STREAM_COLUMNS, collect_curves, read_curves, write_curves
from gpca.errors import InputError


def pool_curve(*accuracies):
    return [
        {"labels": 4 * n, "new_labels": n, "accuracy": a, "accuracy_new": a / 2, "epochs": 3 * (n > 0), "select_s": 1.0}
        for n, a in enumerate(accuracies)
    ]


def stream_curve(*accuracies_new):
    return [
        {
            "arrived": 10 * n, "present": int(n >= 2), "labels": n, "new_labels": n // 2,
            "running": math.nan if n == 0 else 0.8, "accuracy": 0.9, "accuracy_new": a,
        }
        for n, a in enumerate(accuracies_new)
    ]  # fmt: skip


def pool_metrics(*accuracies):
    return module.pool_metrics(pd.DataFrame(pool_curve(*accuracies)), target=0.9)


def test_labels_and_epochs_count_to_the_first_time_that_the_target_is_reached():
    metrics = pool_metrics(0.6, 0.7, 0.9, 0.8, 0.95)
    assert (metrics["labels_to_target"], metrics["epochs_to_target"], metrics["reached"]) == (8, 6, 1)
    assert metrics["epochs_at_target"] == 3
    assert (metrics["start_accuracy"], metrics["final_accuracy"], metrics["final_accuracy_new"]) == (0.6, 0.95, 0.475)
    metrics = pool_metrics(0.6, 0.7, 0.8)  # a target that is missed counts with all labels
    assert (metrics["labels_to_target"], metrics["epochs_to_target"], metrics["reached"]) == (8, 6, 0)


@pytest.mark.parametrize(
    ("accuracies", "area"), [((0.5, 0.5, 0.5), 0.5), ((0.0, 1.0), 0.5), ((0.0, 1.0, 1.0), 0.75), ((0.7,), 0.7)]
)
def test_the_area_is_the_mean_accuracy_over_the_budget(accuracies, area):
    assert pool_metrics(*accuracies)["area_under_curve"] == pytest.approx(area)


@pytest.mark.parametrize(
    ("accuracies", "delay", "recognized"),
    [
        ((0.0, 0.6, 0.1, 0.4, 0.5, 0.2), 20, 1),  # recognized at 10 already, by chance, before any of it was there
        ((0.0, 0.9, 0.1, 0.4), 10, 0),  # never: the rest of the stream
    ],
)
def test_the_delay_counts_from_the_first_arrival_of_the_new_concept(accuracies, delay, recognized):
    metrics = module.stream_metrics(pd.DataFrame(stream_curve(*accuracies)))
    found = metrics["delay"], metrics["recognised"], metrics["labels"]
    assert found == (delay, recognized, len(accuracies) - 1)


@pytest.fixture
def files(tmp_path):
    curves = {
        "random": {("pretrained", "pose"): pool_curve(0.5, 0.7), ("rare", "pose"): pool_curve(0.4, 0.4)},
        "bald": {("pretrained", "pose"): pool_curve(0.5, 0.95)},
        "stream_bald": {("pretrained", "pose"): stream_curve(0.0, 0.1, 0.2, 0.8)},
    }
    paths = {}
    for strategy, of_strategy in curves.items():
        paths[strategy] = tmp_path / "ycb" / strategy / "seed3.csv"
        paths[strategy].parent.mkdir(parents=True)
        write_curves(paths[strategy], of_strategy, STREAM_COLUMNS if "stream" in strategy else POOL_COLUMNS)
    return paths


def test_curves_are_read_as_they_were_written_without_seconds(files):
    curves = read_curves(files["random"])
    assert list(curves) == [("pretrained", "pose"), ("rare", "pose")]
    assert list(curves["rare", "pose"].columns) == list(POOL_COLUMNS)
    assert curves["pretrained", "pose"]["accuracy"].tolist() == [0.5, 0.7]
    assert math.isnan(read_curves(files["stream_bald"])["pretrained", "pose"]["running"][0])


def test_metrics_are_tidy_and_gains_are_paired_with_random_of_the_same_start(files):
    metrics = collect_curves(files.values(), target=0.9)
    values = metrics.set_index(["table", "method", "concept", "metric"])["value"]
    assert values["active_learning/pretrained", "bald", "pose", "area_gain"] == pytest.approx((1.45 - 1.2) / 2)
    assert values["active_learning/pretrained", "random", "pose", "reached"] == 0
    assert values["active_learning/rare", "random", "pose", "final_accuracy"] == pytest.approx(0.4)
    assert values["active_learning/pretrained", "stream_bald", "pose", "delay"] == 10
    assert set(metrics["seed"]) == {3}
    assert "area_gain" not in set(metrics.loc[metrics["method"] == "random", "metric"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("setting,held_out,labels,accuracy\n", r"column 'accuracy_new' is missing"),
        ("setting,held_out,labels,accuracy,accuracy_new\na,b,0,x,1\n", r"'accuracy' contains values that are not fin"),
    ],
)
def test_a_damaged_file_is_named(files, text, message):
    files["bald"].write_text(text)
    with pytest.raises(InputError, match=message):
        collect_curves(files.values(), target=0.9)
