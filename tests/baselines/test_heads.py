import numpy as np
import pytest

from baselines.heads import Dropout, Ensemble, Heads, LastLayerLaplace

RANDOM = np.random.default_rng(0)
TARGETS = np.arange(60) % 3
H = 2 * RANDOM.normal(size=(3, 8))[TARGETS] + RANDOM.normal(size=(60, 8))


@pytest.mark.parametrize("heads", [1, 3])
def test_longer_training_fits_better(heads):
    def error(steps):
        head = Heads("a", heads=heads, hidden=16, steps=steps)
        head.fit(H, TARGETS)
        return np.mean(head.logits(head.hidden(H)).argmax(axis=2) != TARGETS)

    assert error(300) < 0.05 < 0.3 < error(0)


class _Direct:
    """Draws the logits without registrations around them."""

    def drawn(self, h):
        self._train(H, TARGETS)
        return self._draw_logits(h)


class DirectEnsemble(_Direct, Ensemble):
    pass


class DirectDropout(_Direct, Dropout):
    pass


def test_an_ensemble_has_a_draw_per_member_and_dropout_one_per_pass():
    assert DirectEnsemble("a", 0, members=4, hidden=8).drawn(H[:5]).shape == (4, 5, 3)
    assert DirectDropout("a", 0, passes=7, hidden=8).drawn(H[:5]).shape == (7, 5, 3)


class DirectLaplace(_Direct, LastLayerLaplace):
    pass


def test_laplace_draws_have_the_covariance_of_the_linearised_last_layer():
    laplace = DirectLaplace("a", 0, draws=5000, hidden=6)
    drawn_M_N_C = laplace.drawn(H[:4])
    covariance = (laplace._vectors * laplace._deviations**2) @ laplace._vectors.T
    features = laplace._features(H[:4])
    for n in range(4):
        jacobian_C_P = np.kron(np.eye(3), features[n])
        expected = jacobian_C_P @ covariance @ jacobian_C_P.T
        assert np.cov(drawn_M_N_C[:, n].T) == pytest.approx(expected, rel=0.1, abs=0.05 * expected.max())
    assert drawn_M_N_C.mean(axis=0) == pytest.approx(features @ laplace._weights_F_C, abs=0.1)


def test_laplace_is_less_certain_far_from_the_training_samples():
    drawn = DirectLaplace("a", 0, hidden=16).drawn(np.concatenate([H, 20 * H]))
    assert drawn[:, 60:].std(axis=0).min() > drawn[:, :60].std(axis=0).mean()
