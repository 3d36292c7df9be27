"""Heads of a neural network on the embeddings, with deep learning's measures of uncertainty (paper, Table V)."""

import math
from functools import partial
from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from gpca.classifier.scores import summarize_draws
from gpca.explainers.classifiers import known_concepts
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer, attached
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator, seed_of
from gpca.settings import ArgumentsOf, Bounds, Count

BATCH_SIZE = 64
Rate = Annotated[float, Bounds(minimum=0, exclusiveMaximum=1)]


class Heads:
    """E heads d -> hidden -> C with ReLU, trained side by side from different starts and on different batches."""

    def __init__(
        self,
        *axes: object,
        heads: int = 1,
        rate: Rate = 0.0,
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
            hidden_E_B_H = self._layer(0, inputs_N_d[rows_E_B]).relu()
            if self._rate:
                kept = torch.rand(hidden_E_B_H.shape, generator=random) >= self._rate
                hidden_E_B_H = hidden_E_B_H * kept / (1 - self._rate)
            logits_E_B_C = self._layer(1, hidden_E_B_H)
            loss = torch.nn.functional.cross_entropy(logits_E_B_C.flatten(0, 1), targets_N[rows_E_B].flatten())
            optimizer.zero_grad()
            # Scaled so that a head's gradient is that of its loss, however many are trained beside it.
            (loss * self._heads).backward()
            optimizer.step()
            falls = [1 + math.cos(math.pi * passed / self._steps) for passed in (step, step + 1)]
            optimizer.learning_rate *= falls[1] / falls[0]

    def hidden(self, h_N_d: np.ndarray) -> np.ndarray:
        """Return the hidden units (E, N, H) of the embeddings."""
        return self._layer(0, self._inputs(h_N_d)).relu().detach().numpy()

    def logits(self, hidden_E_N_H: np.ndarray) -> np.ndarray:
        """Return the last layer's logits (E, N, C)."""
        import torch

        return self._layer(1, torch.from_numpy(hidden_E_N_H)).detach().numpy()

    def _inputs(self, h_N_d: np.ndarray):
        import torch

        return torch.from_numpy(self._scaler.transform(h_N_d).astype(np.float32))

    def _layer(self, number: int, inputs):
        weight, bias = self._layers[2 * number : 2 * number + 2]
        return inputs @ weight + bias


HeadSettings = Annotated[Any, ArgumentsOf(Heads)]  # keyword arguments passed on to it


class HeadLearner(ScoringExplainer):
    """Base of learners that draw logits from heads; `training` holds the settings of the heads."""

    def __init__(self, source: str, seed: int, **training: HeadSettings) -> None:
        self._axes = (source, seed, type(self).__name__)
        self._heads = Heads(*self._axes, **training)

    def fit(self, registrations: Registrations) -> None:
        known_concepts(registrations.concept)
        target_N = np.array([CONCEPTS.index(concept) for concept in registrations.concept])
        self._heads.fit(attached(registrations, "embedding"), target_N)

    def summary(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return summarize_draws(self._draw_logits(attached(registrations, "embedding")))

    def _draw_logits(self, h_N_d: np.ndarray) -> np.ndarray:
        raise NotImplementedError


class Ensemble(HeadLearner):
    """A deep ensemble of heads (Lakshminarayanan et al. 2017): each is a draw."""

    def __init__(self, source: str, seed: int, members: Count = 5, **training: HeadSettings) -> None:
        super().__init__(source, seed, heads=members, **training)

    def _draw_logits(self, h_N_d: np.ndarray) -> np.ndarray:
        return self._heads.logits(self._heads.hidden(h_N_d))


class Dropout(HeadLearner):
    """Monte-Carlo dropout (Gal & Ghahramani 2016): every pass is a draw, its mask shared by all samples."""

    def __init__(self, source: str, seed: int, rate: Rate = 0.5, passes: Count = 100, **training: HeadSettings) -> None:
        super().__init__(source, seed, rate=rate, **training)
        self._rate, self._passes = rate, passes

    def _draw_logits(self, h_N_d: np.ndarray) -> np.ndarray:
        hidden_1_N_H = self._heads.hidden(h_N_d)
        kept_M_1_H = generator(*self._axes, "passes").random((self._passes, 1, hidden_1_N_H.shape[2])) >= self._rate
        return self._heads.logits((hidden_1_N_H * kept_M_1_H / (1 - self._rate)).astype(np.float32))


_entry = partial(ExplainerEntry, sees=("source",), reads="embeddings")
EXPLAINERS = {
    "learner_ensemble": _entry("Deep ensemble of heads", Ensemble),
    "learner_dropout": _entry("MC dropout of the head", Dropout),
}
