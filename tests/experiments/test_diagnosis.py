"""Measures of diagnoses with intervals and differences from rivals, and by parts of the samples."""

import numpy as np
import pytest

from gpca.causes.dataset import LABELS, labels_of
from gpca.causes.judged import CEILING, read_judged
from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL
from gpca.errors import InputError
from gpca.evaluation.measures import POOLED, read_clustered, write_metrics
from gpca.experiments import diagnosis
from gpca.experiments.sample_strata import collect_strata, strata_of, table9_shown, table9_strata
from tests.experiments.runs import run_with
from tests.judged import random_judged, write_run

RUN = run_with(sources={"four": {"title": "Four", "stand_in": True}})
TITLES = {"right": "Right", "always_pose": "Pose"}


def by_seed(prediction_files, causes_files):
    return diagnosis.collect(RUN, prediction_files, causes_files)[0]


def over_seeds(prediction_files, causes_files):
    return diagnosis.collect(RUN, prediction_files, causes_files)[1]


def compared(**samples):
    """Rows by explainer and kind of rival, of balanced accuracy."""
    rows = diagnosis.compared_by_source({"tiny": samples})
    return rows[rows["metric"] == "balanced_accuracy"].set_index(["method", "against"])


def values(rows, **wanted):
    for column, value in wanted.items():
        rows = rows[rows[column] == value]
    return rows["value"].tolist()


def test_who_is_right_has_full_marks_and_the_confusion_counts_every_labeled_sample(causes, tmp_path):
    rows = by_seed(*write_run(tmp_path, causes))
    assert values(rows, method="right", metric="balanced_accuracy") == [1.0]
    assert values(rows, method="right", metric="auroc_failed") == [1.0]
    assert values(rows, method="right", metric="false_alarm_rate") == [0.0]
    assert values(rows, method="always_pose", metric="auroc_failed") == [0.5]
    present = set(labels_of(causes.truth)[causes.rows("test")]) - {BORDERLINE}
    assert set(present) <= set(LABELS)
    assert values(rows, method="always_pose", metric="balanced_accuracy") == [1 / len(LABELS)]
    assert values(rows, method=CEILING, metric="auroc_failed")[0] > 0.8
    labeled = (labels_of(causes.truth)[causes.rows("test")] != BORDERLINE).sum()
    named = rows[(rows["method"] == "always_pose") & rows["metric"].str.startswith("predicted_as_")]
    assert named["value"].sum() == labeled == sum(values(named, metric="predicted_as_pose"))


def test_all_sources_together_are_one_more_where_there_are_several(causes, tmp_path):
    first, truth = write_run(tmp_path, causes)
    second, other = write_run(tmp_path, causes, source="again")
    rows = by_seed([*first, *second], [*truth, *other])
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
        by_seed([], [])


def test_a_lead_is_over_the_better_rival_and_a_gain_over_the_best_that_needs_no_training():
    good, poor = random_judged(200, skill=2.0), random_judged(200, skill=0.3)
    rows = compared(good=good, poor=poor, **{CEILING: good})
    own, lead = rows.loc["good", ""], rows.loc["good", "rival"]
    assert own["low"] <= own["value"] <= own["high"]
    assert lead["other"] == "poor"
    assert 0 < lead["low"] < lead["value"] < lead["high"]
    assert rows.loc["poor", "rival"]["value"] == pytest.approx(-lead["value"])
    assert rows.loc[CEILING].index.tolist() == [""]
    assert own["samples"] == (good.label != BORDERLINE).sum() < len(good)
    good, poor, guess = (random_judged(200, skill=skill) for skill in (2.0, 0.3, 0.0))
    rows = compared(good=good, rule=poor, chance=guess, **{CEILING: good})
    gain = rows.loc["good", "trivial"]
    assert gain["other"] == "rule"
    assert gain["value"] == pytest.approx(rows.loc["good", ""]["value"] - rows.loc["rule", ""]["value"])
    assert 0 < gain["low"] < gain["value"] < gain["high"]
    assert [rows.loc[name, "trivial"]["other"] for name in ("rule", "chance")] == ["chance", "rule"]
    assert (CEILING, "trivial") not in rows.index


