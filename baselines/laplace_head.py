"""Laplace's approximation over the last layer of a head on the embeddings (Daxberger et al. 2021; paper, Table V)."""

from __future__ import annotations

import numpy as np

from baselines.heads import HeadArguments, HeadLearner
from gpca.attribution.diagnostics import negative_log_likelihood
from gpca.attribution.scores import summarize_draws
from gpca.explainers.interface import ExplainerEntry
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator
from gpca.settings import Count


class LastLayerLaplace(HeadLearner):
    """Laplace's approximation over the last layer, with the full generalized Gauss-Newton matrix.

    The last layer is fitted anew to the hidden units under a Gaussian prior: an approximation about weights that are no
    maximum of the posterior would not be Laplace's. The prior's precision is the one that predicts a fifth of the
    training samples best (least NLL) after training on the others; that of the largest evidence, as the hidden units
    were learned from the same labels, leaves the scores far too timid.
    """

    PRECISIONS = tuple(10.0 ** (exponent / 2) for exponent in range(6, -5, -1))

    def __init__(self, source: str, seed: int, draws: Count = 1000, **training: HeadArguments) -> None:
        super().__init__(source, seed, **training)
        self._draws = draws

    def _train(self, h_N_d: np.ndarray, target_N: np.ndarray) -> None:
        order_N = generator(*self._axes, "validation").permutation(len(target_N))
        validation = order_N[::5]
        rest = np.delete(order_N, np.s_[::5])
        precision = self.PRECISIONS[0]
        if len(rest):
            super()._train(h_N_d[rest], target_N[rest])
            losses = []
            for candidate in self.PRECISIONS:
                self._approximate(h_N_d[rest], target_N[rest], candidate)
                scores_N_C, _, _ = summarize_draws(self._draw_logits(h_N_d[validation]))
                losses.append(negative_log_likelihood(scores_N_C, target_N[validation]))
            precision = self.PRECISIONS[int(np.argmin(losses))]
        super()._train(h_N_d, target_N)
        self._approximate(h_N_d, target_N, precision)

    def _approximate(self, h_N_d: np.ndarray, target_N: np.ndarray, precision: float) -> None:
        features_N_F = self._features(h_N_d)
        wanted_N_C = np.eye(len(CONCEPTS))[target_N]
        self._weights_F_C = _regularized_weights(features_N_F, wanted_N_C, precision)
        p_N_C = np.exp(_log_softmax(features_N_F @ self._weights_F_C))
        eigenvalues, self._vectors = np.linalg.eigh(_gauss_newton(features_N_F, p_N_C))
        self._deviations = 1 / np.sqrt(np.maximum(eigenvalues, 0) + precision)

    def _draw_logits(self, h_N_d: np.ndarray) -> np.ndarray:
        features_N_F = self._features(h_N_d)
        n_classes = len(CONCEPTS)
        # W (C·F, K) with covariance W Wᵀ of the weights; that of a sample's logits is then R Rᵀ with R (C, K).
        roots_C_F_K = (self._vectors * self._deviations).reshape(n_classes, features_N_F.shape[1], -1)
        roots_C_N_K = features_N_F @ roots_C_F_K
        covariance_N_C_C = np.einsum("cnk,dnk->ncd", roots_C_N_K, roots_C_N_K)
        cholesky_N_C_C = np.linalg.cholesky(covariance_N_C_C + 1e-9 * np.eye(n_classes))
        normal_M_C = generator(*self._axes, "draws").normal(size=(self._draws, n_classes))
        return features_N_F @ self._weights_F_C + np.einsum("ncd,md->mnc", cholesky_N_C_C, normal_M_C)

    def _features(self, h_N_d: np.ndarray) -> np.ndarray:
        hidden_N_H = self._heads.hidden(h_N_d)[0].astype(float)
        return np.column_stack([hidden_N_H, np.ones(len(hidden_N_H))])


def _regularized_weights(features_N_F: np.ndarray, wanted_N_C: np.ndarray, precision: float) -> np.ndarray:
    """Return the weights (F, C) that minimize cross-entropy + precision / 2 · |weights|²."""
    from scipy.optimize import minimize

    shape = (features_N_F.shape[1], wanted_N_C.shape[1])

    def loss(flat):
        weights_F_C = flat.reshape(shape)
        log_p_N_C = _log_softmax(features_N_F @ weights_F_C)
        gradient_F_C = features_N_F.T @ (np.exp(log_p_N_C) - wanted_N_C) + precision * weights_F_C
        return -np.sum(wanted_N_C * log_p_N_C) + 0.5 * precision * flat @ flat, gradient_F_C.ravel()

    return minimize(loss, np.zeros(shape).ravel(), jac=True, method="L-BFGS-B").x.reshape(shape)


def _gauss_newton(features_N_F: np.ndarray, p_N_C: np.ndarray) -> np.ndarray:
    """Return the curvature (C·F, C·F) of the cross-entropy in the weights, classes first."""
    rows = []
    for c, p_N in enumerate(p_N_C.T):
        curvature_N_C = p_N[:, None] * (np.eye(p_N_C.shape[1])[c] - p_N_C)
        rows.append([(features_N_F * curvature_N[:, None]).T @ features_N_F for curvature_N in curvature_N_C.T])
    return np.block(rows)


def _log_softmax(logits_N_C: np.ndarray) -> np.ndarray:
    from scipy.special import log_softmax

    return log_softmax(logits_N_C, axis=1)


EXPLAINERS = {
    "learner_laplace_head": ExplainerEntry(
        "Last-layer Laplace of the head", LastLayerLaplace, ("source",), reads="embeddings"
    ),
}
