"""Where a fit of the classifier starts: scaled inputs, covariance, inducing inputs, and the seed of its random numbers.

The suite's form of the classifier (:mod:`gpca.classifier.gpc`) and that in gpytorch's own classes
(:mod:`gpca.classifier.gpytorch_classes`) start at the same place, or they could not give the same numbers.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass

import gpytorch
import numpy as np
import torch

from gpca.classifier.covariances import make_covariance
from gpca.classifier.prior import Prior
from gpca.classifier.settings import GPCSettings
from gpca.seeds import generator, seed_of


@dataclass(frozen=True)
class Standardization:
    """Means and deviations (d,) of the inputs that it was fitted to; a constant input has the deviation 1.

    scikit-learn fits it. To apply it takes none of that, which loads for a second.
    """

    mean_d: np.ndarray
    scale_d: np.ndarray

    @classmethod
    def of(cls, h_N_d: np.ndarray) -> Standardization:
        """Fit it to inputs."""
        from sklearn.preprocessing import StandardScaler

        fitted = StandardScaler().fit(h_N_d)
        return cls(fitted.mean_, fitted.scale_)

    def __call__(self, h_N_d: np.ndarray) -> np.ndarray:
        """Return the standardized inputs, in their own precision."""
        precision = np.result_type(h_N_d, np.float32)
        return (h_N_d - self.mean_d.astype(precision)) / self.scale_d.astype(precision)

    def tensor(self, h_N_d: np.ndarray) -> torch.Tensor:
        """Return the standardized inputs as a tensor in single precision."""
        return torch.from_numpy(self(h_N_d).astype(np.float32))


@dataclass(frozen=True)
class Start:
    """The start of a fit, before its first iteration.

    Attributes:
        covariance: of batch shape (C,), its lengthscale the median distance; with gpytorch's default an RBF kernel on
            some hundred dimensions stays at chance.
        inducing_M_d: k-means centers of the standardized inputs, at most as many as these have different points.
        seed: of the fit's random numbers: the start of the variational mean, then the samples of the likelihood.
    """

    covariance: gpytorch.kernels.ScaleKernel
    inducing_M_d: torch.Tensor
    seed: int

    @classmethod
    def of(cls, inputs_N_d: torch.Tensor, n_classes: int, settings: GPCSettings, axes: tuple) -> Start:
        """Return the start around standardized inputs; `axes` name the seeds."""
        covariance = make_covariance(settings.kernel, n_classes, _median_distance(inputs_N_d, axes))
        return cls(covariance, _inducing_inputs(inputs_N_d, settings.inducing, axes), seed_of(*axes, "gpc"))

    @classmethod
    def after(cls, prior: Prior, axes: tuple) -> Start:
        """Return the start at what an earlier fit learned."""
        return cls(deepcopy(prior.covariance).requires_grad_(True), prior.inducing_M_d, seed_of(*axes, "gpc"))


def _inducing_inputs(inputs_N_d: torch.Tensor, most: int, axes: tuple) -> torch.Tensor:
    from sklearn.cluster import KMeans

    clusters = min(most, len(torch.unique(inputs_N_d, dim=0)))
    kmeans = KMeans(clusters, n_init=1, random_state=seed_of(*axes, "inducing") % 2**32)
    return torch.from_numpy(kmeans.fit(inputs_N_d.numpy()).cluster_centers_.astype(np.float32))


def _median_distance(inputs_N_d: torch.Tensor, axes: tuple, most: int = 1000) -> float:
    """Return the median distance between distinct points (the median heuristic), of at most `most` drawn ones."""
    order = generator(*axes, "median").permutation(len(inputs_N_d))[:most]
    median = float(torch.pdist(inputs_N_d[order]).median()) if len(order) > 1 else 0.0
    return median if median > 0 else 1.0
