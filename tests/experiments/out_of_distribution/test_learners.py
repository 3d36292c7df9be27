import numpy as np
import pytest

from gpca.errors import InputError
from gpca.experiments.out_of_distribution.learners import predict_sets
from gpca.explainers.gpca import GPCA
from gpca.explainers.registry import explainer_entry
from tests.experiments.out_of_distribution.test_sets import sets


def quick():
    return GPCA("tiny", 0, iterations=5, inducing=4, draws=20)


def test_every_test_sample_of_every_set_is_explained_once():
    frame = predict_sets(quick, sets())
    assert frame.columns[0] == "set"
    assert frame["set"].value_counts().to_dict() == dict.fromkeys(
        ("in_distribution", "severity", "seen_objects", "objects"), 12
    )
    assert set(frame["split"]) == {"test"}


def test_each_encoder_has_a_learner_of_its_own():
    """What the second encoder makes of its samples changes nothing in what is said of the first one's."""
    given = sets()
    second = np.isin(given.set, ["seen_objects", "objects"])
    given.h[second] **= 3
    frame, plain = predict_sets(quick, given), predict_sets(quick, sets())
    first = ~frame["set"].isin(["seen_objects", "objects"])
    assert frame[first].equals(plain[first])
    assert not frame[~first].equals(plain[~first])


def test_the_truth_is_hidden_and_the_prediction_that_of_the_explainer():
    given = sets()
    learner = explainer_entry("learner_logistic").make("tiny", 0)
    learner.fit(given.registrations(given.rows("in_distribution", "train")))
    rows = given.rows("severity", "test")
    expected = learner.explain(given.registrations(rows)).scores_N_C
    frame = predict_sets(lambda: explainer_entry("learner_logistic").make("tiny", 0), given)
    frame = frame[frame["set"] == "severity"]
    assert frame.filter(like="score_").to_numpy() == pytest.approx(expected)
    assert frame["concept_true"].tolist() == given.concept[rows].tolist()


def test_a_concept_absent_from_training_keeps_its_column_and_one_concept_is_a_fault():
    given = sets()
    few = given.split == "train"
    given.concept[few & (given.concept == "pose")] = "noise"
    frame = predict_sets(lambda: explainer_entry("learner_forest").make("tiny", 0), given)
    assert (frame["score_pose"] == 0).all()
    given.concept[few] = "noise"
    with pytest.raises(InputError, match="fewer than two concepts"):
        predict_sets(lambda: explainer_entry("learner_forest").make("tiny", 0), given)
