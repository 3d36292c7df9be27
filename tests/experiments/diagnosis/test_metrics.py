import numpy as np
import pytest

from gpca.causes.dataset import LABELS, labels_of
from gpca.causes.judged import CEILING, Judged, ceiling_of, read_judged
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.errors import InputError
from gpca.evaluation.measures import POOLED, write_metrics
from gpca.experiments.diagnosis import metrics
from gpca.experiments.diagnosis.metrics import collect, collect_intervals, read_intervals
from tests.judged import random_judged, write_run


def values(rows, **wanted):
    for column, value in wanted.items():
        rows = rows[rows[column] == value]
    return rows["value"].tolist()


def test_who_is_right_has_full_marks_and_who_says_the_same_has_those_of_chance(causes, tmp_path):
    rows = collect(*write_run(tmp_path, causes))
    assert values(rows, method="right", metric="balanced_accuracy") == [1.0]
    assert values(rows, method="right", metric="auroc_failed") == [1.0]
    assert values(rows, method="right", metric="false_alarm_rate") == [0.0]
    assert values(rows, method="always_pose", metric="auroc_failed") == [0.5]
    present = set(labels_of(causes.truth)[causes.rows("test")]) - {BORDERLINE}
    assert set(present) <= set(LABELS)
    assert values(rows, method="always_pose", metric="balanced_accuracy") == [1 / len(LABELS)]
    assert values(rows, method=CEILING, metric="auroc_failed")[0] > 0.8


def test_what_the_ceiling_names_nominal_has_its_score_of_it(causes):
    ceiling = ceiling_of(causes.subset(causes.rows("test")), seed=0)
    assert ((ceiling.named == NOMINAL) == (ceiling.nominal == 1)).all()
    assert (ceiling.nominal[ceiling.named != NOMINAL] == 0).all()
    assert ceiling.nominal + ceiling.scores.sum(axis=1) == pytest.approx(1)


def test_the_confusion_counts_every_sample_that_has_a_label(causes, tmp_path):
    rows = collect(*write_run(tmp_path, causes))
    labeled = (labels_of(causes.truth)[causes.rows("test")] != BORDERLINE).sum()
    named = rows[(rows["method"] == "always_pose") & rows["metric"].str.startswith("predicted_as_")]
    assert named["value"].sum() == labeled == sum(values(named, metric="predicted_as_pose"))


def test_all_sources_together_are_one_more_where_there_are_several(causes, tmp_path):
    first, truth = write_run(tmp_path, causes)
    second, other = write_run(tmp_path, causes, source="again")
    rows = collect([*first, *second], [*truth, *other])
    assert set(rows["source"]) == {"four", "again", POOLED}
    n = values(rows, method="right", metric="test_samples")
    assert n[2] == n[0] + n[1]


def test_predictions_without_their_truth_or_of_other_samples_are_refused(causes, tmp_path):
    files, truth = write_run(tmp_path, causes)
    with pytest.raises(InputError, match=r"its ground truth was not given; give causes/four/seed100\.npz"):
        read_judged(files, [])
    lines = files[0].read_text().splitlines()
    files[0].write_text("\n".join(lines[:-1]) + "\n")
    with pytest.raises(InputError, match="its samples differ from those of the causes"):
        read_judged(files, truth)
    with pytest.raises(InputError, match="no files were given"):
        collect([], [])


def test_of_two_explainers_the_better_leads_by_what_the_other_lacks():
    good, poor = random_judged(200, skill=2.0), random_judged(200, skill=0.3)
    rows = {row[1]: row for row in metrics._of_source("tiny", {"good": good, "poor": poor, CEILING: good})
            if row[2] == "balanced_accuracy"}  # fmt: skip
    record = dict(zip(metrics.COLUMNS, rows["good"], strict=True))
    assert record["low"] <= record["value"] <= record["high"]
    assert record["rival"] == "poor"
    assert 0 < record["difference_low"] < record["difference"] < record["difference_high"]
    assert rows["poor"][9] == pytest.approx(-record["difference"])
    assert rows[CEILING][8] == ""
    assert record["samples"] == (good.label != BORDERLINE).sum() < len(good)


def test_the_gain_is_over_the_best_that_needs_no_training():
    good, poor, guess = (random_judged(200, skill=skill) for skill in (2.0, 0.3, 0.0))
    said = {"good": good, "rule": poor, "chance": guess, CEILING: good}
    rows = {row[1]: dict(zip(metrics.COLUMNS, row, strict=True)) for row in metrics._of_source("tiny", said)
            if row[2] == "balanced_accuracy"}  # fmt: skip
    assert rows["good"]["untrained"] == "rule"
    assert rows["good"]["gain"] == pytest.approx(rows["good"]["value"] - rows["rule"]["value"])
    assert 0 < rows["good"]["gain_low"] < rows["good"]["gain"] < rows["good"]["gain_high"]
    assert [rows[name]["untrained"] for name in ("rule", "chance", CEILING)] == ["chance", "rule", ""]


def test_a_run_is_collected_written_and_read(causes, tmp_path):
    rows = collect_intervals(*write_run(tmp_path, causes))
    assert set(rows["method"]) == {CEILING, "right", "always_pose"}
    assert set(rows["source"]) == {"four"}
    write_metrics(rows, tmp_path / "intervals.csv")
    read = read_intervals(tmp_path / "intervals.csv")
    right = read[(read["method"] == "right") & (read["metric"] == "balanced_accuracy")].iloc[0]
    assert (right["value"], right["rival"]) == (1.0, "always_pose")
    assert np.isnan(read[read["method"] == CEILING]["difference"]).all()
    # A difference may be missing, but what stands there has to be a number.
    for column in ("value", "difference"):
        write_metrics(rows.astype({column: object}).assign(**{column: "one"}), tmp_path / "intervals.csv")
        with pytest.raises(InputError, match=f"column '{column}' contains values that are not finite numbers"):
            read_intervals(tmp_path / "intervals.csv")


def test_a_label_that_no_sample_has_leaves_measures_out_and_the_rest_readable(tmp_path):
    judged = random_judged(60)
    kept = Judged(**{name: array[judged.label != "noise"] for name, array in vars(judged).items()})
    rows = metrics._of_source("tiny", {"one": kept, "other": kept})
    assert "auroc_failed" in {row[2] for row in rows}
    assert np.isfinite([row[5] for row in rows]).all()
