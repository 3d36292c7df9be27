"""CELLO-3D (Landry, Pomerleau & Giguère 2019): the covariance is the mean of those of like training pairs.

A learned metric of descriptors tells which pairs are alike: a weight exp(-|L (φ - φ')|²) for each training pair, L
diagonal and chosen so that the runs of each training pair are likely under the covariance that the others give it.

It models how results vary between the runs that it is taught with (ICRA 2019): starts and data where these vary both.
That all runs of a pair may be wrong alike is no part of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gpca.alignment.rigid import adjoint
from gpca.uncertainty.estimators.interface import (
    Estimator,
    Example,
    FailedEstimate,
    RegisteredPair,
    intrinsic_frame,
    require_examples,
)
from gpca.uncertainty.estimators.interface import EstimatorEntry as Entry

FEWEST_EXAMPLES = 8
FLOOR = 1e-8  # squared radians and diameters, of a training variance
LEAST_SINGULAR = 1e-6  # of the largest: what is below is rounding


def learn(examples: Sequence[Example], components: int = 8, steps: int = 100, learning_rate: float = 0.05) -> Estimator:
    """Learn the metric.

    Axes of a pair have no common sign, over which the covariance between two of them averages out: what is learned are
    the six variances along the principal axes of the target (:func:`intrinsic_frame`).

    Args:
        components: of a PCA of the descriptors.
        steps, learning_rate: of Adam on the leave-one-out likelihood.
    """
    import torch

    from gpca.portable import Adam, logarithm

    require_examples(examples, FEWEST_EXAMPLES)
    reduce = Reduction([example.descriptors for example in examples], components)
    features = torch.from_numpy(reduce(np.array([example.descriptors for example in examples])))
    variances_E_6 = np.array([_variances(example) for example in examples])
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
    known_E_K = features.numpy() * scale_K

    def estimate(registered: RegisteredPair) -> np.ndarray:
        squares_E = np.square(reduce(described(registered)[None]) * scale_K - known_E_K).sum(axis=1)
        weights_E = np.exp(squares_E.min() - squares_E)
        variances_6 = (weights_E[:, None] * variances_E_6).sum(axis=0) / weights_E.sum()
        return along_axes(np.diag(variances_6), intrinsic_frame(registered.pair.target))

    return estimate


class Reduction:
    """Descriptors, standardized and limited, onto their first principal components.

    There are at most one fewer than training pairs: along any other axis these do not differ, and another pair would
    lie infinitely far away.
    """

    def __init__(self, descriptors: Sequence[np.ndarray], components: int) -> None:
        stacked_E_F = np.array(descriptors)
        self._mean_F, deviation_F = stacked_E_F.mean(axis=0), stacked_E_F.std(axis=0)
        self._deviation_F = np.where(deviation_F > 1e-9, deviation_F, np.inf)  # what never changes says nothing
        _, singular_F, axes_F_F = np.linalg.svd(self._standard(stacked_E_F), full_matrices=False)
        axes_F_F = axes_F_F[singular_F > LEAST_SINGULAR * singular_F[0]]
        largest = np.abs(axes_F_F).argmax(axis=1)  # a component's sign is arbitrary
        signs = np.sign(axes_F_F[np.arange(len(axes_F_F)), largest])
        self._axes_K_F = (axes_F_F * signs[:, None])[:components]
        self._size_K = np.einsum("ef,kf->ek", self._standard(stacked_E_F), self._axes_K_F).std(axis=0)

    def __call__(self, descriptors_n_F: np.ndarray) -> np.ndarray:
        """Return the components (n, K), of unit deviation over the training pairs."""
        return np.einsum("nf,kf->nk", self._standard(descriptors_n_F), self._axes_K_F) / self._size_K

    def _standard(self, descriptors_n_F: np.ndarray) -> np.ndarray:
        return np.clip((descriptors_n_F - self._mean_F) / self._deviation_F, -5, 5)


def described(registered: RegisteredPair) -> np.ndarray:
    """Return the pair's descriptors (F,); without any the estimate fails."""
    if registered.describe is None:
        raise FailedEstimate("the pair has no descriptors")
    return registered.describe()


def along_axes(covariance_6_6: np.ndarray, T_target_intrinsic: np.ndarray) -> np.ndarray:
    """Return a covariance of the intrinsic frame as one of the target's frame."""
    Ad = adjoint(T_target_intrinsic)
    return Ad @ covariance_6_6 @ Ad.T


def twists_along_axes(twists_n_6: np.ndarray, T_target_intrinsic: np.ndarray) -> np.ndarray:
    """Return twists of the target's frame (n, 6) in the intrinsic one."""
    return np.linalg.solve(adjoint(T_target_intrinsic), twists_n_6.T).T


def _variances(example: Example) -> np.ndarray:
    return twists_along_axes(example.twists, example.T_target_intrinsic).var(axis=0) + FLOOR


ESTIMATORS = {"cello": Entry("CELLO-3D", "starts and data", learn=learn)}
