"""The gate of a policy: whether a registration failed, from what the robot observes, so that good ones are left alone.

It knows nothing of causes. It learns from registrations of the training tables, and its threshold is set on the good
ones among them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gpca.errors import InputError
from gpca.guarantee.conformal import upper_bound

INVERSE_REGULARIZATION = 0.3  # C of scikit-learn; chosen on development seeds
FOLDS = 8  # of the tables


@dataclass(frozen=True)
class FailureGate:
    """A classifier of failures and the probability from which it raises the alarm."""

    classifier: Any
    threshold: float = 0.5

    def failure(self, observed_N_F: np.ndarray) -> np.ndarray:
        """Return the probability (N,) that each registration failed."""
        return self.classifier.predict_proba(observed_N_F)[:, 1]

    def alarms(self, observed_F: np.ndarray) -> bool:
        """Return whether the registration is taken for failed."""
        return bool(self.failure(observed_F[None])[0] > self.threshold)


def learn_gate(
    observed_N_F: np.ndarray, failed_N: np.ndarray, table_N: Sequence[object], false_alarms: float
) -> FailureGate:
    """Learn from registrations that failed or not.

    The threshold is set on the good ones, each judged by a classifier that has learned no registration of its table.

    Args:
        observed_N_F: see :data:`gpca.recovery.observation.OBSERVED`.
        table_N: the table that each is on.
        false_alarms: see :func:`alarm_threshold`.

    Raises:
        InputError: those that failed, or those that did not, are on fewer than two tables.
    """
    good_N = ~failed_N
    _, group_N = np.unique([str(table) for table in table_N], return_inverse=True)
    for kind, of_kind_N in (("failed", failed_N), ("good", good_N)):
        if (tables := len(set(group_N[of_kind_N]))) < 2:
            fault = (
                f"training registrations that are {kind} stand on {tables} of the two tables that a gate needs at least"
            )
            raise InputError("recovery", fault, "raise recovery.train, recovery.rehearsals or recovery.tables")
    fold_N = group_N % FOLDS
    failure_N = np.full(len(failed_N), np.nan)
    for fold in np.unique(fold_N[good_N]):
        held_out_N = fold_N == fold
        failure_N[held_out_N] = _fitted(observed_N_F[~held_out_N], failed_N[~held_out_N]).failure(
            observed_N_F[held_out_N]
        )
    return replace(_fitted(observed_N_F, failed_N), threshold=alarm_threshold(failure_N[good_N], false_alarms))


def alarm_threshold(failure_M: np.ndarray, false_alarms: float) -> float:
    """Return the threshold that a further good registration exceeds with at most this probability.

    That holds over the draws of the M good ones, if they are exchangeable with it
    (:func:`gpca.guarantee.conformal.upper_bound`). Where M is too small for it, it is the largest of them.
    """
    return min(upper_bound(failure_M, 1 - false_alarms), float(failure_M.max()))


def _fitted(observed_N_F: np.ndarray, failed_N: np.ndarray) -> FailureGate:
    from gpca.explainers.classifiers import standardized_regression

    return FailureGate(standardized_regression(INVERSE_REGULARIZATION).fit(observed_N_F, failed_N))
