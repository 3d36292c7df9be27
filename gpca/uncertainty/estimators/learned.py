"""Covariances that are learned from registrations of training objects: CELLO-3D, and an ensemble of networks."""

from collections.abc import Sequence

import numpy as np

from gpca.rigid import adjoint, exp, log
from gpca.seeds import generator
from gpca.uncertainty.estimators import interface

FEWEST_EXAMPLES = 8
FLOOR = 1e-8  # squared radians and diameters, of a training variance
LEAST_SINGULAR = 1e-6  # of the largest: what is below is rounding
COMPONENTS = 16  # of the descriptors, that networks read
SMALLEST_LOG, LARGEST_LOG = -16.0, 2.0  # of a variance, in squared radians or diameters


def learn_cello(
    examples: Sequence[interface.Example], components: int = 8, steps: int = 100, learning_rate: float = 0.05
) -> interface.Estimator:
    """Learn a metric of descriptors that finds similar training pairs (CELLO-3D, Landry et al., ICRA 2019).

    The covariance is the mean of the training pairs' ones with weights exp(-|L (φ - φ')|²), L diagonal, such that the
    runs of each training pair are likely under the covariance that the others give it; six variances along the
    principal axes of the target, as axes of pairs have no common sign.
    """
    import torch

    from gpca.portable import Adam, logarithm

    reduce, features_E_K = _reduced(examples, components)
    features = torch.from_numpy(features_E_K)
    twists_E_n_6 = (twists_along_axes(each.twists, each.T_target_intrinsic) for each in examples)
    variances_E_6 = np.array([twists_n_6.var(axis=0) + FLOOR for twists_n_6 in twists_E_n_6])
    variances = torch.from_numpy(variances_E_6)
    log_scale = torch.zeros(features.shape[1], dtype=torch.float64, requires_grad=True)
    optimizer = Adam([log_scale], learning_rate)
    others = torch.eye(len(examples), dtype=torch.bool)
    for _ in range(steps):
        optimizer.zero_grad()
        scaled = features * torch.exp(log_scale)
        lengths = scaled.square().sum(dim=1)
        squares = lengths[:, None] + lengths - 2 * scaled @ scaled.T
        weights = torch.softmax((-squares).masked_fill(others, -torch.inf), dim=1)
        predicted = weights @ variances
        loss = (logarithm(predicted) + variances / predicted).sum(dim=1).mean()
        loss.backward()
        optimizer.step()
    scale_K = np.exp(log_scale.detach().numpy())
    known_E_K = features_E_K * scale_K

    def estimate(registered: interface.RegisteredPair) -> np.ndarray:
        squares_E = np.square(reduce(described(registered)[None]) * scale_K - known_E_K).sum(axis=1)
        weights_E = np.exp(squares_E.min() - squares_E)
        variances_6 = (weights_E[:, None] * variances_E_6).sum(axis=0) / weights_E.sum()
        return along_axes(np.diag(variances_6), interface.intrinsic_frame(registered.pair.target))

    return estimate


class Reduction:
    """Descriptors, standardized and limited, onto their first principal components, at most one fewer than pairs."""

    def __init__(self, descriptors_E_F: np.ndarray, components: int) -> None:
        self._mean_F, deviation_F = descriptors_E_F.mean(axis=0), descriptors_E_F.std(axis=0)
        self._deviation_F = np.where(deviation_F > 1e-9, deviation_F, np.inf)  # what never changes says nothing
        _, singular_F, axes_F_F = np.linalg.svd(self._standard(descriptors_E_F), full_matrices=False)
        axes_F_F = axes_F_F[singular_F > LEAST_SINGULAR * singular_F[0]]
        largest = np.abs(axes_F_F).argmax(axis=1)  # a component's sign is arbitrary
        signs = np.sign(axes_F_F[np.arange(len(axes_F_F)), largest])
        self._axes_K_F = (axes_F_F * signs[:, None])[:components]
        self._size_K = np.einsum("ef,kf->ek", self._standard(descriptors_E_F), self._axes_K_F).std(axis=0)

    def __call__(self, descriptors_n_F: np.ndarray) -> np.ndarray:
        """Return the components (n, K), of unit deviation over the training pairs."""
        return np.einsum("nf,kf->nk", self._standard(descriptors_n_F), self._axes_K_F) / self._size_K

    def _standard(self, descriptors_n_F: np.ndarray) -> np.ndarray:
        return np.clip((descriptors_n_F - self._mean_F) / self._deviation_F, -5, 5)


def _reduced(examples: Sequence[interface.Example], components: int) -> tuple[Reduction, np.ndarray]:
    """Return the reduction that the examples give, and their components (E, K); too few examples are a failure."""
    if len(examples) < FEWEST_EXAMPLES:
        raise interface.FailedEstimate(f"{len(examples)} registrations to learn from, not {FEWEST_EXAMPLES}")
    descriptors_E_F = np.array([example.descriptors for example in examples])
    reduce = Reduction(descriptors_E_F, components)
    return reduce, reduce(descriptors_E_F)


