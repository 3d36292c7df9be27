"""What is wrong with one registration, if anything: the part of a model that learnt from measured causes."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
import torch

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.icp import ICPSettings
from gpca.alignment.rigid import inverse, transform
from gpca.alignment.twist import exp
from gpca.causes.truth import LARGEST_ERROR
from gpca.descriptors.dataset import describe
from gpca.descriptors.groups import GROUPS
from gpca.descriptors.pair import ObservedPair
from gpca.descriptors.settings import DescriptorSettings
from gpca.explainers.pair_classifier import PairClassifier
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator
from gpca.uncertainty.settings import UncertaintySettings

SMALLEST_ERROR = 1e-3  # diameters; below it lies the spacing of the points
RIDGE = 10.0  # of the regression of the error, in samples


@dataclass(frozen=True)
class Diagnosis:
    """What is said of one registration.

    Attributes:
        failure: probability that it failed.
        nominal: whether nothing is wrong: the probability is below the model's threshold.
        causes: probability of each concept that it is one of the causes.
        expected_error: of the pose, ADD in diameters.
    """

    failure: float
    nominal: bool
    causes: dict[str, float]
    expected_error: float


@dataclass(frozen=True)
class Diagnoser:
    """Classifiers on the descriptors of a pair, and what describes one as the training samples were.

    Attributes:
        classifier: of failure and of the causes.
        error_weights: (F + 1,) regression of the logarithm of the error on the normalised descriptors, constant last.
        threshold: probability of failure from which something is wrong.
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
        """Say what is wrong with a registration.

        Args:
            observed: (N, 3) where ICP started, in diameters and in the model's frame.
            model: (M, 3).
            T_icp: 4×4, what ICP found: takes the observed cloud to the model.
        """
        features_1_F = self.features(observed, model, T_icp)[None]
        failed_1, causes_1_3 = self.classifier.probabilities(features_1_F)
        inputs_1_F = self.classifier.normalised(features_1_F)
        log_error = float(inputs_1_F[0] @ self.error_weights[:-1] + self.error_weights[-1])
        return Diagnosis(
            failure=float(failed_1[0]),
            nominal=bool(failed_1[0] < self.threshold),
            causes=dict(zip(CONCEPTS, causes_1_3[0].tolist(), strict=True)),
            expected_error=float(np.clip(np.exp(log_error), SMALLEST_ERROR, LARGEST_ERROR)),
        )

    def features(self, observed: np.ndarray, model: np.ndarray, T_icp: np.ndarray) -> np.ndarray:
        """Return the descriptors (F,) of the pair; the same clouds give the same numbers."""
        observed, model = (_drawn(cloud, self.points, role) for cloud, role in ((observed, "o"), (model, "m")))
        xi_n_6 = generator("diagnosis", "starts").normal(size=(self.runs.starts, 6)) * self.runs.deviation_6()
        xi_n_6[0] = 0
        icp = BatchedICP(model, self.runs.icp)
        T_n, fitness_n, rmse_n = icp.register(observed, exp(xi_n_6))
        back = inverse(T_icp)
        T_n[0] = T_icp
        pair = ObservedPair(
            observed=transform(T_icp, observed),
            model=model,
            T_init=back,
            T_runs=T_n @ back,
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


def fit_error(inputs_N_F: np.ndarray, error_N: np.ndarray) -> np.ndarray:
    """Return the weights (F + 1,) of a ridge regression of ln error on normalised descriptors, the constant last."""
    from sklearn.linear_model import Ridge

    fitted = Ridge(alpha=RIDGE).fit(inputs_N_F, np.log(np.maximum(error_N, SMALLEST_ERROR)))
    return np.append(fitted.coef_, fitted.intercept_)


def threshold_of(failure_N: np.ndarray, false_alarms: float) -> float:
    """Return the probability of failure that at most so large a share of nominal samples reaches.

    Args:
        failure_N: probabilities of nominal samples that the classifier did not learn.
        false_alarms: the share, in [0, 1).
    """
    return float(np.nextafter(np.quantile(failure_N, 1 - false_alarms, method="inverted_cdf"), 1))


def _drawn(cloud: np.ndarray, most: int, role: str) -> np.ndarray:
    order = generator("diagnosis", role).permutation(len(cloud))
    return cloud[order[:most]]
