"""Shapley values by ``shap.KernelExplainer`` on the live function, and what separates them from those of a table."""

from __future__ import annotations

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.uncertainty.designs import LiveUncertainty
from gpca.uncertainty.interventions import MIDDLE, UNTOUCHED, Knobs


def live_values(uncertainty: LiveUncertainty) -> np.ndarray:
    """Return the Shapley values (3,) of the knobs in nats, turned from at rest to the middle of their ranges.

    With three features ``shap.KernelExplainer`` asks for all eight coalitions. Each call registers.
    """
    import shap

    def of_coalitions(present_M_3: np.ndarray) -> np.ndarray:
        settings = np.where(np.asarray(present_M_3) > 0.5, MIDDLE, UNTOUCHED)
        return np.array([uncertainty(Knobs(*setting)) for setting in settings])

    explainer = shap.KernelExplainer(of_coalitions, np.zeros((1, 3)))
    return np.ravel(explainer.shap_values(np.ones((1, 3)), l1_reg=False, silent=True))


def compared(live_S_3: np.ndarray, live_calls_S: np.ndarray, lookup: Attribution) -> dict[str, float]:
    """Return the metrics of live values and runs of ICP of S samples beside those of an explainer's table."""
    tabled_S_3 = lookup.scores_N_C
    return {
        "largest_value": float(np.abs(tabled_S_3).max()),
        "largest_difference": float(np.abs(live_S_3 - tabled_S_3).max()),
        "named_alike": float(np.mean(live_S_3.argmax(axis=1) == tabled_S_3.argmax(axis=1))),
        "live_icp_calls": float(live_calls_S.mean()),
        "icp_calls": float(lookup.icp_calls_N.mean()),
        "test_samples": float(len(live_S_3)),
    }
