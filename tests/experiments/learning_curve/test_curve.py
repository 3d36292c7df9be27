"""Learning from more and more registrations of four objects."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import LABELS
from gpca.causes.descriptors import describe_all
from gpca.causes.drawing import draw_further
from gpca.causes.judged import CEILING
from gpca.causes.settings import CauseSettings, DescriptorSettings
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.evaluation.measures import TIDY_COLUMNS
from gpca.experiments.learning_curve.curve import CURVE_COLUMNS, collect_curves, learning_curve, read_curves
from gpca.experiments.learning_curve.figure import draw_learning_curve
from gpca.experiments.learning_curve.learners import TITLES
from gpca.experiments.learning_curve.samples import Lessons, describe_cheaply
from gpca.experiments.learning_curve.settings import GROUPS, CurveSettings, labeled_samples
from gpca.io.csv_file import write_csv
from tests.conftest import FEW_CAUSES

SETTINGS = CurveSettings(
    further=12, sizes=(20, 24), orders=2, classifier=GPCSettings(learning_rate=0.1, iterations=5, inducing=6, draws=50)
)


@pytest.fixture(scope="module")
def further(four):
    return draw_further(four, "four", 100, CauseSettings(**FEW_CAUSES), 0, 12)


@pytest.fixture(scope="module")
def lessons(causes, further):
    icp = ICPSettings()
    own = describe_cheaply(causes, icp)
    labeled = causes.rows("train")[np.isin(own.label[causes.rows("train")], LABELS)]
    more = describe_cheaply(further, icp)
    pool = Lessons.joined([own.subset(labeled), more, more])  # enough for the sizes
    return pool, own.subset(causes.rows("test"))


@pytest.fixture(scope="module")
def curve(lessons, causes):
    return learning_curve(*lessons, causes.subset(causes.rows("test")), SETTINGS, "four", 100)


def test_further_samples_are_labeled_of_training_objects_and_new(causes, further):
    names = causes.registrations.object_name
    assert set(further.registrations.object_name) <= set(names[causes.rows("train")])
    assert set(further.registrations.split) == {"train"} and not len(further.truth_again)
    assert np.isin(describe_cheaply(further, ICPSettings()).label, LABELS).all()
    assert not set(further.registrations.severity_noise[further.applied[:, 0]]) & set(
        causes.registrations.severity_noise
    )


def test_a_chunk_is_the_same_whenever_it_is_drawn_and_unlike_others(four, further):
    again, other = (draw_further(four, "four", 100, CauseSettings(**FEW_CAUSES), chunk, 12) for chunk in (0, 1))
    assert np.array_equal(again.truth.error, further.truth.error)
    assert not np.array_equal(other.truth.error, further.truth.error)


def test_cheap_descriptors_are_those_of_the_explainers(causes):
    described, _, _ = describe_all(
        causes, "four", 100, DescriptorSettings(starts=1, restarts=1, icp_points=64), ICPSettings()
    )
    own = describe_cheaply(causes, ICPSettings())
    for name in GROUPS:
        assert np.array_equal(getattr(own, name), described.groups[name])


def test_every_learner_has_a_row_of_each_size_and_order_beside_the_truth(curve):
    assert tuple(curve.columns) == CURVE_COLUMNS
    counts = curve.groupby("learner").size()
    assert counts[CEILING] == 1 and all(counts[name] == 4 for name in TITLES)
    assert curve["balanced_accuracy"].between(0, 1).all() and (curve["regret"] >= 0).all()


def test_more_samples_than_there_are_cannot_be_learned_from(lessons, causes):
    pool, tested = lessons
    with pytest.raises(InputError, match="are fewer than the largest size, 24; raise"):
        learning_curve(pool.subset(np.arange(20)), tested, causes.subset(causes.rows("test")), SETTINGS, "four", 100)


def test_lessons_survive_the_file(lessons, tmp_path):
    pool, _ = lessons
    pool.save(tmp_path / "chunk0.npz", ("four", 100))
    read = Lessons.load(tmp_path / "chunk0.npz", ("four", 100))
    assert np.array_equal(read.features, pool.features) and read.label.tolist() == pool.label.tolist()
    with pytest.raises(InputError, match="of source 'four'"):
        Lessons.load(tmp_path / "chunk0.npz", ("five", 100))
    replace(pool, label=np.full(len(pool), "dust")).save(tmp_path / "chunk0.npz", ("four", 100))
    with pytest.raises(InputError, match="unknown label 'dust'"):
        Lessons.load(tmp_path / "chunk0.npz", ("four", 100))


def test_curves_are_collected_as_means_over_the_orders_and_drawn(curve, tmp_path, same_bytes):
    write_csv(tmp_path / "four/seed100.csv", curve)
    rows = collect_curves([tmp_path / "four/seed100.csv"])
    assert tuple(rows.columns) == TIDY_COLUMNS
    of_trees = rows[(rows["method"] == "trees") & (rows["metric"] == "regret") & (rows["concept"] == "24")]
    expected = curve[(curve["learner"] == "trees") & (curve["samples"] == 24)]["regret"].mean()
    assert of_trees["value"].tolist() == pytest.approx([expected], abs=1e-5)
    read = read_curves([tmp_path / "four/seed100.csv"])
    same_bytes(lambda: draw_learning_curve(read, {"four": "Four (procedural stand-in)"}))
    with pytest.raises(InputError, match="have no results for these sources"):
        draw_learning_curve(read, {"five": "Five"})
    with pytest.raises(InputError, match="no files were given"):
        collect_curves([])


def test_chunks_are_even_and_borderline_samples_have_no_label():
    assert CurveSettings(further=4700, chunk=600).chunks() == [588] * 4 + [587] * 4
    assert CurveSettings(further=250, chunk=600).chunks() == [250]
    shares = {"nominal": 0.3, "borderline": 0.16, "noise": 0.18, "pose": 0.18, "overlap": 0.18, "geometry": 0}
    assert labeled_samples({"train": 450, "shares": shares}) == 378
