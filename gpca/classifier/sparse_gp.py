"""Sparse GPs under variational inference: covariances, the start of a fit, its ELBO, and the fitted prior.

The objective is gpytorch's (``VariationalStrategy``, ``CholeskyVariationalDistribution``, ``SoftmaxLikelihood`` and
``VariationalELBO`` with their defaults) from the same random numbers, several times faster: the C latents share the
distances between inputs, and nothing is built for sizes that are fixed. :mod:`gpca.classifier.gpytorch_classes` is
gpytorch's form, and ``tests/classifier/test_sparse_gp.py`` compares the two.
"""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import dataclass, field

import gpytorch
import numpy as np
import torch
from linear_operator.utils.cholesky import psd_safe_cholesky
from scipy.linalg import solve_triangular
from torch import Tensor, nn

from gpca.classifier.latents import Latents, Projection
from gpca.classifier.settings import GPCSettings
from gpca.portable import square_root
from gpca.seeds import generator, seed_of

# gpytorch's in single precision: added to variances of the prior; smallest variance of a latent.
JITTER, LEAST_VARIANCE = 1e-4, 1e-6
LIKELIHOOD_DRAWS = 10
MOST_MEDIAN = 1000  # random inputs among which the median distance is taken
MEAN_DEVIATION = 1e-3  # standard deviation of the variational mean at the start


class ScaledPolynomial(gpytorch.kernels.PolynomialKernel):
    """The covariance (xᵀx' / d + c)²: plain inner products of some hundred dimensions learn nothing."""

    def __init__(self, **options) -> None:
        super().__init__(power=2, **options)

    def forward(self, x1: Tensor, x2: Tensor, **options) -> Tensor:
        """Return the covariance of the inputs."""
        width = math.sqrt(x1.shape[-1])
        return super().forward(x1 / width, x2 / width, **options)


COVARIANCES = {
    "rbf": gpytorch.kernels.RBFKernel,
    "matern32": lambda **options: gpytorch.kernels.MaternKernel(nu=1.5, **options),
    "polynomial": ScaledPolynomial,
}


class Scaled(gpytorch.kernels.ScaleKernel):
    """Scales over a covariance of the same batch shape: no shapes to broadcast, for which torch would load SymPy."""

    batch_shape = property(lambda self: self._batch_shape, lambda self, shape: setattr(self, "_batch_shape", shape))


def make_covariance(name: str, n_classes: int, lengthscale: float) -> gpytorch.kernels.ScaleKernel:
    """Return C covariances with separate scales; the polynomial one has an offset and no lengthscale."""
    batch = torch.Size([n_classes])
    covariance = Scaled(COVARIANCES[name](batch_shape=batch), batch_shape=batch)
    if covariance.base_kernel.has_lengthscale:
        covariance.base_kernel.lengthscale = lengthscale
    return covariance


def cross_covariance(covariance: gpytorch.kernels.ScaleKernel, a_A_d: Tensor, b_B_d: Tensor) -> Tensor:
    """Return k_c(a, b), (C, A, B), of one of `COVARIANCES`."""
    base = covariance.base_kernel
    scale_C_1_1 = covariance.outputscale[:, None, None]
    if isinstance(base, ScaledPolynomial):
        inner_A_B = a_A_d @ b_B_d.T / a_A_d.shape[1]
        return scale_C_1_1 * (inner_A_B + base.offset[:, :, None]).square()
    squared_A_B = squared_distances(a_A_d, b_B_d)
    if isinstance(base, gpytorch.kernels.MaternKernel):
        # The root of zero has an infinite derivative, so the squares stay above it.
        scaled_C_A_B = square_root(squared_A_B.clamp_min(1e-15)) * (math.sqrt(3) / base.lengthscale)
        return scale_C_1_1 * (1 + scaled_C_A_B) * torch.exp(-scaled_C_A_B)
    return scale_C_1_1 * torch.exp(squared_A_B * (-0.5 / base.lengthscale.square()))


def variance(covariance: gpytorch.kernels.ScaleKernel, a_A_d: Tensor) -> Tensor:
    """Return k_c(a, a), (C, A)."""
    base = covariance.base_kernel
    scale_C_1 = covariance.outputscale[:, None]
    if isinstance(base, ScaledPolynomial):
        return scale_C_1 * (a_A_d.square().mean(dim=1) + base.offset).square()
    return scale_C_1.expand(-1, len(a_A_d))


def squared_distances(a_A_d: Tensor, b_B_d: Tensor) -> Tensor:
    """Return |a - b|², (A, B)."""
    squares_A_1, squares_B = a_A_d.square().sum(dim=1, keepdim=True), b_B_d.square().sum(dim=1)
    return torch.addmm(squares_A_1 + squares_B, a_A_d, b_B_d.T, alpha=-2).clamp_min(0)


