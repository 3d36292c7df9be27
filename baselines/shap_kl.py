"""SHAP (Lundberg & Lee 2017) over the registration's uncertainty, under four protocols (docs/baselines.md)."""

from functools import partial

import numpy as np

from baselines.values import KnobValues, LearnedValues, RemovalValues, ScaledValues
from gpca.explainers.interface import ExplainerEntry

ALL_CORNERS = list(range(8))  # with which the designs of knobs begin


def shapley_values(worth_N_8: np.ndarray) -> np.ndarray:
    """Return the Shapley values (N, 3) of N games, given the worth of all 8 coalitions of each."""
    import shap

    def worth(present_M_3: np.ndarray) -> np.ndarray:
        return worth_N_8[:, np.rint(present_M_3).astype(int) @ (1, 2, 4)].T

    explainer = shap.KernelExplainer(worth, np.zeros((1, 3)))
    return np.reshape(explainer.shap_values(np.ones((1, 3)), l1_reg=False, silent=True), (3, -1)).T


shap_over_knobs = partial(KnobValues, lambda uncertainty_N_K: shapley_values(uncertainty_N_K[:, :8]), ALL_CORNERS)
_removal = partial(ExplainerEntry, sees=("remedies",), reads="uncertainty/removal")
_drops = partial(ScaledValues, shapley_values, ALL_CORNERS)
EXPLAINERS = {
    "shap_additive": ExplainerEntry("SHAP", shap_over_knobs, ("runs",), reads="uncertainty/additive"),
    "shap_oracle": ExplainerEntry(
        "SHAP (oracle)", shap_over_knobs, ("runs", "truth"), reads="uncertainty/oracle", oracle=True
    ),
    "shap_removal": _removal("SHAP, remedies", _drops),
    "shap_removal_residual": _removal("SHAP, remedies, residual", _drops),
    "shap_supervised": _removal("SHAP, remedies, learned", partial(LearnedValues, shapley_values, ALL_CORNERS)),
}
_causes = partial(RemovalValues, shapley_values)
CAUSE_EXPLAINERS = {"shap_removal": ExplainerEntry("SHAP, remedies", _causes, ("remedies",), reads="descriptors")}
