"""What is settled before a policy decides: the robot's thresholds, and how far each explainer can be trusted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from gpca.recovery.loop_explainers import LoopExplainers
from gpca.recovery.policy import RecoveryPolicy
from gpca.recovery.rehearsal import Rehearsal


def robot_policy(recovery: Mapping, rehearsal: Rehearsal | None) -> RecoveryPolicy:
    """Return the declared thresholds, and the one that is chosen on the rehearsed failures unless it is declared.

    Those were searched for as the failures are that policies are asked about, on other tables. Without a rehearsal no
    policy queues anything.

    Args:
        recovery: the config's section.
    """
    bald_N = np.array([rehearsal.bald[episode.number] for episode in rehearsal.failures] if rehearsal else [np.inf])
    attempts = recovery["loop"]["budget"]
    return RecoveryPolicy.of_settings(recovery["thresholds"], recovery["treatments"], attempts, bald_N)


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
