"""Multi-class Gaussian process classification by sparse variational inference (paper Sec. III-B), on gpytorch.

One latent GP per concept, inducing inputs shared by all, Cholesky variational posterior, softmax likelihood
(Hensman et al. 2015). The label space is fixed at construction, so a concept without a label yet has its GP already.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import gpytorch
import numpy as np
import torch
from sklearn.cluster import KMeans
from sklearn.preprocessing import StandardScaler

from gpca.attribution import summarise_draws
from gpca.errors import InputError
from gpca.progress import progress
from gpca.seeds import generator, seed_of

KERNELS = {
    "rbf": gpytorch.kernels.RBFKernel,
    "matern32": lambda **options: gpytorch.kernels.MaternKernel(nu=1.5, **options),
}


@dataclass(frozen=True)
class GPCSettings:
    """How the classifier is built and fitted; the defaults are the paper's.

    Attributes:
        kernel: ``rbf`` or ``matern32``.
        learning_rate, iterations: of Adam on the ELBO of the whole training set.
        inducing: number of shared inducing inputs N_Z.
        draws: M, posterior draws per explanation.
    """

    kernel: str = "rbf"
    learning_rate: float = 0.01
    iterations: int = 100
    inducing: int = 64
    draws: int = 1000

    def __post_init__(self) -> None:
        if self.kernel not in KERNELS:
            raise InputError(f"kernel '{self.kernel}'", "unknown", f"known are {', '.join(KERNELS)}")


class GPC:
    """Gaussian process classifier over embeddings.

    Args:
        classes: (C,) the label space, in the order of the score columns.
        settings: see :class:`GPCSettings`.
        axes: names of the seed (source, seed, …).
    """

    def __init__(self, classes: tuple[str, ...], settings: GPCSettings, *axes: object) -> None:
        self.classes = classes
        self.settings = settings
        self._axes = axes

    def fit(self, h_N_d: np.ndarray, labels_N: np.ndarray) -> GPC:
        """Maximise the ELBO (variational parameters, inducing inputs, kernel parameters).

        Inputs are standardised, inducing inputs start at k-means centres and the lengthscale at the median distance:
        with gpytorch's default lengthscale an RBF kernel on some hundred dimensions stays at chance.
        """
        self._scaler = StandardScaler().fit(h_N_d)
        inputs_N_d = self._scaled(h_N_d)
        targets_N = torch.tensor([self.classes.index(label) for label in labels_N])
        with _torch_seed(*self._axes, "gpc"):
            self._model = _LatentGPs(_inducing_inputs(inputs_N_d, self.settings, self._axes), len(self.classes))
            self._model.initialise(KERNELS[self.settings.kernel], _median_distance(inputs_N_d, self._axes))
            likelihood = _Softmax(num_classes=len(self.classes), mixing_weights=False)
            elbo = gpytorch.mlls.VariationalELBO(likelihood, self._model, num_data=len(targets_N))
            optimiser = torch.optim.Adam(self._model.parameters(), lr=self.settings.learning_rate)
            self._model.train()
            for _ in progress(range(self.settings.iterations), " ".join(map(str, ("GPC", *self._axes)))):
                optimiser.zero_grad()
                loss = -elbo(self._model(inputs_N_d), targets_N)
                loss.backward()
                optimiser.step()
        self._model.eval()
        return self

    def posterior(self, h_N_d: np.ndarray, block: int = 256) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation (N, C) of the latent logits q(f(h)); the latents are independent."""
        inputs_N_d = self._scaled(h_N_d)
        means, deviations = [], []
        with torch.no_grad():
            for rows in torch.split(inputs_N_d, block):
                q = self._model(rows)
                means.append(q.mean)
                deviations.append(q.variance.clamp_min(0).sqrt())
        return torch.cat(means).double().numpy(), torch.cat(deviations).double().numpy()

    def attribute(self, h_N_d: np.ndarray, block: int = 128) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores_N_C, variances_N_C and bald_N from M posterior draws (Eqs. 4, 5, 7).

        All points share the same M·C standard normal numbers, so a point's result does not depend on the others;
        per-point marginals suffice, because none of the three uses correlations between points.
        """
        mean_N_C, deviation_N_C = self.posterior(h_N_d)
        normal_M_1_C = generator(*self._axes, "draws").normal(size=(self.settings.draws, 1, len(self.classes)))
        parts = [
            summarise_draws(mean + deviation * normal_M_1_C)
            for mean, deviation in zip(_blocks(mean_N_C, block), _blocks(deviation_N_C, block), strict=True)
        ]
        scores, variances, bald = (np.concatenate(part) for part in zip(*parts, strict=True))
        return scores, variances, bald

    def _scaled(self, h_N_d: np.ndarray) -> torch.Tensor:
        return torch.from_numpy(self._scaler.transform(h_N_d).astype(np.float32))


class _Softmax(gpytorch.likelihoods.SoftmaxLikelihood):
    """The softmax likelihood of logits (…, N, C); gpytorch's own takes N = C points for an old, transposed layout."""

    def forward(self, logits_N_C, *_args, **_kwargs):
        """Return the distribution of the label given the latents (Eq. 2)."""
        return torch.distributions.Categorical(logits=logits_N_C)


