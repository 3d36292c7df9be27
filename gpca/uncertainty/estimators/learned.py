"""A learned covariance of an aleatoric and an epistemic part, after De Maio & Lacroix (2022): some networks.

Each network gives the mean and the variances of the error from a pair's descriptors. What they say on average is how
much registrations of such a pair differ (aleatoric); how much they contradict each other, how little they know of such
pairs (epistemic, Lakshminarayanan et al. 2017). Theirs is variational, on clouds.

It models the error, whatever it comes from: it is taught with errors against true poses (ICRA 2022).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gpca.alignment.rigid import exp, log
from gpca.seeds import generator
from gpca.uncertainty.estimators.cello import FEWEST_EXAMPLES, Reduction, along_axes, described, twists_along_axes
from gpca.uncertainty.estimators.interface import (
    Estimator,
    EstimatorEntry,
    Example,
    RegisteredPair,
    intrinsic_frame,
    require_examples,
)

COMPONENTS = 16  # of the descriptors
SMALLEST_LOG, LARGEST_LOG = -16.0, 2.0  # of a variance, in squared radians or diameters


def learn(
    examples: Sequence[Example],
    members: int = 5,
    hidden: int = 32,
    steps: int = 200,
    learning_rate: float = 0.01,
    weight_decay: float = 1e-3,
) -> Estimator:
    """Train the networks on the errors of training registrations against their true poses.

    Six means and six variances along the target's principal axes, by the Gaussian likelihood of all runs of a pair.

    Args:
        members: networks that differ by their initial weights.
        weight_decay: of the squares of the weights.
    """
    require_examples(examples, FEWEST_EXAMPLES)
    reduce = Reduction([example.descriptors for example in examples], COMPONENTS)
    errors = [_errors(example) for example in examples]
    features_E_K = reduce(np.array([example.descriptors for example in examples]))
    networks = _Ensemble(features_E_K.shape[1], hidden, members)
    networks.fit(
        features_E_K,
        np.array([error_n_6.mean(axis=0) for error_n_6 in errors]),
        np.array([error_n_6.var(axis=0) for error_n_6 in errors]),
        steps,
        learning_rate,
        weight_decay,
    )

    def estimate(registered: RegisteredPair) -> np.ndarray:
        aleatoric_6, epistemic_6 = networks.variances(reduce(described(registered)[None]))
        return along_axes(np.diag(aleatoric_6 + epistemic_6), intrinsic_frame(registered.pair.target))

    return estimate


class _Ensemble:
    """Networks of one hidden layer, side by side in one tensor."""

    def __init__(self, inputs: int, hidden: int, members: int) -> None:
        import torch

        random = generator("learned covariance")

        def weights(*shape: int):
            scale = 1 / np.sqrt(shape[1])
            return torch.tensor(random.normal(size=shape) * scale, dtype=torch.float64, requires_grad=True)

        self._first = weights(members, inputs + 1, hidden)
        self._second = weights(members, hidden + 1, 12)

    def _predict(self, features_E_K):
        """Return the means and the logarithms of the variances (M, E, 6) of each network."""
        import torch

        ones = torch.ones(*features_E_K.shape[:-1], 1, dtype=torch.float64)
        inputs = torch.cat([features_E_K, ones], dim=-1).expand(len(self._first), -1, -1)
        hidden = torch.tanh(inputs @ self._first)
        outputs = torch.cat([hidden, torch.ones_like(hidden[:, :, :1])], dim=2) @ self._second
        # In units near those of the errors, so that weights near one suit both.
        return 0.1 * outputs[:, :, :6], (2 * outputs[:, :, 6:] - 6).clamp(SMALLEST_LOG, LARGEST_LOG)

    def fit(
        self,
        features_E_K: np.ndarray,
        mean_E_6: np.ndarray,
        variance_E_6: np.ndarray,
        steps: int,
        learning_rate: float,
        weight_decay: float,
    ) -> None:
        import torch

        from gpca.portable import Adam

        features, mean, variance = (torch.from_numpy(array) for array in (features_E_K, mean_E_6, variance_E_6))
        parameters = [self._first, self._second]
        optimizer = Adam(parameters, learning_rate)
        for _ in range(steps):
            optimizer.zero_grad()
            outputs, log_variance = self._predict(features)
            misfit = ((mean - outputs).square() + variance) * torch.exp(-log_variance)
            decay = weight_decay * sum(parameter.square().sum() for parameter in parameters)
            loss = 0.5 * (log_variance + misfit).sum(dim=2).mean(dim=1).sum() + decay
            loss.backward()
            optimizer.step()

    def variances(self, features_1_K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the aleatoric and the epistemic variances (6,) of one pair."""
        import torch

        with torch.no_grad():
            means, log_variances = self._predict(torch.from_numpy(features_1_K))
        return torch.exp(log_variances)[:, 0].mean(dim=0).numpy(), means[:, 0].var(dim=0, correction=0).numpy()


def _errors(example: Example) -> np.ndarray:
    """Return the twists (n, 6) of the true pose about each of the runs' results, along the axes."""
    away_n = exp(example.true_twist[None]) @ np.linalg.inv(exp(example.twists))
    return twists_along_axes(log(away_n), example.T_target_intrinsic)


ESTIMATORS = {"learned": EstimatorEntry("Learned ensemble", "error", learn=learn)}
