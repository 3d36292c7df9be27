"""The Gaussian process classifier under other starts: scale of the inputs, inducing inputs, lengthscale, minibatches.

:class:`gpca.classifier.gpc.GPC` is one of these readings; the others change its start and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.classifier.sparse_gp import SparseGPs, Standardization, Start, make_covariance
from gpca.experiments.specification_curve.diagnostics import accuracies, table5
from gpca.experiments.specification_curve.run_files import Row, RunFiles
from gpca.experiments.specification_curve.settings import Reading, ReadingSizes
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.seeds import seed_of

BATCH = 64  # samples of a minibatch
DEFAULT_LENGTHSCALE = math.log(2)  # gpytorch's
# Kernel, rate and iterations of the rows of Table IV whose numbers are missed, and of those that other tables show.
FITTED = (("rbf", 0.001, 200), ("polynomial", 0.001, 200), ("rbf", 0.01, 100), ("matern32", 0.01, 200))
SHOWN_AS = {("rbf", 0.01, 100): "gpca_paper", ("matern32", 0.01, 200): "gpca_matern"}  # in Tables I and II, and in V


@dataclass(frozen=True)
class UnitNorm(Standardization):
    """Inputs of length 1, each scaled by itself."""

    def __call__(self, h_N_d: np.ndarray) -> np.ndarray:
        """Return the scaled inputs; one of length 0 stays as it is."""
        return of_unit_norm(h_N_d)


class StartedGPC(GPC):
    """The classifier from another start.

    Args:
        settings: as those of :class:`gpca.classifier.gpc.GPC`.
        reading: ``inputs``, ``inducing``, ``lengthscale`` and ``batch`` of the start; other choices are ignored.
        axes: names of the seed.
    """

    def __init__(self, settings: GPCSettings, reading: Reading, *axes: object) -> None:
        super().__init__(CONCEPTS, settings, *axes)
        self._reading = reading

    def scaling(self, around_R_d: np.ndarray) -> Standardization:
        """Return the scale of the inputs."""
        if self._reading["inputs"] == "standardised":
            return super().scaling(around_R_d)
        unscaled = np.zeros(around_R_d.shape[1]), np.ones(around_R_d.shape[1])
        return (UnitNorm if self._reading["inputs"] == "unit_norm" else Standardization)(*unscaled)

    def start(self, inputs_R_d: torch.Tensor) -> Start:
        """Return inducing inputs at k-means centers or drawn, and the lengthscale."""
        start = super().start(inputs_R_d)
        covariance, inducing_M_d = start.covariance, start.inducing_M_d
        if self._reading["inducing"] == "random":
            random = torch.Generator().manual_seed(seed_of(*self._axes, "random inducing inputs"))
            inducing_M_d = torch.randn((self.settings.inducing, inputs_R_d.shape[1]), generator=random)
        if self._reading["lengthscale"] == "default":
            covariance = make_covariance(self.settings.kernel, len(self.classes), DEFAULT_LENGTHSCALE)
        return Start(covariance, inducing_M_d, start.seed)

    def objective(
        self, model: SparseGPs, inputs_N_d: torch.Tensor, targets_N: torch.Tensor, random: torch.Generator
    ) -> torch.Tensor:
        """Return the ELBO of all samples, or its estimate from a minibatch."""
        if self._reading["batch"] == "full":
            return super().objective(model, inputs_N_d, targets_N, random)
        rows = torch.randperm(len(targets_N), generator=random)[:BATCH]
        # The divergence counts once for all samples, not once for each minibatch.
        too_much = model.divergence() * (1 / len(rows) - 1 / len(targets_N))
        return model.elbo(inputs_N_d[rows], targets_N[rows]) + too_much


def of_unit_norm(h_N_d: np.ndarray) -> np.ndarray:
    """Return embeddings (N, d) of length 1; one of length 0 stays as it is."""
    length_N_1 = np.linalg.norm(h_N_d, axis=1, keepdims=True)
    return h_N_d / np.where(length_N_1 > 0, length_N_1, 1)


def run(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield accuracies under each reading, and Table V's numbers of those of `SHOWN_AS`."""
    for source, seed, sets, registrations in run_files.in_distribution():
        train, test = (registrations.subset(registrations.rows(split)) for split in ("train", "test"))
        distance_S = sets.distance[sets.rows("in_distribution", "test"), 0]
        fitted: dict[tuple, np.ndarray] = {}
        for reading in progress(readings, f"starts of the GPC on {source}, seed {seed}"):
            for kernel, rate, iterations in FITTED:
                key = (kernel, rate, iterations, *relevant(reading, kernel).values())
                if key not in fitted:
                    schedule = {"kernel": kernel, "learning_rate": rate, "iterations": iterations}
                    settings = GPCSettings(**run_files.section("gpca_paper") | schedule)
                    gpc = StartedGPC(settings, reading, source, seed).fit(train.embedding, train.concept)
                    fitted[key] = gpc.attribute(test.embedding)[0]
                for (metric, concept), value in accuracies(test.concept, fitted[key]).items():
                    yield reading, source, f"{kernel}-{rate:g}-{iterations}", metric, concept, seed, value
                if (method := SHOWN_AS.get((kernel, rate, iterations))) is None:
                    continue
                for (metric, concept), value in table5(test.concept, fitted[key], distance_S).items():
                    yield reading, source, method, metric, concept, seed, value


def relevant(reading: Reading, kernel: str) -> Reading:
    """Return the choices that matter to a kernel: a polynomial one has no lengthscale."""
    return {name: value for name, value in reading.items() if kernel != "polynomial" or name != "lengthscale"}
