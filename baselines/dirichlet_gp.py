"""Dirichlet-based exact GP classification on the embeddings (Milios et al. 2018; paper, Table V): a GP on all samples.

A label becomes a Dirichlet distribution with α = α_ε + 1{y = c}, approximated by log-normals: regression targets with
known noise. One exact GP per concept is fitted by its marginal likelihood; probabilities are the softmax of its draws.
"""

import numpy as np

from gpca.classifier.scores import summarize_marginals
from gpca.explainers.classifiers import known_concepts
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer, attached
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator

JITTER = 1e-6


class DirichletGP(ScoringExplainer):
    """Exact GPs with RBF kernels, one scale and lengthscale per concept; a small `alpha` α_ε is confident."""

    def __init__(
        self,
        source: str,
        seed: int,
        alpha: float = 0.01,
        iterations: int = 40,
        learning_rate: float = 0.1,
        draws: int = 1000,
    ) -> None:
        self._axes, self._alpha, self._draws = (source, seed, "dirichlet"), alpha, draws
        self._iterations, self._learning_rate = iterations, learning_rate

    def fit(self, registrations: Registrations) -> None:
        import torch
        from sklearn.preprocessing import StandardScaler

        from gpca.portable import Adam

        known_concepts(registrations.concept)
        h_N_d = attached(registrations, "embedding")
        self._scaler = StandardScaler().fit(h_N_d)
        self._inputs_N_d = self._scaler.transform(h_N_d)
        squared_N_N = _squared_distances(self._inputs_N_d, self._inputs_N_d)
        alpha_C_N = self._alpha + (np.array(CONCEPTS)[:, None] == registrations.concept)
        noise_C_N = np.log(1 / alpha_C_N + 1)
        values_C_N = np.log(alpha_C_N) - noise_C_N / 2
        median = float(torch.from_numpy(squared_N_N).median()) ** 0.5
        self._log_lengthscale_C = torch.full((len(CONCEPTS),), np.log(median if median > 0 else 1.0)).double()
        self._log_scale_C = torch.from_numpy(np.log(values_C_N.var(axis=1, ddof=1)))
        self._mean_C = torch.from_numpy(values_C_N.mean(axis=1))
        parameters = [self._log_lengthscale_C, self._log_scale_C, self._mean_C]
        optimizer = Adam(parameters, self._learning_rate)
        data = [(c, squared_N_N, values_C_N[c], noise_C_N[c]) for c in range(len(CONCEPTS))]
        for _ in range(self._iterations):
            gradient_C_3 = np.array([self._gradient(*concept) for concept in data]) / len(h_N_d)
            for parameter, gradient_C in zip(parameters, gradient_C_3.T, strict=True):
                parameter.grad = torch.from_numpy(gradient_C.copy())
            optimizer.step()
        self._factors = [self._factor(*concept)[1:] for concept in data]

    def summary(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        normal_M_C = generator(*self._axes, "draws").normal(size=(self._draws, len(CONCEPTS)))
        return summarize_marginals(*self._posterior(registrations), normal_M_C)

    def _gradient(self, c: int, squared_N_N: np.ndarray, values_N: np.ndarray, noise_N: np.ndarray) -> np.ndarray:
        """Return the gradient of the negative log marginal likelihood in log lengthscale, log scale and mean.

        For a parameter of the covariance, Σ (K⁻¹ - ααᵀ) ∂K / 2 with α = K⁻¹ (y - m) (Rasmussen & Williams 2006,
        Eq. 5.9): a third of the cost of backpropagation through the Cholesky factor.
        """
        from scipy.linalg import solve_triangular
        from scipy.linalg.lapack import dpotri

        K_N_N, cholesky_N_N, whitened_N = self._factor(c, squared_N_N, values_N, noise_N)
        alpha_N = solve_triangular(cholesky_N_N, whitened_N, lower=True, trans="T")
        lower_N_N = np.tril(dpotri(cholesky_N_N, lower=True)[0])
        inverse_N_N = lower_N_N + np.tril(lower_N_N, -1).T
        slope_N_N = 0.5 * (inverse_N_N - np.outer(alpha_N, alpha_N)) * K_N_N
        by_lengthscale = (slope_N_N * squared_N_N).sum() * np.exp(-2 * self._log_lengthscale_C[c].item())
        return np.array([by_lengthscale, slope_N_N.sum(), -alpha_N.sum()])

    def _factor(
        self, c: int, squared_N_N: np.ndarray, values_N: np.ndarray, noise_N: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the covariance, the Cholesky factor L of the noisy one, and L⁻¹ of the centered targets."""
        from scipy.linalg import cholesky, solve_triangular

        K_N_N = self._covariance(c, squared_N_N)
        cholesky_N_N = cholesky(K_N_N + np.diag(noise_N + JITTER), lower=True)
        return K_N_N, cholesky_N_N, solve_triangular(cholesky_N_N, values_N - self._mean_C[c].item(), lower=True)

    def _covariance(self, c: int, squared_A_B: np.ndarray) -> np.ndarray:
        inverse_square = np.exp(-2 * self._log_lengthscale_C[c].item())
        return np.exp(self._log_scale_C[c].item()) * np.exp(squared_A_B * (-0.5 * inverse_square))

    def _posterior(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation (N, C) of the latents."""
        from scipy.linalg import solve_triangular

        inputs_N_d = self._scaler.transform(attached(registrations, "embedding"))
        squared_T_N = _squared_distances(self._inputs_N_d, inputs_N_d)
        means, deviations = [], []
        for c, (cholesky_T_T, whitened_T) in enumerate(self._factors):
            weights_T_N = solve_triangular(cholesky_T_T, self._covariance(c, squared_T_N), lower=True)
            variance_N = np.exp(self._log_scale_C[c].item()) - np.square(weights_T_N).sum(axis=0)
            means.append(self._mean_C[c].item() + (weights_T_N * whitened_T[:, None]).sum(axis=0))
            deviations.append(np.sqrt(np.maximum(variance_N, 0)))
        return np.column_stack(means), np.column_stack(deviations)


def _squared_distances(a_A_d: np.ndarray, b_B_d: np.ndarray) -> np.ndarray:
    import torch

    from gpca.classifier.sparse_gp import squared_distances

    return squared_distances(torch.from_numpy(a_A_d), torch.from_numpy(b_B_d)).numpy()


_entry = ExplainerEntry("Dirichlet exact GP", DirichletGP, ("source",), reads="embeddings")
EXPLAINERS = {"learner_dirichlet_gp": _entry}