class SparseGPs(nn.Module):
    """C independent GPs with shared inducing inputs, separate covariances and whitened posteriors N(mean, R Rᵀ)."""

    def __init__(self, covariance: gpytorch.kernels.ScaleKernel, inducing_M_d: Tensor, random: torch.Generator) -> None:
        super().__init__()
        shape = (len(covariance.outputscale), len(inducing_M_d))
        self.covariance = covariance
        self.inducing_M_d = nn.Parameter(inducing_M_d.clone())
        self.mean_C_M = nn.Parameter(MEAN_DEVIATION * torch.randn(shape, generator=random))
        self.root_C_M_M = nn.Parameter(torch.eye(shape[1]).repeat(shape[0], 1, 1))  # only its lower triangle is used
        self._random = random

    def set_posterior(self, latents: Latents) -> None:
        """Set the variational parameters to this posterior."""
        with torch.no_grad():
            self.mean_C_M.copy_(torch.from_numpy(latents.mean_C_M))
            self.root_C_M_M.copy_(torch.linalg.cholesky(torch.from_numpy(latents.covariance_C_M_M)))

    def marginals(self, inputs_N_d: Tensor) -> tuple[Tensor, Tensor]:
        """Return mean and variance (C, N) of the latents at standardized inputs."""
        jitter_M_M = JITTER * torch.eye(len(self.inducing_M_d))
        K_C_M_M = cross_covariance(self.covariance, self.inducing_M_d, self.inducing_M_d) + jitter_M_M
        cholesky_C_M_M = psd_safe_cholesky(K_C_M_M.double()).float()
        K_C_M_N = cross_covariance(self.covariance, self.inducing_M_d, inputs_N_d)
        weights_C_M_N = torch.linalg.solve_triangular(cholesky_C_M_M, K_C_M_N, upper=False)
        mean_C_N = (self.mean_C_M[:, None] @ weights_C_M_N)[:, 0]
        spread_C_N = (self.root_C_M_M.tril().mT @ weights_C_M_N).square().sum(dim=1)
        explained_C_N = weights_C_M_N.square().sum(dim=1)
        return mean_C_N, variance(self.covariance, inputs_N_d) + JITTER - explained_C_N + spread_C_N

    def divergence(self) -> Tensor:
        """Return KL(q ‖ N(0, I)) in nats, summed over the latents."""
        root_C_M_M = self.root_C_M_M.tril()
        log_determinant = 2 * root_C_M_M.diagonal(dim1=1, dim2=2).abs().log().sum()
        squares = root_C_M_M.square().sum() + self.mean_C_M.square().sum()
        return 0.5 * (squares - self.mean_C_M.numel() - log_determinant)

    def elbo(self, inputs_N_d: Tensor, targets_N: Tensor) -> Tensor:
        """Return the evidence lower bound per sample in nats, its expectation over `LIKELIHOOD_DRAWS` draws."""
        mean_C_N, variance_C_N = self.marginals(inputs_N_d)
        shape = (LIKELIHOOD_DRAWS, len(inputs_N_d), len(mean_C_N))
        normal_D_N_C = torch.randn(shape, generator=self._random)
        deviation_N_C = square_root(variance_C_N.clamp_min(LEAST_VARIANCE)).T
        logits_D_C_N = (mean_C_N.T + deviation_N_C * normal_D_N_C).mT.contiguous()
        # Classes before samples: sums over three neighbors are several times slower.
        log_p_D_N = logits_D_C_N[:, targets_N, torch.arange(len(targets_N))] - logits_D_C_N.logsumexp(dim=1)
        return (log_p_D_N.mean(dim=0).sum() - self.divergence()) / len(targets_N)

    def latents(self) -> Latents:
        """Return the whitened variational posterior."""
        root_C_M_M = self.root_C_M_M.detach().tril().double()
        return Latents(self.mean_C_M.detach().double().numpy(), (root_C_M_M @ root_C_M_M.mT).numpy())


