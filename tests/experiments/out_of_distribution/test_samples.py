from dataclasses import replace

import numpy as np
import pytest

from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.experiments.out_of_distribution.samples import (
    PRINCIPAL_COMPONENTS,
    knn_distance,
    mahalanobis_distance,
    make_sets,
    principal_components,
)
from gpca.experiments.out_of_distribution.sets import TRAINED_ON
from gpca.experiments.out_of_distribution.settings import ShiftSettings

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
SETTINGS = ShiftSettings.from_dicts(SHIFT, {"cloud_points": 256, "train": 36, "test": 18}, ENCODER)
RANDOM = np.random.default_rng(0)
TRAIN = RANDOM.normal(size=(60, 5))


@pytest.fixture(scope="module")
def embedded(registrations):
    model, _ = train_encoder(registrations, "tiny", 0, EncoderSettings(**ENCODER))
    h_S_d, _ = embed(model, registrations, "tiny", 0, EncoderSettings(**ENCODER))
    return model, replace(registrations, attached={"embedding": h_S_d})


@pytest.fixture(scope="module")
def sets(objects, embedded):
    model, registrations = embedded
    return make_sets(objects, registrations, registrations, model, EncoderSettings(**ENCODER), "tiny", 0, SETTINGS)


def test_settings_join_what_the_sections_say():
    assert SETTINGS.beyond.train == 0
    assert SETTINGS.beyond.test == SETTINGS.samples == 6
    assert SETTINGS.beyond.cloud_points == 256
    assert SETTINGS.beyond.severities.crop == (0.6, 0.8)
    assert SETTINGS.encoder == EncoderSettings(**ENCODER | {"epochs": 2})


def test_all_sets_are_there_and_of_the_declared_size(sets, embedded):
    _, registrations = embedded
    assert set(sets.set) == set(TRAINED_ON)
    assert len(sets.rows("in_distribution", "train")) == 36
    assert len(sets.rows("in_distribution", "test")) == 18
    for name in ("severity", "source", "objects"):
        assert len(sets.rows(name, "test")) == 6
        assert len(sets.rows(name, "train")) == 0
    in_distribution = sets.rows("in_distribution", "test")
    assert np.array_equal(sets.h[in_distribution], registrations.embedding[registrations.rows("test")])


def test_held_out_objects_are_unseen_by_that_encoder_and_its_learners(sets):
    unseen = set(sets.object_name[sets.set == "objects"])
    assert len(unseen) == 1
    assert not unseen & set(sets.object_name[sets.set == "seen_objects"])
    assert len(sets.rows("seen_objects", "train")) == 18
    keys = list(zip(sets.split[sets.set == "objects"], sets.sample[sets.set == "objects"], strict=True))
    assert len(set(keys)) == len(keys)


def test_distances_are_finite_zero_for_training_samples_and_larger_for_larger_severities(sets):
    assert (sets.distance[sets.split == "train"] == 0).all()
    assert (sets.distance[sets.split == "test"] > 0).all()
    near, far = (np.median(sets.distance[sets.rows(name, "test"), 0]) for name in ("in_distribution", "severity"))
    assert far > 1.3 * near


def test_without_another_source_that_set_is_left_out_and_the_others_are_the_same(sets, objects, embedded):
    model, registrations = embedded
    alone = make_sets(objects, registrations, None, model, EncoderSettings(**ENCODER), "tiny", 0, SETTINGS)
    kept = sets.set != "source"
    assert set(alone.set) == set(sets.set[kept])
    for name, array in vars(alone).items():
        assert array.tobytes() == getattr(sets, name)[kept].astype(array.dtype).tobytes()


def test_of_a_single_object_none_is_held_out_and_those_sets_are_left_out(objects, embedded):
    model, registrations = embedded
    alone = replace(registrations, cluster=np.full(len(registrations), "cup"))
    sets = make_sets(objects, alone, None, model, EncoderSettings(**ENCODER), "tiny", 0, SETTINGS)
    assert set(sets.set) == {"in_distribution", "severity"}


def test_no_view_of_an_object_that_is_held_out_is_trained_on(objects, embedded):
    model, registrations = embedded
    views = {name: f"mug_{i // 2}_1_{i}" for i, name in enumerate(np.unique(registrations.object_name).tolist())}
    names = np.array([views[name] for name in registrations.object_name.tolist()])
    viewed = replace(registrations, object_name=names, cluster=np.array([name[:5] for name in names.tolist()]))
    sets = make_sets(objects, viewed, None, model, EncoderSettings(**ENCODER), "tiny", 0, SETTINGS)
    seen, unseen = ({name[:5] for name in sets.object_name[sets.set == part]} for part in ("seen_objects", "objects"))
    assert unseen
    assert not seen & unseen


def test_knn_is_the_mean_over_the_nearest_in_standardized_features():
    train, query = np.array([[0.0], [1.0], [2.0], [3.0]]), np.array([[1.0], [13.0]])
    deviation = np.std(train)
    assert knn_distance(train, query, neighbours=2) == pytest.approx([0.5 / deviation, 10.5 / deviation])


def test_fewer_training_samples_than_neighbors_are_all_taken():
    assert knn_distance(np.array([[0.0], [2.0]]), np.array([[1.0]]), neighbours=10) == pytest.approx([1.0])


def test_mahalanobis_of_many_samples_is_that_of_their_covariance():
    mixing = np.array([[2.0, 0.0], [1.5, 0.5]])
    train, query = RANDOM.normal(size=(20000, 2)) @ mixing.T, RANDOM.normal(size=(5, 2)) * 3
    precision = np.linalg.inv(mixing @ mixing.T)
    expected = np.sqrt(np.einsum("sf,fg,sg->s", query, precision, query))
    assert mahalanobis_distance(train, query) == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("distance", [knn_distance, mahalanobis_distance])
def test_units_of_the_features_do_not_matter_and_far_is_far(distance):
    query, scale = RANDOM.normal(size=(4, 5)), np.array([1.0, 1e3, 1e-3, 5.0, 2.0])
    assert distance(TRAIN * scale + 7, query * scale + 7) == pytest.approx(distance(TRAIN, query), rel=1e-6)
    assert distance(TRAIN, query + 50).min() > distance(TRAIN, query).max()


@pytest.mark.parametrize("distance", [knn_distance, mahalanobis_distance])
def test_constant_features_and_a_single_training_sample_are_finite(distance):
    assert distance(np.ones((20, 5)), np.ones((3, 5))) == pytest.approx(0, abs=1e-9)
    assert np.isfinite(distance(TRAIN[:1], TRAIN[:3])).all()
    assert np.isfinite(distance(np.ones((20, 5)), np.zeros((3, 5)))).all()


def test_principal_components_keep_what_varies_and_learn_from_the_training_samples_alone():
    wide = RANDOM.normal(size=(40, 3)) @ RANDOM.normal(size=(3, 50))
    train, query = principal_components(wide, wide[:7])
    assert train.shape == (40, PRINCIPAL_COMPONENTS)
    assert query == pytest.approx(train[:7])
    assert np.abs(train[:, 3:]).max() < 1e-8
    assert principal_components(wide, 1e6 * wide[:7])[0] == pytest.approx(train)
