"""Judges one estimate: against the references, and against the true pose."""

from __future__ import annotations

import numpy as np

from gpca.alignment.rigid import point_jacobians, transform
from gpca.experiments.estimators.covariances import JUDGED, covariance_columns
from gpca.experiments.estimators.references import Reference
from gpca.experiments.estimators.situations import EstimatedRow
from gpca.uncertainty.estimators.interface import Estimate
from gpca.uncertainty.spread import divergence

LEVEL = 0.95  # of the region whose coverage is counted


def judged(case: EstimatedRow, answer: Estimate, floor: float) -> dict[str, object]:
    """Return the row of an estimate; numbers that it lacks are NaN."""
    row = {**case.known, "failure": answer.failure}
    numbers = dict.fromkeys(JUDGED, np.nan)
    if answer.covariance_6_6 is not None:
        sigma_6_6, e_6 = answer.covariance_6_6, case.true_twist
        numbers["error_ratio"] = float(e_6 @ e_6 / np.trace(sigma_6_6 + floor * np.eye(6)))
        numbers["mahalanobis"] = mahalanobis(e_6, sigma_6_6, floor)
        points = transform(case.registered.T_target_source, case.registered.pair.source)
        numbers["spread"] = predicted_spread(points, sigma_6_6)
        for kind, reference in case.references.items():
            numbers |= {f"{name}_{kind}": value for name, value in compared(sigma_6_6, reference, floor).items()}
    return row | numbers | covariance_columns(answer.covariance_6_6)


def compared(sigma_6_6: np.ndarray, reference: Reference, floor: float) -> dict[str, float]:
    """Return how a covariance fits the results of a reference about their mean, with their own covariance S.

    - kl_rotation, kl_translation: KL divergence of the 3×3 blocks, S the expected one, nats.
    - error_ratio: tr S / tr Σ. mahalanobis: mean of dᵀΣ⁻¹d over the results' distances d from their mean, tr Σ⁻¹S.
    - covered: share of the results within the 95 % region of Σ about their mean.

    All with the floor added to both, so that a spread below it counts as none. Nothing where the reference has none.
    """
    from scipy.stats import chi2

    S_6_6 = reference.covariance_6_6
    if S_6_6 is None:
        return {}
    floored_6_6, expected_6_6 = (matrix + floor * np.eye(6) for matrix in (sigma_6_6, S_6_6))
    away_n_6 = reference.twists - reference.twists.mean(axis=0)
    squares_n = np.einsum("ni,in->n", away_n_6, np.linalg.solve(floored_6_6, away_n_6.T))
    return {
        "kl_rotation": float(divergence(S_6_6[:3, :3], sigma_6_6[:3, :3], floor)),
        "kl_translation": float(divergence(S_6_6[3:, 3:], sigma_6_6[3:, 3:], floor)),
        "error_ratio": float(np.trace(expected_6_6) / np.trace(floored_6_6)),
        "mahalanobis": float(np.trace(np.linalg.solve(floored_6_6, expected_6_6))),
        "covered": float((squares_n <= chi2.ppf(LEVEL, 6)).mean()),
    }


def mahalanobis(true_twist_6: np.ndarray, covariance_6_6: np.ndarray, floor: float) -> float:
    """Return eᵀ (Σ + εI)⁻¹ e, of χ² with six degrees where the covariance is right."""
    return float(true_twist_6 @ np.linalg.solve(covariance_6_6 + floor * np.eye(6), true_twist_6))


def predicted_spread(points_N_3: np.ndarray, covariance_6_6: np.ndarray) -> float:
    """Return the root mean square distance by which points would move: √ mean tr(J Σ Jᵀ), in their unit."""
    jacobians_N_3_6 = point_jacobians(points_N_3)
    squares = np.einsum("nij,jk,nik->n", jacobians_N_3_6, covariance_6_6, jacobians_N_3_6)
    return float(np.sqrt(max(squares.mean(), 0.0)))
