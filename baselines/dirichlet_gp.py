"""Dirichlet-based exact GP classification on the embeddings (Milios et al. 2018; paper, Table V): a GP on all samples.

A label becomes a Dirichlet distribution with α = α_ε + 1{y = c}, its log-normal approximation a regression target
with a noise of its own (gpytorch's likelihood does this). One exact GP per concept is then fitted by its marginal
likelihood, and the softmax of its draws are the probabilities.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter

import numpy as np

from baselines.attached import attached
from baselines.concept_classifier import known_concepts
from gpca.attribution.scores import Attribution, summarise_marginals
from gpca.explainers.interface import ExplainerEntry
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator

JITTER = 1e-6


class DirichletGP:
    """Exact GPs with RBF kernels of one scale and lengthscale per concept.

    Args:
        alpha: α_ε; small is confident.
        iterations, learning_rate: how Adam climbs the marginal likelihood.
        draws: M.
    """

    def __init__(
        self,
        source: str,
        seed: int,
        alpha: float = 0.01,
        iterations: int = 40,
        learning_rate: float = 0.1,
        draws: int = 1000,
    ) -> None:
        self._axes = (source, seed, "dirichlet")
        self._alpha = alpha
        self._iterations = iterations
        self._learning_rate = learning_rate
        self._draws = draws

    def fit(self, registrations: Registrations) -> None:
        """Fit to the labelled embeddings; fewer than two concepts among the labels raise an InputError."""
        import torch
        from gpytorch.likelihoods import DirichletClassificationLikelihood
        from sklearn.preprocessing import StandardScaler

        from gpca.adam import Adam
        from gpca.classifier.covariances import squared_distances

        known_concepts(registrations.concept)
        h_N_d = attached(registrations, "embedding", None)
        self._scaler = StandardScaler().fit(h_N_d)
        self._inputs_N_d = self._scaled(h_N_d)
        squared_N_N = squared_distances(self._inputs_N_d, self._inputs_N_d)
        targets_N = torch.tensor([CONCEPTS.index(concept) for concept in registrations.concept])
        likelihood = DirichletClassificationLikelihood(
            targets_N, alpha_epsilon=self._alpha, num_classes=len(CONCEPTS), dtype=torch.float64
        )
        values_C_N = likelihood.transformed_targets
        noise_C_N = likelihood.noise_covar.noise.detach()
        median = float(squared_N_N.median()) ** 0.5
        self._log_lengthscale_C = torch.full((len(CONCEPTS),), np.log(median if median > 0 else 1.0)).double()
        self._log_scale_C = values_C_N.var(dim=1).log()
        self._mean_C = values_C_N.mean(dim=1)
        parameters = [self._log_lengthscale_C, self._log_scale_C, self._mean_C]
        optimiser = Adam([each.requires_grad_() for each in parameters], self._learning_rate)
        for _ in range(self._iterations):
            cholesky_C_N_N, whitened_C_N_1 = self._factor(squared_N_N, values_C_N, noise_C_N)
            log_determinants = cholesky_C_N_N.diagonal(dim1=1, dim2=2).log().sum()
            optimiser.zero_grad()
            ((0.5 * whitened_C_N_1.square().sum() + log_determinants) / len(targets_N)).backward()
            optimiser.step()
        with torch.no_grad():
            self._cholesky_C_N_N, self._whitened_C_N_1 = self._factor(squared_N_N, values_C_N, noise_C_N)

    def explain(self, registrations: Registrations) -> Attribution:
        """Draw from the posterior at every embedding and summarise, as GP-CA does."""
        started = perf_counter()
        normal_M_C = generator(*self._axes, "draws").normal(size=(self._draws, len(CONCEPTS)))
        scores_N_C, variances_N_C, bald_N = summarise_marginals(*self._posterior(registrations), normal_M_C)
        seconds = (perf_counter() - started) / len(registrations)
        attribution = Attribution.of_scores(CONCEPTS, scores_N_C, seconds=seconds)
        return replace(attribution, variances_N_C=variances_N_C, bald_N=bald_N)

    def _factor(self, squared_N_N, values_C_N, noise_C_N):
        """Return the Cholesky factors L of the noisy covariances and L⁻¹ of the centred targets."""
        import torch

        K_C_N_N = self._covariance(squared_N_N) + torch.diag_embed(noise_C_N + JITTER)
        cholesky_C_N_N = torch.linalg.cholesky(K_C_N_N)
        centred_C_N_1 = (values_C_N - self._mean_C[:, None])[:, :, None]
        return cholesky_C_N_N, torch.linalg.solve_triangular(cholesky_C_N_N, centred_C_N_1, upper=False)

    def _covariance(self, squared_A_B):
        scaled_C_A_B = squared_A_B * (-0.5 * (-2 * self._log_lengthscale_C).exp())[:, None, None]
        return self._log_scale_C.exp()[:, None, None] * scaled_C_A_B.exp()

    def _posterior(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation (N, C) of the latents."""
        import torch

        from gpca.classifier.covariances import squared_distances

        inputs_N_d = self._scaled(attached(registrations, "embedding", None))
        with torch.no_grad():
            K_C_T_N = self._covariance(squared_distances(self._inputs_N_d, inputs_N_d))
            weights_C_T_N = torch.linalg.solve_triangular(self._cholesky_C_N_N, K_C_T_N, upper=False)
            mean_C_N = self._mean_C[:, None] + (weights_C_T_N * self._whitened_C_N_1).sum(dim=1)
            variance_C_N = self._log_scale_C.exp()[:, None] - weights_C_T_N.square().sum(dim=1)
        return mean_C_N.numpy().T, variance_C_N.clamp_min(0).sqrt().numpy().T

    def _scaled(self, h_N_d: np.ndarray):
        import torch

        return torch.from_numpy(self._scaler.transform(h_N_d))


EXPLAINERS = {"learner_dirichlet_gp": ExplainerEntry("Dirichlet exact GP", DirichletGP, reads="embeddings")}
