import numpy as np
import pytest

from gpca.experiments.out_of_distribution.distance import (
    PRINCIPAL_COMPONENTS,
    knn_distance,
    mahalanobis_distance,
    principal_components,
)

RANDOM = np.random.default_rng(0)
TRAIN = RANDOM.normal(size=(60, 5))


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
