"""Heads of a neural network on the embeddings, with deep learning's measures of uncertainty (paper, Table V).

The encoder is fixed; a head with one hidden layer is trained on the labeled embeddings. Draws of the logits give
scores, variances and BALD like GP-CA's: members of a deep ensemble (Lakshminarayanan et al. 2017), passes of
Monte-Carlo dropout (Gal & Ghahramani 2016), or Laplace's approximation over the last layer (Daxberger et al. 2021).
"""

import math
from functools import partial
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from gpca.attribution.diagnostics import negative_log_likelihood
from gpca.classifier.scores import summarize_draws
from gpca.explainers.classifiers import known_concepts
from gpca.explainers.interface import DrawingExplainer, ExplainerEntry, attached
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator, seed_of
from gpca.settings import ArgumentsOf, Bounds, Count

BATCH_SIZE = 64
DropoutRate = Annotated[float, Bounds(minimum=0, exclusiveMaximum=1)]


class Heads:
    """E heads d -> hidden -> C with ReLU, trained side by side from different starts and on different batches.

    AdamW minimizes the cross-entropy of random batches, with a cosine schedule and dropout before the last layer. The
    axes name the random numbers.
    """

    def __init__(
        self,
        *axes: object,
        heads: int = 1,
        rate: DropoutRate = 0.0,
        hidden: int = 128,
        steps: int = 300,
        learning_rate: float = 2e-3,
        weight_decay: float = 1e-2,
    ) -> None:
        self._axes, self._heads, self._rate, self._hidden = axes, heads, rate, hidden
        self._steps, self._learning_rate, self._weight_decay = steps, learning_rate, weight_decay

    def fit(self, h_N_d: np.ndarray, target_N: np.ndarray) -> None:
        """Train on standardized embeddings and the indices of their concepts."""
        import torch
        from sklearn.preprocessing import StandardScaler

        from gpca.portable import Adam

        self._scaler = StandardScaler().fit(h_N_d)
        inputs_N_d, targets_N = self._inputs(h_N_d), torch.from_numpy(target_N)
        random = torch.Generator().manual_seed(seed_of(*self._axes))
        self._layers = []
        for width, outputs in pairwise((h_N_d.shape[1], self._hidden, len(CONCEPTS))):
            weight = torch.randn((self._heads, width, outputs), generator=random) * (2 / width) ** 0.5
            self._layers += [weight.requires_grad_(), torch.zeros((self._heads, 1, outputs), requires_grad=True)]
        optimizer = Adam(self._layers, self._learning_rate, self._weight_decay)
        for step in range(self._steps):
            rows_E_B = torch.rand((self._heads, len(targets_N)), generator=random).argsort(dim=1)[:, :BATCH_SIZE]
            hidden_E_B_H = self._hidden_units(inputs_N_d[rows_E_B])
            if self._rate:
                kept = torch.rand(hidden_E_B_H.shape, generator=random) >= self._rate
                hidden_E_B_H = hidden_E_B_H * kept / (1 - self._rate)
            logits_E_B_C = self._last_layer(hidden_E_B_H)
            loss = torch.nn.functional.cross_entropy(logits_E_B_C.flatten(0, 1), targets_N[rows_E_B].flatten())
            optimizer.zero_grad()
            # Scaled so that a head's gradient is that of its loss, however many are trained beside it.
            (loss * self._heads).backward()
            optimizer.step()
            falls = [1 + math.cos(math.pi * passed / self._steps) for passed in (step, step + 1)]
            optimizer.learning_rate *= falls[1] / falls[0]

    def hidden(self, h_N_d: np.ndarray) -> np.ndarray:
        """Return the hidden units (E, N, H) of the embeddings."""
        return self._hidden_units(self._inputs(h_N_d)).detach().numpy()

    def logits(self, hidden_E_N_H: np.ndarray) -> np.ndarray:
        """Return the last layer's logits (E, N, C)."""
        import torch

        return self._last_layer(torch.from_numpy(hidden_E_N_H)).detach().numpy()

    def _inputs(self, h_N_d: np.ndarray):
        import torch

        return torch.from_numpy(self._scaler.transform(h_N_d).astype(np.float32))

    def _hidden_units(self, inputs):
        weight, bias = self._layers[:2]
        return (inputs @ weight + bias).relu()

    def _last_layer(self, hidden):
        weight, bias = self._layers[2:]
        return hidden @ weight + bias


HeadArguments = Annotated[Any, ArgumentsOf(Heads)]  # keyword arguments passed on to it


