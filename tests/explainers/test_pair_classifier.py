import numpy as np
from sklearn.preprocessing import QuantileTransformer

from gpca.explainers.pair_classifier import FARTHEST, QUANTILES, NormalizedFeatures


def test_descriptors_are_normalized_as_by_scikit_learn_to_the_last_digit():
    random = np.random.default_rng(0)
    features_N_F = random.normal(size=(300, 8))
    features_N_F[:, 1] = np.round(features_N_F[:, 1])  # many equal quantiles
    features_N_F[:, 2] = 5
    features_N_F[:, 3] *= 1e-8  # all within the tolerance of the ends
    features_N_F[:, 4] = np.where(features_N_F[:, 4] > 0, 1, 0)
    features_N_F[:, 5] = np.exp(5 * features_N_F[:, 5])
    asked_N_F = np.concatenate([features_N_F, 3 * random.normal(size=(100, 8)), np.zeros((1, 8)), np.full((1, 8), 5)])
    normalized = NormalizedFeatures().fit(features_N_F)
    transformer = QuantileTransformer(n_quantiles=QUANTILES, output_distribution="normal").fit(features_N_F)
    expected = transformer.transform(asked_N_F).clip(-FARTHEST, FARTHEST)
    assert normalized(asked_N_F).tobytes() == np.ascontiguousarray(expected).tobytes()
    loaded = NormalizedFeatures.from_state(normalized.state())
    assert loaded(asked_N_F).tobytes() == normalized(asked_N_F).tobytes()
