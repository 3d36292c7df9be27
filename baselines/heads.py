"""Heads of a neural network on the embeddings, with what deep learning offers for uncertainty (paper, Table V).

The encoder stays as it is; a head of one hidden layer is trained on it with the labeled embeddings. From each
follow draws of the logits, and from those scores, variances and BALD as GP-CA's: the members of a deep ensemble
(Lakshminarayanan et al. 2017), the passes of Monte-Carlo dropout (Gal & Ghahramani 2016).
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any

import numpy as np

from gpca.attribution.scores import summarize_draws
from gpca.explainers.concept_classifier import known_concepts
from gpca.explainers.interface import DrawingExplainer, ExplainerEntry, attached
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator, seed_of
from gpca.settings import ArgumentsOf, Bounds, Count

BATCH_SIZE = 64
DropoutRate = Annotated[float, Bounds(minimum=0, exclusiveMaximum=1)]


class Heads:
    """E heads d -> hidden -> C, ReLU between, trained side by side from starts and on batches of their own.

    Args:
        axes: name the random numbers.
        heads: E.
        rate: that of the dropout before the last layer.
        hidden: units.
        steps, learning_rate, weight_decay: how AdamW lowers the cross-entropy of random batches; the rate falls as a
            cosine.
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
        self._axes = axes
        self._heads = heads
        self._rate = rate
        self._hidden = hidden
        self._steps = steps
        self._learning_rate = learning_rate
        self._weight_decay = weight_decay

    def fit(self, h_N_d: np.ndarray, target_N: np.ndarray) -> None:
        """Train on standardized embeddings and the numbers of their concepts."""
        import torch
        from sklearn.preprocessing import StandardScaler

        self._scaler = StandardScaler().fit(h_N_d)
        inputs_N_d = self._inputs(h_N_d)
        targets_N = torch.from_numpy(target_N)
        random = torch.Generator().manual_seed(seed_of(*self._axes))
        widths = (h_N_d.shape[1], self._hidden, len(CONCEPTS))
        self._layers = []
        for width, outputs in pairwise(widths):
            weight = torch.randn((self._heads, width, outputs), generator=random) * (2 / width) ** 0.5
            self._layers += [weight.requires_grad_(), torch.zeros((self._heads, 1, outputs), requires_grad=True)]
        # Fused, since the plain form takes torch.sqrt, whose last bit depends on the processor's vendor.
        optimizer = torch.optim.AdamW(self._layers, self._learning_rate, weight_decay=self._weight_decay, fused=True)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, self._steps)
        for _ in range(self._steps):
            rows_E_B = torch.rand((self._heads, len(targets_N)), generator=random).argsort(dim=1)[:, :BATCH_SIZE]
            hidden_E_B_H = self._hidden_units(inputs_N_d[rows_E_B])
            if self._rate:
                kept = torch.rand(hidden_E_B_H.shape, generator=random) >= self._rate
                hidden_E_B_H = hidden_E_B_H * kept / (1 - self._rate)
            logits_E_B_C = self._last_layer(hidden_E_B_H)
            loss = torch.nn.functional.cross_entropy(logits_E_B_C.flatten(0, 1), targets_N[rows_E_B].flatten())
            optimizer.zero_grad()
            # A head's gradient is that of its own loss, however many are trained beside it.
            (loss * self._heads).backward()
            optimizer.step()
            schedule.step()

    def hidden(self, h_N_d: np.ndarray) -> np.ndarray:
        """Return the hidden units (E, N, H) of the embeddings."""
        import torch

        with torch.no_grad():
            return self._hidden_units(self._inputs(h_N_d)).numpy()

    def logits(self, hidden_E_N_H: np.ndarray) -> np.ndarray:
        """Return the last layer's logits (E, N, C)."""
        import torch

        with torch.no_grad():
            return self._last_layer(torch.from_numpy(hidden_E_N_H)).numpy()

    def _inputs(self, h_N_d: np.ndarray):
        import torch

        return torch.from_numpy(self._scaler.transform(h_N_d).astype(np.float32))

    def _hidden_units(self, inputs):
        weight, bias = self._layers[:2]
        return (inputs @ weight + bias).relu()

    def _last_layer(self, hidden):
        weight, bias = self._layers[2:]
        return hidden @ weight + bias


HeadArguments = Annotated[Any, ArgumentsOf(Heads)]  # of a function that hands them on


class HeadLearner(DrawingExplainer):
    """The base of learners with heads, from which logits are drawn; `training` holds the settings of the heads."""

    def __init__(self, source: str, seed: int, **training: HeadArguments) -> None:
        self._axes = (source, seed, type(self).__name__)
        self._heads = Heads(*self._axes, **training)

    def fit(self, registrations: Registrations) -> None:
        """Train on the labeled embeddings; fewer than two concepts among the labels raise an InputError."""
        known_concepts(registrations.concept)
        h_N_d = attached(registrations, "embedding")
        target_N = np.array([CONCEPTS.index(concept) for concept in registrations.concept])
        self._train(h_N_d, target_N)

    def summary(self, registrations: Registrations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Summarize draws of the logits of every registration, as GP-CA does."""
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
    """Monte-Carlo dropout: every pass is a draw, its mask shared by all samples, as one network is."""

    def __init__(
        self, source: str, seed: int, rate: DropoutRate = 0.5, passes: Count = 100, **training: HeadArguments
    ) -> None:
        super().__init__(source, seed, rate=rate, **training)
        self._rate = rate
        self._passes = passes

    def _draw_logits(self, h_N_d: np.ndarray) -> np.ndarray:
        hidden_1_N_H = self._heads.hidden(h_N_d)
        kept_M_1_H = generator(*self._axes, "passes").random((self._passes, 1, hidden_1_N_H.shape[2])) >= self._rate
        return self._heads.logits((hidden_1_N_H * kept_M_1_H / (1 - self._rate)).astype(np.float32))


EXPLAINERS = {
    "learner_ensemble": ExplainerEntry("Deep ensemble of heads", Ensemble, ("source",), reads="embeddings"),
    "learner_dropout": ExplainerEntry("MC dropout of the head", Dropout, ("source",), reads="embeddings"),
}