class HeadLearner(DrawingExplainer):
    """Base of learners that draw logits from heads; `training` holds the settings of the heads."""

    def __init__(self, source: str, seed: int, **training: HeadArguments) -> None:
        self._axes = (source, seed, type(self).__name__)
        self._heads = Heads(*self._axes, **training)

    def fit(self, registrations: Registrations) -> None:
        known_concepts(registrations.concept)
        target_N = np.array([CONCEPTS.index(concept) for concept in registrations.concept])
        self._train(attached(registrations, "embedding"), target_N)

    def summary(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return summarize_draws(self._draw_logits(attached(registrations, "embedding")))

    def _train(self, h_N_d: np.ndarray, target_N: np.ndarray) -> None:
        self._heads.fit(h_N_d, target_N)

    def _draw_logits(self, h_N_d: np.ndarray) -> np.ndarray:
        raise NotImplementedError


class Ensemble(HeadLearner):
    """A deep ensemble of heads: each is a draw."""

    def __init__(self, source: str, seed: int, members: Count = 5, **training: HeadArguments) -> None:
        super().__init__(source, seed, heads=members, **training)

    def _draw_logits(self, h_N_d: np.ndarray) -> np.ndarray:
        return self._heads.logits(self._heads.hidden(h_N_d))


class Dropout(HeadLearner):
    """Monte-Carlo dropout: every pass is a draw, its mask shared by all samples, like one network."""

    def __init__(
        self, source: str, seed: int, rate: DropoutRate = 0.5, passes: Count = 100, **training: HeadArguments
    ) -> None:
        super().__init__(source, seed, rate=rate, **training)
        self._rate, self._passes = rate, passes

    def _draw_logits(self, h_N_d: np.ndarray) -> np.ndarray:
        hidden_1_N_H = self._heads.hidden(h_N_d)
        kept_M_1_H = generator(*self._axes, "passes").random((self._passes, 1, hidden_1_N_H.shape[2])) >= self._rate
        return self._heads.logits((hidden_1_N_H * kept_M_1_H / (1 - self._rate)).astype(np.float32))


class LastLayerLaplace(HeadLearner):
    """Laplace's approximation over the last layer, with the full generalized Gauss-Newton matrix.

    The last layer is refitted to the hidden units under a Gaussian prior, because the approximation needs a maximum of
    the posterior. The prior's precision is the one with the least NLL on a fifth of the training samples after training
    on the others. The evidence would choose far too timid scores, as the hidden units learned from the same labels.
    """

    PRECISIONS = tuple(10.0 ** (exponent / 2) for exponent in range(6, -5, -1))

    def __init__(self, source: str, seed: int, draws: Count = 1000, **training: HeadArguments) -> None:
        super().__init__(source, seed, **training)
        self._draws = draws

    def _train(self, h_N_d: np.ndarray, target_N: np.ndarray) -> None:
        order_N = generator(*self._axes, "validation").permutation(len(target_N))
        validation, rest = order_N[::5], np.delete(order_N, np.s_[::5])
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
        """Find the weights (F, C) that minimize cross-entropy + precision / 2 · |weights|², and the curvature there."""
        from scipy.optimize import minimize
        from scipy.special import log_softmax

        features_N_F, wanted_N_C = self._features(h_N_d), np.eye(len(CONCEPTS))[target_N]
        shape = (features_N_F.shape[1], len(CONCEPTS))

        def loss(flat: np.ndarray) -> tuple[float, np.ndarray]:
            weights_F_C = flat.reshape(shape)
            log_p_N_C = log_softmax(features_N_F @ weights_F_C, axis=1)
            gradient_F_C = features_N_F.T @ (np.exp(log_p_N_C) - wanted_N_C) + precision * weights_F_C
            return -np.sum(wanted_N_C * log_p_N_C) + 0.5 * precision * flat @ flat, gradient_F_C.ravel()

        optimum = minimize(loss, np.zeros(shape).ravel(), jac=True, method="L-BFGS-B")
        self._weights_F_C = optimum.x.reshape(shape)
        p_N_C = np.exp(log_softmax(features_N_F @ self._weights_F_C, axis=1))
        blocks = []  # of the curvature (C·F, C·F), classes first
        for p_N, one_hot_C in zip(p_N_C.T, np.eye(len(CONCEPTS)), strict=True):
            curvature_N_C = p_N[:, None] * (one_hot_C - p_N_C)
            blocks.append([(features_N_F * curvature_N[:, None]).T @ features_N_F for curvature_N in curvature_N_C.T])
        eigenvalues, self._vectors = np.linalg.eigh(np.block(blocks))
        self._deviations = 1 / np.sqrt(np.maximum(eigenvalues, 0) + precision)

    def _draw_logits(self, h_N_d: np.ndarray) -> np.ndarray:
        features_N_F, n_classes = self._features(h_N_d), len(CONCEPTS)
        # The weights have the covariance W Wᵀ with W (C·F, K), a sample's logits R Rᵀ with R (C, K).
        roots_C_F_K = (self._vectors * self._deviations).reshape(n_classes, features_N_F.shape[1], -1)
        roots_C_N_K = features_N_F @ roots_C_F_K
        covariance_N_C_C = np.einsum("cnk,dnk->ncd", roots_C_N_K, roots_C_N_K)
        cholesky_N_C_C = np.linalg.cholesky(covariance_N_C_C + 1e-9 * np.eye(n_classes))
        normal_M_C = generator(*self._axes, "draws").normal(size=(self._draws, n_classes))
        return features_N_F @ self._weights_F_C + np.einsum("ncd,md->mnc", cholesky_N_C_C, normal_M_C)

    def _features(self, h_N_d: np.ndarray) -> np.ndarray:
        hidden_N_H = self._heads.hidden(h_N_d)[0].astype(float)
        return np.column_stack([hidden_N_H, np.ones(len(hidden_N_H))])


_entry = partial(ExplainerEntry, sees=("source",), reads="embeddings")
EXPLAINERS = {
    "learner_ensemble": _entry("Deep ensemble of heads", Ensemble),
    "learner_dropout": _entry("MC dropout of the head", Dropout),
    "learner_laplace_head": _entry("Last-layer Laplace of the head", LastLayerLaplace),
}
