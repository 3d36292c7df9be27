"""Re-enactments of registrations: their file, their verdict, and the numbers that learners read."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from scipy.special import expit

from gpca.alignment.icp import ICPSettings
from gpca.alignment.pose_error import displacements
from gpca.causes.dataset import LABELS, Causes
from gpca.causes.descriptors import WIDTHS, describe_plainly, observed_pair
from gpca.causes.settings import CauseSettings, Limits
from gpca.causes.truth import ALL, SUBSETS, shapley_values
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import Container, array
from gpca.pairs.dataset import Registrations
from gpca.pairs.distances import ObservedPair
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.reenactment.enactment import Enactment, reenact
from gpca.reenactment.hypotheses import weights_of
from gpca.reenactment.settings import SMALLEST_ERROR, STEEPNESS, ReenactmentSettings
from gpca.rigid import inverses, transform


def verdict(error_S_K_8: np.ndarray, weight_S_K: np.ndarray, limits: Limits) -> np.ndarray:
    """Return the probabilities (S, 4) of nominal and of each cause to be the dominant one, of S pairs."""
    middle = np.sqrt(limits.nominal * limits.failed)  # where a failure is as probable as not
    failed_S_K = expit(STEEPNESS * np.log(np.maximum(error_S_K_8[..., ALL], SMALLEST_ERROR) / middle))
    phi_S_K_3 = shapley_values(error_S_K_8.reshape(-1, ALL + 1)).reshape(*weight_S_K.shape, -1)
    share_S_K_3 = np.exp((phi_S_K_3 - phi_S_K_3.max(axis=2, keepdims=True)) / limits.cause)
    share_S_K_3 /= share_S_K_3.sum(axis=2, keepdims=True)
    causes_S_3 = (weight_S_K[..., None] * failed_S_K[..., None] * share_S_K_3).sum(axis=1)
    return np.column_stack([1 - causes_S_3.sum(axis=1), causes_S_3])


MEASURED = ("log_likelihood", "width", "covered", "noise", "outliers", "missing", "to_start", "to_result")
DESCRIBED = ("distances", "planes", "motion", "starts")  # groups of descriptors, without further registrations
DESCRIPTORS = sum(WIDTHS[group] for group in DESCRIBED)  # number of these, the last of the features


# What re-enacts the observed pair of a row where its registration comes from, the most probable hypothesis first.
World = Callable[[ObservedPair, int], list[Enactment]]


@dataclass(frozen=True)
class Reenactments(Container):
    """The re-enactments of S registrations under K hypotheses each, the most probable first.

    Where a pair has fewer hypotheses, its first stands in the place of the others, with weight 0. The last of
    `MEASURED` are how far (root mean square) the observed points lie from where the registration began and ended.
    """

    sample: np.ndarray = array("S", WHOLE)
    split: np.ndarray = array("S", TEXT)
    weight: np.ndarray = array("S K")  # probabilities of the hypotheses
    T_model_observed: np.ndarray = array("S K 4 4")
    error: np.ndarray = array(f"S K {len(SUBSETS)}")
    uncertainty: np.ndarray = array(f"S K {len(SUBSETS)}")
    result_error: np.ndarray = array("S K")  # of the pose that registration found, were a hypothesis true; diameters
    measured: np.ndarray = array(f"S K {len(MEASURED)}")
    described: np.ndarray = array(f"S {DESCRIPTORS}")
    verdict: np.ndarray = array(f"S {len(LABELS)}")

    @classmethod
    def of_rows(
        cls, rows: Sequence[Mapping[str, np.ndarray]], truth: CauseSettings, registrations: Registrations | None = None
    ) -> Reenactments:
        """Return those of the rows of pairs (:func:`row_of`), which may be of no registrations of a file."""
        arrays: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        arrays |= {"verdict": verdict(arrays["error"], arrays["weight"], truth.limits)}
        if registrations is None:
            return cls(sample=np.arange(len(rows)), split=np.full(len(rows), ""), **arrays)
        return cls(sample=registrations.sample, split=registrations.split, **arrays, axes=registrations.axes)


def reenact_all(
    causes: Causes,
    source: str,
    seed: int | None,
    settings: ReenactmentSettings,
    truth: CauseSettings,
    world: World | None = None,
) -> tuple[Reenactments, np.ndarray, np.ndarray]:
    """Return the re-enactments of every row, the seconds (S,) that each took, and those of its registrations."""
    rows, seconds, icp_seconds = [], [], []
    for row in progress(range(len(causes)), f"re-enactments of {source}, seed {seed}"):
        started = perf_counter()
        pair = observed_pair(causes, row, source, seed, "reenactment")
        enactments = world(pair, row) if world else reenact(pair, settings, truth)
        rows.append(row_of(enactments, pair, settings, truth))
        seconds.append(perf_counter() - started)
        icp_seconds.append(sum(enactment.icp_seconds for enactment in enactments))
    return Reenactments.of_rows(rows, truth, causes.registrations), np.array(seconds), np.array(icp_seconds)


def row_of(
    enactments: list[Enactment], pair: ObservedPair, settings: ReenactmentSettings, truth: CauseSettings
) -> dict[str, np.ndarray]:
    """Return the arrays of one pair (K, …), see :class:`Reenactments`."""
    before, measured = transform(pair.T_init, pair.observed), []
    for enactment in enactments:
        hypothesis, severity = enactment.hypothesis, enactment.candidate.severity
        to_start = displacements(hypothesis.T[None], before)[0]
        to_result = displacements((hypothesis.T @ pair.T_init)[None], pair.observed)[0]
        numbers = (hypothesis.log_likelihood, hypothesis.width, hypothesis.covered)
        measured.append((*numbers, *(severity[name] for name in ("noise", "outliers", "crop")), to_start, to_result))
    T_result_K = inverses(np.array([enactment.hypothesis.T @ pair.T_init for enactment in enactments]))
    result_error_K = [each.errors(T[None])[0] for each, T in zip(enactments, T_result_K, strict=True)]
    most = settings.hypotheses
    rows_K = np.where(np.arange(most) < len(enactments), np.arange(most), 0)
    return {
        "weight": np.pad(weights_of(enactment.hypothesis for enactment in enactments), (0, most - len(enactments))),
        "T_model_observed": np.array([enactment.hypothesis.T for enactment in enactments])[rows_K],
        "error": np.array([enactment.error_8 for enactment in enactments])[rows_K],
        "uncertainty": np.array([enactment.uncertainty_8 for enactment in enactments])[rows_K],
        "result_error": np.array(result_error_K)[rows_K],
        "measured": np.array(measured)[rows_K],
        "described": described(pair, truth.icp),
    }


def described(pair: ObservedPair, icp: ICPSettings) -> np.ndarray:
    """Return the descriptors (F,) of a pair that need no further registrations."""
    return np.concatenate([*describe_plainly(pair, icp).values()])


SMALLEST_SUM = 0.01  # diameters, of the |φ̂| whose shares are taken
FEATURES = (
    *(f"{whose}_error_{subset}" for whose in ("first", "mean", "second") for subset in range(len(SUBSETS))),
    *(f"{whose}_phi_{concept}" for whose in ("first", "mean", "second") for concept in CONCEPTS),
    *(f"share_{concept}" for concept in CONCEPTS),
    *(f"uncertainty_{subset}" for subset in range(1, len(SUBSETS))),
    *(f"{whose}_{name}" for whose in ("first", "second") for name in MEASURED),
    *("first_weight", "second_weight", "entropy", "error_deviation", "least_error", "largest_error"),
)


def reenactment_features(reenactments: Reenactments) -> np.ndarray:
    """Return `FEATURES` (S, F), v̂ as logarithms and û compressed, and after them the descriptors of each pair."""
    weight_S_K, error_S_K_8 = reenactments.weight, reenactments.error
    mean_S_8 = (weight_S_K[..., None] * error_S_K_8).sum(axis=1)
    errors = [error_S_K_8[:, 0], mean_S_8, error_S_K_8[:, 1]]
    phi = [shapley_values(error_S_8) for error_S_8 in errors]
    sums = np.maximum(np.abs(phi[1]).sum(axis=1, keepdims=True), SMALLEST_SUM)
    all_S_K = error_S_K_8[..., ALL]
    deviation_S = np.sqrt((weight_S_K * (all_S_K - mean_S_8[:, ALL, None]) ** 2).sum(axis=1))
    entropy_S = -(weight_S_K * np.log(np.maximum(weight_S_K, 1e-12))).sum(axis=1)
    return np.column_stack(
        [
            *(np.log(np.maximum(error_S_8, SMALLEST_ERROR)) for error_S_8 in errors),
            *phi,
            phi[1] / sums,
            np.log1p(reenactments.uncertainty[:, 0, 1:]),
            *(reenactments.measured[:, k] for k in range(2)),
            *(weight_S_K[:, k] for k in range(2)),
            *(entropy_S, deviation_S, all_S_K.min(axis=1), all_S_K.max(axis=1)),
            reenactments.described,
        ]
    )
