"""Samples unlike those of the training, their distances to it, and what learners predict for them."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embedding_by, train_encoder
from gpca.errors import InputError
from gpca.explainers.gpca import GPCA
from gpca.explainers.registry import explainer_entry
from gpca.pairs.shifted_sets import TRAINED_ON
from gpca.steps import shift

from ..pairs.test_shifted_sets import sets

ENCODER = {"draw_points": 32, "draws": 1, "epochs": 1, "batch_size": 16, "options": {"k": 4, "point_features": 8}}
SHIFT = {
    "samples": 6,
    "severities": {"noise": [0.1, 0.2], "rotation_deg": [60, 90], "translation": [0.3, 0.5], "crop": [0.6, 0.8]},
    "held_out_share": 0.2,
    "train": 18,
    "encoder": {"epochs": 2},
    "neighbours": 3,
    "shape_points": 16,
}
SETTINGS = shift.ShiftSettings.from_dicts(SHIFT, {"cloud_points": 256, "train": 36, "test": 18}, ENCODER)
RANDOM = np.random.default_rng(0)


@pytest.fixture(scope="module")
def embedded(registrations):
    model, _ = train_encoder(registrations, "tiny", 0, EncoderSettings(**ENCODER))
    embed_own = embedding_by(model, 0, EncoderSettings(**ENCODER))
    return embed_own, replace(registrations, attached={"embedding": embed_own(registrations, "tiny")[0]})


@pytest.fixture(scope="module")
def shifted(objects, embedded):
    embed_own, registrations = embedded
    return shift.make_sets(objects, registrations, registrations, embed_own, "tiny", 0, SETTINGS)


def test_all_sets_are_there_and_of_the_declared_size(shifted, embedded):
    _, registrations = embedded
    assert set(shifted.set) == set(TRAINED_ON)
    assert len(shifted.rows("in_distribution", "train")) == 36
    assert len(shifted.rows("in_distribution", "test")) == 18
    for name in ("severity", "source", "objects"):
        assert len(shifted.rows(name, "test")) == 6
        assert len(shifted.rows(name, "train")) == 0
    in_distribution = shifted.rows("in_distribution", "test")
    assert np.array_equal(shifted.h[in_distribution], registrations.embedding[registrations.rows("test")])


def test_held_out_objects_are_unseen_by_that_encoder_and_its_learners(shifted):
    unseen = set(shifted.object_name[shifted.set == "objects"])
    assert len(unseen) == 1
    assert not unseen & set(shifted.object_name[shifted.set == "seen_objects"])
    assert len(shifted.rows("seen_objects", "train")) == 18
    keys = list(zip(shifted.split[shifted.set == "objects"], shifted.sample[shifted.set == "objects"], strict=True))
    assert len(set(keys)) == len(keys)


def test_distances_are_finite_zero_for_training_samples_and_larger_for_larger_severities(shifted):
    assert (shifted.distance[shifted.split == "train"] == 0).all()
    assert (shifted.distance[shifted.split == "test"] > 0).all()
    near, far = (np.median(shifted.distance[shifted.rows(name, "test"), 0]) for name in ("in_distribution", "severity"))
    assert far > 1.3 * near


def test_no_view_of_an_object_that_is_held_out_is_trained_on(objects, embedded):
    embed_own, registrations = embedded
    views = {name: f"mug_{i // 2}_1_{i}" for i, name in enumerate(np.unique(registrations.object_name).tolist())}
    names = np.array([views[name] for name in registrations.object_name.tolist()])
    viewed = replace(registrations, object_name=names, cluster=np.array([name[:5] for name in names.tolist()]))
    sets = shift.make_sets(objects, viewed, None, embed_own, "tiny", 0, SETTINGS)
    seen, unseen = ({name[:5] for name in sets.object_name[sets.set == part]} for part in ("seen_objects", "objects"))
    assert unseen
    assert not seen & unseen


def test_distances_are_means_over_the_nearest_and_those_of_the_covariance():
    train, query = np.array([[0.0], [1.0], [2.0], [3.0]]), np.array([[1.0], [13.0]])
    deviation = np.std(train)
    assert shift.distances(train, query, 2)[:, 0] == pytest.approx([0.5 / deviation, 10.5 / deviation])
    mixing = np.array([[2.0, 0.0], [1.5, 0.5]])
    train, query = RANDOM.normal(size=(20000, 2)) @ mixing.T, RANDOM.normal(size=(5, 2)) * 3
    precision = np.linalg.inv(mixing @ mixing.T)
    expected = np.sqrt(np.einsum("sf,fg,sg->s", query, precision, query))
    assert shift.distances(train, query, 10)[:, 1] == pytest.approx(expected, rel=0.05)


def test_principal_components_keep_what_varies_and_learn_from_the_training_samples_alone():
    wide = RANDOM.normal(size=(40, 3)) @ RANDOM.normal(size=(3, 50))
    train, query = shift.principal_components(wide, wide[:7])
    assert train.shape == (40, shift.PRINCIPAL_COMPONENTS)
    assert query == pytest.approx(train[:7])
    assert np.abs(train[:, 3:]).max() < 1e-8
    assert shift.principal_components(wide, 1e6 * wide[:7])[0] == pytest.approx(train)


def quick():
    return GPCA("tiny", 0, iterations=5, inducing=4, draws=20)


def test_every_test_sample_of_every_set_is_explained_once():
    frame = shift.predict_sets(quick, sets())
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
    frame, plain = shift.predict_sets(quick, given), shift.predict_sets(quick, sets())
    first = ~frame["set"].isin(["seen_objects", "objects"])
    assert frame[first].equals(plain[first])
    assert not frame[~first].equals(plain[~first])


def test_the_truth_is_hidden_and_the_prediction_that_of_the_explainer():
    given = sets()
    learner = explainer_entry("learner_logistic").make("tiny", 0)
    learner.fit(given.registrations(given.rows("in_distribution", "train")))
    rows = given.rows("severity", "test")
    expected = learner.explain(given.registrations(rows)).scores_N_C
    frame = shift.predict_sets(lambda: explainer_entry("learner_logistic").make("tiny", 0), given)
    frame = frame[frame["set"] == "severity"]
    assert frame.filter(like="score_").to_numpy() == pytest.approx(expected)
    assert frame["concept_true"].tolist() == given.concept[rows].tolist()


def test_a_concept_absent_from_training_keeps_its_column_and_one_concept_is_a_fault():
    given = sets()
    few = given.split == "train"
    given.concept[few & (given.concept == "pose")] = "noise"
    frame = shift.predict_sets(lambda: explainer_entry("learner_forest").make("tiny", 0), given)
    assert (frame["score_pose"] == 0).all()
    given.concept[few] = "noise"
    with pytest.raises(InputError, match="fewer than two concepts"):
        shift.predict_sets(lambda: explainer_entry("learner_forest").make("tiny", 0), given)