class _LatentGPs(gpytorch.models.ApproximateGP):
    """C independent sparse GPs with shared inducing inputs (M, d) and kernels of their own."""

    def __init__(self, inducing_M_d: torch.Tensor, n_classes: int) -> None:
        batch = torch.Size([n_classes])
        distribution = gpytorch.variational.CholeskyVariationalDistribution(len(inducing_M_d), batch_shape=batch)
        strategy = gpytorch.variational.VariationalStrategy(
            self, inducing_M_d, distribution, learn_inducing_locations=True
        )
        super().__init__(gpytorch.variational.IndependentMultitaskVariationalStrategy(strategy, num_tasks=n_classes))
        self._batch = batch

    def initialise(self, kernel, lengthscale: float) -> None:
        """Set the prior: zero mean (Eq. 1) and a scaled kernel with the given lengthscale."""
        self.mean_module = gpytorch.means.ZeroMean(batch_shape=self._batch)
        self.covar_module = gpytorch.kernels.ScaleKernel(kernel(batch_shape=self._batch), batch_shape=self._batch)
        self.covar_module.base_kernel.lengthscale = lengthscale

    def forward(self, inputs):
        """Return the prior over the latents at the inputs."""
        return gpytorch.distributions.MultivariateNormal(self.mean_module(inputs), self.covar_module(inputs))


def _inducing_inputs(inputs_N_d: torch.Tensor, settings: GPCSettings, axes: tuple) -> torch.Tensor:
    clusters = min(settings.inducing, len(torch.unique(inputs_N_d, dim=0)))
    kmeans = KMeans(clusters, n_init=1, random_state=seed_of(*axes, "inducing") % 2**32)
    return torch.from_numpy(kmeans.fit(inputs_N_d.numpy()).cluster_centers_.astype(np.float32))


def _median_distance(inputs_N_d: torch.Tensor, axes: tuple, most: int = 1000) -> float:
    """Median of the distances between distinct points (the median heuristic), at most `most` points drawn."""
    order = generator(*axes, "median").permutation(len(inputs_N_d))[:most]
    median = float(torch.pdist(inputs_N_d[order]).median()) if len(order) > 1 else 0.0
    return median if median > 0 else 1.0


def _blocks(rows: np.ndarray, size: int) -> list[np.ndarray]:
    return [rows[start : start + size] for start in range(0, len(rows), size)]


@contextmanager
def _torch_seed(*axes: object) -> Iterator[None]:
    """Seed torch's global generator, from which gpytorch draws, and restore it afterwards."""
    with torch.random.fork_rng():
        torch.manual_seed(seed_of(*axes))
        yield