def test_a_lead_is_over_the_best_that_is_trained_and_reads_no_reenactment():
    skills = {"reenact": 0.2, "reenact_committee": 2.0, "pair_forest": 0.1, "committee_further": 0.5, "rule": 0.0}
    judged = {name: random_judged(200, skill=skill) for name, skill in skills.items()}
    samples = {"tiny": judged | {CEILING: judged["rule"]}}
    rows = diagnosis.compared_by_source(samples, against={"trained": diagnosis.trained_rivals})
    rows = rows[rows["metric"] == "balanced_accuracy"].set_index(["method", "against"])
    assert rows.loc["reenact", "trained"]["other"] == "committee_further"
    assert rows.loc["reenact", "trained"]["value"] < 0 < rows.loc["reenact_committee", "trained"]["value"]
    assert (CEILING, "trained") not in rows.index


def test_a_run_is_collected_written_and_read(causes, tmp_path):
    rows = over_seeds(*write_run(tmp_path, causes))
    assert set(rows["method"]) == {CEILING, "right", "always_pose"}
    assert set(rows["source"]) == {"four"}
    write_metrics(rows, tmp_path / "intervals.csv")
    read = read_clustered(tmp_path / "intervals.csv").set_index(["method", "metric", "against"])
    assert read.loc["right", "balanced_accuracy", ""]["value"] == 1.0
    assert read.loc["right", "balanced_accuracy", "rival"]["other"] == "always_pose"
    assert set(read.loc[CEILING].index.get_level_values("against")) == {""}
    write_metrics(rows.astype({"value": object}).assign(value="one"), tmp_path / "intervals.csv")
    with pytest.raises(InputError, match="column 'value' contains values that are not finite numbers"):
        read_clustered(tmp_path / "intervals.csv")


def test_each_kind_of_stratum_divides_the_failed_and_the_states_all_that_is_judged():
    judged = random_judged()
    failed = ~np.isin(judged.label, (NOMINAL, BORDERLINE))
    by_kind = {}
    for (kind, _), mask in strata_of(judged).items():
        by_kind.setdefault(kind, []).append(mask)
    for kind, masks in by_kind.items():
        counts = np.sum(masks, axis=0)
        expected = judged.label != BORDERLINE if kind == "state" else failed
        assert np.array_equal(counts, expected.astype(int)), kind
    assert (judged.shown[strata_of(judged)["shown", "other"]] != FAILED).all()


@pytest.fixture
def run(causes, tmp_path, monkeypatch):
    monkeypatch.setattr(diagnosis, "cause_titles", lambda config: TITLES)
    return write_run(tmp_path, causes)


def test_strata_are_written_read_and_tabled(run, causes, tmp_path):
    write_metrics(collect_strata(RUN, *run), tmp_path / "strata.csv")
    strata = read_clustered(tmp_path / "strata.csv")
    right = strata[(strata["method"] == "right") & (strata["metric"] == "named_right") & (strata["against"] == "")]
    assert (right["value"] == 1).all() and {"state_failed", "state_nominal"} <= set(right["concept"])
    assert {"margin", "causes"} <= set(right["concept"].str.split("_").str[0])
    table = table9_strata(RUN, strata)
    kinds = ("named_right", "regret")
    assert list(table.columns)[1:] == [f"{name}_{kind}" for kind in kinds for name in ("right", CEILING)]
    tested = causes.truth.state[causes.rows("test")]
    rows = {tuple(key for key, _ in labels): row for row, labels in enumerate(table.rows)}
    assert table.cells[rows["state", "nominal"], "samples"].mean == (tested == NOMINAL).sum()
    assert (rows["state", "nominal"], "right_regret") not in table.cells
    assert "procedural stand-in" in table.caption and "without borderline samples" in table.markdown()


def test_the_state_is_told_by_the_mean_and_by_what_is_shown(run):
    table = table9_shown(RUN, over_seeds(*run))
    assert table.cells[0, "state_accuracy"].mean == 100 > table.cells[1, "state_accuracy"].mean
    assert {"state_accuracy_shown", "auroc_failed_shown"} <= {key for _, key in table.cells}