@dataclass(frozen=True)
class Prior:
    """The fitted covariances, of batch shape (C,), over shared, standardized inducing inputs."""

    covariance: gpytorch.kernels.ScaleKernel
    inducing_M_d: Tensor
    _cholesky_C_M_M: np.ndarray = field(init=False, repr=False)

    @classmethod
    def of(cls, model: SparseGPs) -> Prior:
        """Copy covariance and inducing inputs from a trained model."""
        return cls(deepcopy(model.covariance).requires_grad_(False), model.inducing_M_d.detach().clone())

    def __post_init__(self) -> None:
        with torch.no_grad():
            K_C_M_M = cross_covariance(self.covariance, self.inducing_M_d, self.inducing_M_d)
            cholesky_C_M_M = psd_safe_cholesky((K_C_M_M + JITTER * torch.eye(len(self.inducing_M_d))).double())
        object.__setattr__(self, "_cholesky_C_M_M", cholesky_C_M_M.numpy())

    def project(self, inputs_N_d: Tensor) -> Projection:
        """Return weights L⁻¹ k(Z, x) and residual variance k(x, x) - |weights|² of standardized inputs."""
        with torch.no_grad():
            K_C_M_N = cross_covariance(self.covariance, self.inducing_M_d, inputs_N_d).double().numpy()
            variance_C_N = variance(self.covariance, inputs_N_d).double().numpy() + JITTER
        pairs = zip(self._cholesky_C_M_M, K_C_M_N, strict=True)
        weights_C_M_N = np.stack([solve_triangular(L, K, lower=True) for L, K in pairs])
        residual_C_N = variance_C_N - np.square(weights_C_M_N).sum(axis=1)
        return Projection(inputs_N_d.numpy(), np.swapaxes(weights_C_M_N, 1, 2), np.maximum(residual_C_N, 0))

    def means(self, inputs_N_d: Tensor, mean_C_M: np.ndarray) -> Tensor:
        """Return the latents' means (N, C), float64, differentiable in the standardized inputs, by whitened ones."""
        weights_C_M = np.stack([solve_triangular(L.T, m) for L, m in zip(self._cholesky_C_M_M, mean_C_M, strict=True)])
        K_C_M_N = cross_covariance(self.covariance, self.inducing_M_d.double(), inputs_N_d.double())
        return torch.einsum("cmn,cm->nc", K_C_M_N, torch.from_numpy(weights_C_M))

    def grow(self) -> Prior:
        """Add a covariance whose parameters are the geometric means of the others'."""
        return self._with_parameters(lambda values_C: torch.cat([values_C, _geometric_mean(values_C)]))

    def level(self, labeled_C: np.ndarray) -> Prior:
        """Give the covariances of classes without labels the geometric means of the labeled classes' parameters.

        Without a label, a class's covariance has learned only how best to be wrong.
        """
        is_labeled_C = torch.from_numpy(labeled_C)

        def leveled(values_C: Tensor) -> Tensor:
            values_C = values_C.clone()
            values_C[~is_labeled_C] = _geometric_mean(values_C[is_labeled_C])
            return values_C

        return self._with_parameters(leveled)

    def _with_parameters(self, change) -> Prior:
        """Apply `change` to each covariance parameter (C, …) in its constrained form."""
        covariance = deepcopy(self.covariance)
        for part in (covariance, covariance.base_kernel):
            for name, raw_C in list(part.named_parameters(recurse=False)):
                constraint = part.constraint_for_parameter_name(name)
                raw_C = constraint.inverse_transform(change(constraint.transform(raw_C)))
                setattr(part, name, torch.nn.Parameter(raw_C, requires_grad=False))
                part.batch_shape = raw_C.shape[:1]
        return Prior(covariance, self.inducing_M_d)


def _geometric_mean(values_C: Tensor) -> Tensor:
    return values_C.log().mean(dim=0, keepdim=True).exp()


@dataclass(frozen=True)
class Standardization:
    """Means and deviations (d,) of inputs, 1 for a constant input; scikit-learn, slow to load, only fits it."""

    mean_d: np.ndarray
    scale_d: np.ndarray

    @classmethod
    def of(cls, h_N_d: np.ndarray) -> Standardization:
        """Fit it to inputs."""
        from sklearn.preprocessing import StandardScaler

        fitted = StandardScaler().fit(h_N_d)
        return cls(fitted.mean_, fitted.scale_)

    def __call__(self, h_N_d: np.ndarray) -> np.ndarray:
        """Return the standardized inputs, in their precision."""
        precision = np.result_type(h_N_d, np.float32)
        return (h_N_d - self.mean_d.astype(precision)) / self.scale_d.astype(precision)

    def tensor(self, h_N_d: np.ndarray) -> Tensor:
        """Return the standardized inputs as a tensor in single precision."""
        return torch.from_numpy(self(h_N_d).astype(np.float32))


@dataclass(frozen=True)
class Start:
    """The start of a fit, the same for :mod:`gpca.classifier.gpc` and :mod:`gpca.classifier.gpytorch_classes`."""

    # Its lengthscale is the median distance: with gpytorch's, an RBF kernel on some hundred dimensions stays at chance.
    covariance: gpytorch.kernels.ScaleKernel
    inducing_M_d: Tensor  # k-means centers of the standardized inputs, at most as many as there are distinct inputs
    seed: int  # of the initial variational mean and the samples of the likelihood

    @classmethod
    def of(cls, inputs_N_d: Tensor, n_classes: int, settings: GPCSettings, axes: tuple) -> Start:
        """Return the start around standardized inputs; `axes` name the seeds."""
        from sklearn.cluster import KMeans

        order = generator(*axes, "median").permutation(len(inputs_N_d))[:MOST_MEDIAN]
        median = float(torch.pdist(inputs_N_d[order]).median()) if len(order) > 1 else 0.0
        covariance = make_covariance(settings.kernel, n_classes, median if median > 0 else 1.0)
        clusters = min(settings.inducing, len(torch.unique(inputs_N_d, dim=0)))
        kmeans = KMeans(clusters, n_init=1, random_state=seed_of(*axes, "inducing") % 2**32).fit(inputs_N_d.numpy())
        centers_M_d = torch.from_numpy(kmeans.cluster_centers_.astype(np.float32))
        return cls(covariance, centers_M_d, seed_of(*axes, "gpc"))

    @classmethod
    def after(cls, prior: Prior, axes: tuple) -> Start:
        """Return the start at the result of an earlier fit."""
        return cls(deepcopy(prior.covariance).requires_grad_(True), prior.inducing_M_d, seed_of(*axes, "gpc"))
