"""Gaussian process classification by sparse variational inference (paper Sec. III-B; Hensman et al. 2015)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from gpca.classifier.latents import Latents, Projection, Sites, elbo, refine
from gpca.classifier.prior import Covariance, Prior, Standardization
from gpca.classifier.scores import summarize_marginals
from gpca.classifier.settings import GPCSettings
from gpca.process.progress import progress
from gpca.seeds import generator, seed_of

if TYPE_CHECKING:
    import torch

    from gpca.classifier.sparse_gp import SparseGPs


class GPC:
    """Gaussian process classifier over embeddings; classes may lack labels. The axes name its random numbers."""

    _scaler: Standardization
    _prior: Prior
    _latents: Latents

    def __init__(self, classes: tuple[str, ...], settings: GPCSettings, *axes: object) -> None:
        self.classes, self.settings, self._axes = classes, settings, axes
        self._sites = Sites.silent(0, 0)  # before the first refinement

    def fit(self, h_N_d: np.ndarray, labels_N: np.ndarray, around_R_d: np.ndarray | None = None) -> GPC:
        """Maximize the ELBO; standardization and start are those of `around_R_d`, by default the labeled embeddings."""
        for _ in self.fit_up_to([self.settings.iterations], h_N_d, labels_N, around_R_d):
            pass
        return self

    def fit_up_to(
        self,
        iterations: Iterable[int],
        h_N_d: np.ndarray,
        labels_N: np.ndarray,
        around_R_d: np.ndarray | None = None,
        before: GPC | None = None,
    ) -> Iterator[int]:
        """Yield each number of iterations in rising order, fitted so far, perhaps from the result of another."""
        import torch

        from gpca.classifier.sparse_gp import SparseGPs
        from gpca.portable import Adam

        if before is None:
            around_R_d = h_N_d if around_R_d is None else around_R_d
            self._scaler = self.scaling(around_R_d)
            start = self.start(torch.from_numpy(self._scaler.single(around_R_d)))
        else:
            self._scaler = before._scaler
            start = before._prior
        inputs_N_d = torch.from_numpy(self._scaler.single(h_N_d))
        targets_N = self._targets(labels_N)
        random = torch.Generator().manual_seed(seed_of(*self._axes, "gpc"))
        model = SparseGPs(start, random)
        if before is not None:
            model.set_posterior(before._latents)
        optimizer = Adam(model.parameters(), self.settings.learning_rate)
        stops = sorted(set(iterations))
        for done in progress(range(1, stops[-1] + 1), " ".join(map(str, ("GPC", *self._axes)))):
            optimizer.zero_grad()
            (-self.objective(model, inputs_N_d, torch.from_numpy(targets_N), random)).backward()
            optimizer.step()
            if done in stops:
                self._prior = model.prior()
                self._latents = model.latents()
                self._labeled = self.project(h_N_d)
                self._targets_N = targets_N
                self._sites = Sites.silent(0, 0)
                yield done

    def scaling(self, around_R_d: np.ndarray) -> Standardization:
        """Return the scaling of the inputs; overridden by a reading of the paper."""
        return Standardization.of(around_R_d)

    def start(self, inputs_R_d: torch.Tensor) -> Prior:
        """Return the start of a fit around scaled inputs; overridden by a reading of the paper."""
        from gpca.classifier.sparse_gp import start_of

        return start_of(inputs_R_d, len(self.classes), self.settings, self._axes)

    def objective(
        self, model: SparseGPs, inputs_N_d: torch.Tensor, targets_N: torch.Tensor, _random: torch.Generator
    ) -> torch.Tensor:
        """Return the maximized objective, the ELBO of all samples; overridden by a reading of the paper."""
        return model.elbo(inputs_N_d, targets_N)

    def elbo(self) -> float:
        """Return the evidence lower bound per labeled sample in nats."""
        return elbo(self._labeled, self._targets_N, self._latents) / len(self._targets_N)

    def update(
        self, h_L_d: np.ndarray | Projection, labels_L: np.ndarray, iterations: int = 100, tolerance: float = 1e-3
    ) -> int:
        """Learn further labels at fixed covariance and inducing inputs, as :meth:`refine` does."""
        self._labeled = self._labeled.followed_by(self.project(h_L_d))
        self._targets_N = np.concatenate([self._targets_N, self._targets(labels_L)])
        return self.refine(iterations, tolerance)

    def refine(self, iterations: int = 100, tolerance: float = 1e-3) -> int:
        """Optimize the posterior at fixed covariance and inducing inputs; return the passes over all labels."""
        sites = self._sites.extend(len(self._targets_N), len(self.classes))
        self._sites, self._latents, done = refine(self._labeled, self._targets_N, sites, iterations, tolerance)
        return done

    def level(self) -> None:
        """Give classes without a label the mean covariance of the others, and refit the posterior."""
        self._set_prior(self._prior.level(np.isin(np.arange(len(self.classes)), self._targets_N)))

    def grow(self, name: str) -> None:
        """Add a class whose covariance is the geometric mean of the others', and refit the posterior."""
        self.classes = (*self.classes, name)
        self._set_prior(self._prior.grow())

    def _set_prior(self, prior: Prior) -> None:
        self._prior = prior
        self._labeled = prior.project(self._labeled.inputs_N_d)
        self.refine()

    def project(self, h_N_d: np.ndarray | Projection) -> Projection:
        """Project embeddings on the inducing inputs, once for several uses."""
        return h_N_d if isinstance(h_N_d, Projection) else self._prior.project(self._scaler.single(h_N_d))

    @property
    def learned_N_d(self) -> np.ndarray:
        """The standardized inputs (N, d) of its labels."""
        return self._labeled.inputs_N_d

    def posterior(self, h_N_d: np.ndarray | Projection) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and standard deviation (N, C) of the independent latent logits q(f(h))."""
        return self._latents.marginals(self.project(h_N_d))

    def attribute(self, h_N_d: np.ndarray | Projection) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return scores_N_C, variances_N_C, bald_N from M posterior draws, the same for all points (Eqs. 4, 5, 7)."""
        normal_M_C = generator(*self._axes, "draws").normal(size=(self.settings.draws, len(self.classes)))
        return summarize_marginals(*self.posterior(h_N_d), normal_M_C)

    def state(self) -> dict[str, object]:
        """Return arrays, numbers and names for :meth:`from_state`."""
        covariance = self._prior.covariance
        return {
            "classes": list(self.classes),
            "settings": asdict(self.settings),
            "axes": list(self._axes),
            "scaler_mean": self._scaler.mean_d,
            "scaler_scale": self._scaler.scale_d,
            "kernel": {"scale": covariance.scale_C, "parameter": covariance.parameter_C},
            "inducing": self._prior.inducing_M_d,
            "mean": self._latents.mean_C_M,
            "covariance": self._latents.covariance_C_M_M,
            "labelled": self._labeled.inputs_N_d,
            "targets": self._targets_N,
        }

    @classmethod
    def from_state(cls, state: dict) -> GPC:
        """Return the classifier of a :meth:`state`: it gives the same attributions and can be trained further."""
        gpc = cls(tuple(state["classes"]), GPCSettings(**state["settings"]), *state["axes"])
        gpc._scaler = Standardization(state["scaler_mean"], state["scaler_scale"])
        kernel = state["kernel"]
        gpc._prior = Prior(Covariance(gpc.settings.kernel, kernel["scale"], kernel["parameter"]), state["inducing"])
        gpc._latents = Latents(state["mean"], state["covariance"])
        gpc._labeled = gpc._prior.project(state["labelled"])
        gpc._targets_N = state["targets"]
        return gpc

    def _targets(self, labels_N: np.ndarray) -> np.ndarray:
        return np.array([self.classes.index(label) for label in labels_N], dtype=np.int64)
