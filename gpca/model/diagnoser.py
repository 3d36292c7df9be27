"""The diagnosis of one registration, by the part of a model that learned from measured causes."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
import torch

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.icp import ICPSettings
from gpca.alignment.rigid import inverse, transform
from gpca.alignment.twist import exp
from gpca.causes.truth import FAILED, LARGEST_ERROR, NOMINAL
from gpca.explainers.pair_classifier import PairClassifier
from gpca.features.dataset import describe
from gpca.features.pair import ObservedPair
from gpca.features.settings import GROUPS, DescriptorSettings
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator
from gpca.uncertainty.settings import UncertaintySettings

SMALLEST_ERROR = 1e-3  # diameters; below it lies the spacing of the points
UNKNOWN = "unknown"  # the state of a diagnosis without meaning
LIKELY = 0.5  # probability from which a concept is called one of the causes


@dataclass(frozen=True)
class Diagnosis:
    """The diagnosis of one registration.

    Attributes:
        failure: probability that it failed.
        threshold: of that probability, from which something is called wrong.
        causes: probability of each concept that it is one of the causes, if there are any.
        variances: of these over the posterior draws (Eq. 5).
        bald: of the least certain of these probabilities, nats (Eq. 7).
        expected_error: of the pose: ADD, or ADD-S of a symmetric object.
        unlikeness: how unlike the training samples the pair is: 1 % of these are above 1.
        void: whether the pair is such that none of these numbers means anything (:mod:`gpca.model.familiarity`).
    """

    failure: float
    threshold: float
    causes: dict[str, float]
    variances: dict[str, float]
    bald: float
    expected_error: float
    unlikeness: float = 0.0
    void: bool = False

    @property
    def state(self) -> str:
        """``nominal``, ``failed`` or ``unknown``."""
        if self.void:
            return UNKNOWN
        return NOMINAL if self.failure < self.threshold else FAILED

    @property
    def named(self) -> tuple[str, ...]:
        """The causes that are more likely than not, the likeliest first, and at least that one; none unless failed."""
        if self.state != FAILED:
            return ()
        first, *rest = sorted(self.causes, key=lambda cause: -self.causes[cause])
        return first, *(cause for cause in rest if self.causes[cause] >= LIKELY)

    def as_dict(self) -> dict[str, object]:
        """Return it as numbers, lists and names, for JSON."""
        return vars(self) | {"state": self.state, "named": list(self.named)}


@dataclass(frozen=True)
class Diagnoser:
    """Classifiers on the descriptors of a pair, and the settings by which a pair is described as in the training.

    Attributes:
        classifier: of failure and of the causes.
        error_weights: (F + 1,) regression of ln error (diameters) on the normalized descriptors, the constant last.
        threshold: probability of failure from which something is called wrong.
        points: of each cloud, at most.
        runs: how ICP runs from other starts.
        descriptors: what is measured.
    """

    classifier: PairClassifier
    error_weights: np.ndarray
    threshold: float
    points: int
    runs: UncertaintySettings
    descriptors: DescriptorSettings

    def diagnose(self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray) -> Diagnosis:
        """Diagnose a registration; the same clouds give the same numbers.

        Args:
            observed: (N, 3) where ICP started, in diameters and in the model's frame.
            model: (M, 3).
            T_icp: 4×4, what ICP found: takes the observed cloud to the model.
        """
        inputs_1_F = self.classifier.normalized(self.features(observed, model, T_icp)[None])
        judged = self.classifier.judge(inputs_1_F)
        log_error = float(inputs_1_F[0] @ self.error_weights[:-1] + self.error_weights[-1])
        return Diagnosis(
            failure=float(judged.failure_N[0]),
            threshold=self.threshold,
            causes=dict(zip(CONCEPTS, judged.causes_N_3[0].tolist(), strict=True)),
            variances=dict(zip(CONCEPTS, judged.causes_variances_N_3[0].tolist(), strict=True)),
            bald=float(judged.bald_N[0]),
            expected_error=float(np.clip(np.exp(log_error), SMALLEST_ERROR, LARGEST_ERROR)),
            unlikeness=float(self.classifier.unlikeness(inputs_1_F)[0]),
        )

    def features(self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray) -> np.ndarray:
        """Return the descriptors (F,) of the pair."""
        observed, model = _drawn(observed, self.points, "observed"), _drawn(model, self.points, "model")
        starts_n = exp(generator("diagnosis", "starts").normal(size=(self.runs.starts, 6)) * self.runs.deviation_6())
        starts_n[0] = T_icp
        T_n, fitness_n, rmse_n = BatchedICP(model, self.runs.icp).register(observed, starts_n)
        T_back = inverse(T_n[0])
        pair = ObservedPair(
            observed=transform(T_n[0], observed),
            model=model,
            T_init=T_back,
            T_runs=T_n @ T_back,
            fitness_n=fitness_n,
            inlier_rmse_n=rmse_n,
            axes=("diagnosis",),
        )
        described, _ = describe(pair, self.descriptors, self.runs.icp)
        return np.concatenate([described[group] for group in GROUPS])

    def state(self) -> dict[str, object]:
        """Return tensors, numbers and names for :meth:`from_state`."""
        return {
            "classifier": self.classifier.state(),
            "error_weights": torch.from_numpy(self.error_weights),
            "threshold": self.threshold,
            "points": self.points,
            "runs": {name: value for name, value in asdict(self.runs).items() if name != "icp"},
            "icp": asdict(self.runs.icp),
            "descriptors": asdict(self.descriptors),
        }

    @classmethod
    def from_state(cls, state: dict) -> Diagnoser:
        """Return the diagnoser of a :meth:`state`."""
        return cls(
            classifier=PairClassifier.from_state(state["classifier"]),
            error_weights=state["error_weights"].numpy(),
            threshold=state["threshold"],
            points=state["points"],
            runs=UncertaintySettings(**state["runs"], icp=ICPSettings(**state["icp"])),
            descriptors=DescriptorSettings(**state["descriptors"]),
        )


def _drawn(cloud: np.ndarray, most: int, role: str) -> np.ndarray:
    return cloud[generator("diagnosis", role).permutation(len(cloud))[:most]]