def described(registered: interface.RegisteredPair) -> np.ndarray:
    """Return the pair's descriptors (F,); without any the estimate fails."""
    if registered.describe is None:
        raise interface.FailedEstimate("the pair has no descriptors")
    return registered.describe()


def along_axes(covariance_6_6: np.ndarray, T_target_intrinsic: np.ndarray) -> np.ndarray:
    """Return a covariance of the intrinsic frame as one of the target's frame."""
    Ad = adjoint(T_target_intrinsic)
    return Ad @ covariance_6_6 @ Ad.T


def twists_along_axes(twists_n_6: np.ndarray, T_target_intrinsic: np.ndarray) -> np.ndarray:
    """Return twists of the target's frame (n, 6) in the intrinsic one."""
    return np.linalg.solve(adjoint(T_target_intrinsic), twists_n_6.T).T


def learn_ensemble(
    examples: Sequence[interface.Example],
    members: int = 5,
    hidden: int = 32,
    steps: int = 200,
    learning_rate: float = 0.01,
    weight_decay: float = 1e-3,
) -> interface.Estimator:
    """Train networks on errors of training registrations against true poses (after De Maio & Lacroix, ICRA 2022).

    Each gives means and variances of the error along the target's principal axes from a pair's descriptors, by the
    Gaussian likelihood of all runs. Their average spread is aleatoric, their disagreement epistemic (Lakshminarayanan
    et al. 2017). The original is variational, on clouds. It models the error, whatever causes it.
    """
    import torch

    from gpca.portable import Adam

    reduce, features_E_K = _reduced(examples, COMPONENTS)
    random, features = generator("learned covariance"), torch.from_numpy(features_E_K)
    shapes = (members, features_E_K.shape[1] + 1, hidden), (members, hidden + 1, 12)
    drawn = [random.normal(size=shape) * (1 / np.sqrt(shape[1])) for shape in shapes]
    layers = [torch.tensor(each, dtype=torch.float64, requires_grad=True) for each in drawn]
    errors = [_errors(example) for example in examples]
    mean = torch.from_numpy(np.array([error_n_6.mean(axis=0) for error_n_6 in errors]))
    variance = torch.from_numpy(np.array([error_n_6.var(axis=0) for error_n_6 in errors]))
    optimizer = Adam(layers, learning_rate)
    for _ in range(steps):
        optimizer.zero_grad()
        outputs, log_variance = _predicted(layers, features)
        misfit = ((mean - outputs).square() + variance) * torch.exp(-log_variance)
        decay = weight_decay * sum(weights.square().sum() for weights in layers)
        loss = 0.5 * (log_variance + misfit).sum(dim=2).mean(dim=1).sum() + decay
        loss.backward()
        optimizer.step()

    def estimate(registered: interface.RegisteredPair) -> np.ndarray:
        with torch.no_grad():
            means, log_variances = _predicted(layers, torch.from_numpy(reduce(described(registered)[None])))
        aleatoric_6 = torch.exp(log_variances)[:, 0].mean(dim=0).numpy()
        epistemic_6 = means[:, 0].var(dim=0, correction=0).numpy()
        return along_axes(np.diag(aleatoric_6 + epistemic_6), interface.intrinsic_frame(registered.pair.target))

    return estimate


def _predicted(layers: Sequence, features_E_K):
    """Return the means and the logarithms of the variances (M, E, 6) of networks of one hidden layer."""
    import torch

    first, second = layers
    ones = torch.ones(*features_E_K.shape[:-1], 1, dtype=torch.float64)
    inputs = torch.cat([features_E_K, ones], dim=-1).expand(len(first), -1, -1)
    hidden = torch.tanh(inputs @ first)
    outputs = torch.cat([hidden, torch.ones_like(hidden[:, :, :1])], dim=2) @ second
    # In units near those of the errors, so that weights near one suit both.
    return 0.1 * outputs[:, :, :6], (2 * outputs[:, :, 6:] - 6).clamp(SMALLEST_LOG, LARGEST_LOG)


def _errors(example: interface.Example) -> np.ndarray:
    """Return the twists (n, 6) of the true pose about each of the runs' results, along the axes."""
    away_n = exp(example.true_twist[None]) @ np.linalg.inv(exp(example.twists))
    return twists_along_axes(log(away_n), example.T_target_intrinsic)


ESTIMATORS = {
    "cello": interface.EstimatorEntry("CELLO-3D", "starts and data", learn=learn_cello),
    "learned": interface.EstimatorEntry("Learned ensemble", "error", learn=learn_ensemble),
}
