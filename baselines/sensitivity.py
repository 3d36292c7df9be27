"""Sensitivity analysis of the registration's uncertainty: local derivatives, PRCC and Sobol indices.

Local: one knob at a time, as the paper describes it. Global: partial rank correlation over a Latin hypercube (Marino
et al. 2008, whom the paper cites) and total indices by Saltelli's scheme (Saltelli et al. 2010, through SALib).
Over remedies, one at a time is switched on (docs/baselines.md).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import perf_counter

import numpy as np

from baselines.attached import attached
from baselines.remedies import LearnedValues, ScaledValues, charged
from gpca.attribution import Attribution
from gpca.dataset import Registrations
from gpca.explainer import Entry

ONE_AT_A_TIME = [0, 1, 2, 4]  # the corners with none or one of the three features present
STEPS = [0, 8, 9, 10]  # of design ``additive``: untouched, and a small step of each knob


def local_derivatives(uncertainty_N_K: np.ndarray) -> np.ndarray:
    """Return ∂u/∂knob (N, 3), forward differences from the untouched pair, knobs in units of their range."""
    from gpca.designs import STEP

    return (uncertainty_N_K[:, STEPS[1:]] - uncertainty_N_K[:, :1]) / STEP


def partial_rank_correlations(inputs_K_3: np.ndarray, outputs_N_K: np.ndarray) -> np.ndarray:
    """Return the PRCC (N, 3) of each input with each of N outputs over K settings (Marino et al. 2008, Sec. 2.3).

    The partial correlations are -P_iy / √(P_ii P_yy), P the inverse of the correlation matrix of the ranks. Where an
    output is constant they are zero.
    """
    from scipy.stats import rankdata

    values_N_3 = np.zeros((len(outputs_N_K), inputs_K_3.shape[1]))
    ranks_K_3 = rankdata(inputs_K_3, axis=0)
    for values_3, output_K in zip(values_N_3, outputs_N_K, strict=True):
        if np.ptp(output_K) > 0:
            precision = np.linalg.pinv(np.corrcoef(ranks_K_3, rankdata(output_K), rowvar=False))
            values_3[:] = -precision[:-1, -1] / np.sqrt(np.diag(precision)[:-1] * precision[-1, -1])
    return values_N_3


def total_indices(inputs_K_3: np.ndarray, outputs_N_K: np.ndarray) -> np.ndarray:
    """Return Sobol's total index (N, 3) of each input for each of N outputs at Saltelli's K settings.

    Where an output is constant they are zero.
    """
    from SALib.analyze import sobol

    problem = {"num_vars": 3, "names": ["noise", "spread", "overlap"], "bounds": [[0, 1]] * 3}
    values_N_3 = np.zeros((len(outputs_N_K), 3))
    for values_3, output_K in zip(values_N_3, outputs_N_K, strict=True):
        if np.ptp(output_K) > 0:
            # The resamples only give confidence bounds, which are not used; two are the fewest.
            indices = sobol.analyze(problem, output_K, calc_second_order=False, num_resamples=2, seed=0)
            values_3[:] = indices["ST"]
    return values_N_3


class KnobSensitivity:
    """Sensitivities to the knobs of one design: the knob with the largest names the concept.

    Args:
        sensitivities: uncertainty (N, K) under the design's conditions -> sensitivities (N, 3).
        conditions: those that it needs, and is charged with; None for all.
    """

    def __init__(self, sensitivities: Callable[[np.ndarray], np.ndarray], conditions: list[int] | None = None) -> None:
        self._sensitivities, self._conditions = sensitivities, conditions

    def fit(self, registrations: Registrations) -> None:
        """Nothing is learned."""

    def explain(self, registrations: Registrations) -> Attribution:
        """Score every registration by the sensitivities of its uncertainty."""
        started = perf_counter()
        uncertainty_N_K = attached(registrations, "uncertainty", None)
        conditions = self._conditions or list(range(uncertainty_N_K.shape[1]))
        return charged(registrations, self._sensitivities(uncertainty_N_K), conditions, started)


def sa_local_additive(source: str, seed: int) -> KnobSensitivity:
    """Make the paper's: local derivatives at the observed pair."""
    return KnobSensitivity(local_derivatives, STEPS)


def sa_prcc_additive(source: str, seed: int) -> KnobSensitivity:
    """Make the one with rank correlations over a Latin hypercube."""
    return KnobSensitivity(partial(_over_settings, partial_rank_correlations, "latin"))


def sa_sobol_additive(source: str, seed: int) -> KnobSensitivity:
    """Make the one with total indices."""
    return KnobSensitivity(partial(_over_settings, total_indices, "saltelli"))


def _over_settings(sensitivities: Callable, kind: str, uncertainty_N_K: np.ndarray) -> np.ndarray:
    from gpca.designs import sampled_knobs

    # The first condition is the untouched pair, against which the uncertainty is measured.
    return sensitivities(sampled_knobs(kind), uncertainty_N_K[:, 1:])


def single_drops(worth_N_8: np.ndarray) -> np.ndarray:
    """Return what each feature alone changes (N, 3)."""
    return worth_N_8[:, ONE_AT_A_TIME[1:]] - worth_N_8[:, :1]


def sa_local_removal(source: str, seed: int, worth: str = "uncertainty") -> ScaledValues:
    """Make the explainer that names the remedy which alone lowers the worth most."""
    return ScaledValues(single_drops, ONE_AT_A_TIME, worth)


def sa_supervised(source: str, seed: int, inverse_regularisation: float = 1.0) -> LearnedValues:
    """Make the explainer that learns from what each remedy alone changes."""
    return LearnedValues(single_drops, ONE_AT_A_TIME, inverse_regularisation)


EXPLAINERS = {
    "sa_local_additive": Entry("SA", sa_local_additive, reads="uncertainty/additive"),
    "sa_prcc_additive": Entry("SA, PRCC", sa_prcc_additive, reads="uncertainty/latin"),
    "sa_sobol_additive": Entry("SA, Sobol", sa_sobol_additive, reads="uncertainty/saltelli"),
    "sa_local_removal": Entry("SA, remedies", sa_local_removal, reads="uncertainty/removal"),
    "sa_local_removal_residual": Entry("SA, remedies, residual", sa_local_removal, reads="uncertainty/removal"),
    "sa_supervised": Entry("SA, remedies, learned", sa_supervised, reads="uncertainty/removal"),
}
