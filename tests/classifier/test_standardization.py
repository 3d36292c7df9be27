import numpy as np
import pytest
from sklearn.preprocessing import StandardScaler

from gpca.classifier.standardization import Standardization


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_it_is_that_of_scikit_learn_to_the_last_digit(precision):
    random = np.random.default_rng(0)
    h_N_d = (random.normal(size=(200, 9)) * 10 ** random.uniform(-3, 3, 9)).astype(precision)
    h_N_d[:, 4] = 7  # has no deviation
    scaled = Standardization.of(h_N_d[:100])(h_N_d)
    expected = StandardScaler().fit(h_N_d[:100]).transform(h_N_d)
    assert scaled.dtype == expected.dtype == precision
    assert scaled.tobytes() == expected.tobytes()


def test_whole_numbers_lose_nothing():
    h_N_d = np.arange(12).reshape(4, 3)
    np.testing.assert_array_equal(Standardization.of(h_N_d)(h_N_d), StandardScaler().fit_transform(h_N_d))
