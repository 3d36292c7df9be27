"""What the calibration samples decide: the robot's thresholds, and how far each explainer can be trusted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from gpca.recovery.loop_explainers import LoopExplainers
from gpca.recovery.policy import RecoveryPolicy

FEWEST_FAILED = 10  # calibration samples, for a threshold to be chosen on the failed ones alone


def robot_policy(recovery: Mapping, explainers: LoopExplainers, failed_N: np.ndarray) -> RecoveryPolicy:
    """Return the declared thresholds, and the one that is chosen on the calibration samples unless it is declared.

    It is chosen on those that failed (N,), since a policy is asked about such; on all where hardly any did.

    Args:
        recovery: the config's section.
    """
    gpca = explainers.calibration.get("gpca")
    bald_N = np.full(len(failed_N), np.inf) if gpca is None else gpca.bald_N
    rows = failed_N if failed_N.sum() >= FEWEST_FAILED else np.ones(len(failed_N), bool)
    attempts = recovery["loop"]["budget"]
    return RecoveryPolicy.of_settings(recovery["thresholds"], recovery["treatments"], attempts, bald_N[rows])


def summary(policy: RecoveryPolicy, explainers: LoopExplainers) -> dict:
    """Return thresholds, treatments and the accuracy of every explainer on the calibration samples, for JSON."""
    return {
        "thresholds": {name: round(value, 6) for name, value in asdict(policy.thresholds).items()},
        "treatments": dict(policy.treatments),
        "calibration_samples": len(explainers.concepts),
        "calibration_accuracy": {
            name: round(float(explainers.right(name).mean()), 6) for name in explainers.calibration
        },
    }
