import numpy as np
import pytest
from sklearn.preprocessing import QuantileTransformer

from gpca.explainers.pair_classifier import FARTHEST, QUANTILES, RANKED, NormalizedFeatures
from gpca.seeds import seed_of


@pytest.mark.parametrize("n", [30, 300, RANKED + 10])
def test_descriptors_are_normalized_as_by_scikit_learn_to_the_last_digit(n):
    random = np.random.default_rng(0)
    features_N_F = random.normal(size=(n, 8))
    features_N_F[:, 1] = np.round(features_N_F[:, 1])  # many equal quantiles
    features_N_F[:, 2] = 5
    features_N_F[:, 3] *= 1e-8  # all within the tolerance of the ends
    features_N_F[:, 4] = np.where(features_N_F[:, 4] > 0, 1, 0)
    features_N_F[:, 5] = np.exp(5 * features_N_F[:, 5])
    asked_N_F = np.concatenate([features_N_F, 3 * random.normal(size=(100, 8)), np.zeros((1, 8)), np.full((1, 8), 5)])
    normalized = NormalizedFeatures().fit(features_N_F)
    seed = seed_of("quantiles") % 2**32
    transformer = QuantileTransformer(n_quantiles=min(QUANTILES, n), output_distribution="normal", random_state=seed)
    expected = transformer.fit(features_N_F).transform(asked_N_F).clip(-FARTHEST, FARTHEST)
    assert normalized(asked_N_F).tobytes() == np.ascontiguousarray(expected).tobytes()
    loaded = NormalizedFeatures()
    loaded.quantiles_Q_F = normalized.quantiles_Q_F
    assert loaded(asked_N_F).tobytes() == normalized(asked_N_F).tobytes()
