"""Sensitivity analysis of the registration's uncertainty: local, PRCC and Sobol indices (docs/baselines.md)."""

from collections.abc import Callable
from functools import partial

import numpy as np

from baselines.values import KnobValues, LearnedValues, RemovalValues, ScaledValues
from gpca.explainers.interface import ExplainerEntry

ONE_AT_A_TIME = [0, 1, 2, 4]  # corners with none or one of the three features present
STEPS = [0, 8, 9, 10]  # conditions of design ``additive``: untouched, or a small step of one knob


def local_derivatives(uncertainty_N_K: np.ndarray) -> np.ndarray:
    """Return ∂u/∂knob (N, 3), forward differences from the untouched pair, knobs in units of their range."""
    from gpca.uncertainty.designs import STEP

    return (uncertainty_N_K[:, STEPS[1:]] - uncertainty_N_K[:, :1]) / STEP


def partial_rank_correlations(inputs_K_3: np.ndarray, outputs_N_K: np.ndarray) -> np.ndarray:
    """Return the PRCC (N, 3) of inputs with N outputs (Marino et al. 2008, Sec. 2.3), 0 where undefined."""
    from scipy.stats import rankdata

    values_N_3 = np.zeros((len(outputs_N_K), inputs_K_3.shape[1]))
    ranks_K_3 = rankdata(inputs_K_3, axis=0)
    ranks_N_K = rankdata(outputs_N_K, axis=1)
    for i, rank_K in enumerate(ranks_K_3.T):
        others = np.column_stack([np.ones(len(rank_K)), np.delete(ranks_K_3, i, axis=1)])
        basis, _ = np.linalg.qr(others)
        input_K = rank_K - basis @ (basis.T @ rank_K)
        outputs_left_N_K = ranks_N_K - ranks_N_K @ basis @ basis.T
        lengths_N = np.linalg.norm(outputs_left_N_K, axis=1)
        varies_N = lengths_N > 1e-9 * np.linalg.norm(ranks_N_K, axis=1)  # the rest is rounding
        values_N_3[varies_N, i] = outputs_left_N_K[varies_N] @ input_K / (lengths_N[varies_N] * np.linalg.norm(input_K))
    return values_N_3


def total_indices(inputs_K_3: np.ndarray, outputs_N_K: np.ndarray) -> np.ndarray:
    """Return Sobol's total indices (N, 3) for N outputs at K settings (Saltelli et al. 2010); zero if constant."""
    from SALib.analyze import sobol

    problem = {"num_vars": 3, "names": ["noise", "spread", "overlap"], "bounds": [[0, 1]] * 3}
    values_N_3 = np.zeros((len(outputs_N_K), 3))
    for values_3, output_K in zip(values_N_3, outputs_N_K, strict=True):
        if np.ptp(output_K) > 0:
            # Resamples only give confidence bounds, which are not used; two is the minimum.
            values_3[:] = sobol.analyze(problem, output_K, calc_second_order=False, num_resamples=2, seed=0)["ST"]
    return values_N_3


def _over_settings(sensitivities: Callable, kind: str, uncertainty_N_K: np.ndarray) -> np.ndarray:
    from gpca.uncertainty.designs import sample_knobs

    # The first condition is the untouched pair.
    return sensitivities(sample_knobs(kind), uncertainty_N_K[:, 1:])


def single_drops(worth_N_8: np.ndarray) -> np.ndarray:
    """Return the change that each feature makes alone (N, 3)."""
    return worth_N_8[:, ONE_AT_A_TIME[1:]] - worth_N_8[:, :1]


# The paper uses local derivatives at the observed pair.
sa_local_additive = partial(KnobValues, local_derivatives, STEPS)
_prcc = partial(KnobValues, partial(_over_settings, partial_rank_correlations, "latin"), None)
_sobol = partial(KnobValues, partial(_over_settings, total_indices, "saltelli"), None)
_removal = partial(ExplainerEntry, sees=("remedies",), reads="uncertainty/removal")
_drops = partial(ScaledValues, single_drops, ONE_AT_A_TIME)
EXPLAINERS = {
    "sa_local_additive": ExplainerEntry("SA", sa_local_additive, ("runs",), reads="uncertainty/additive"),
    "sa_prcc_additive": ExplainerEntry("SA, PRCC", _prcc, ("runs",), reads="uncertainty/latin"),
    "sa_sobol_additive": ExplainerEntry("SA, Sobol", _sobol, ("runs",), reads="uncertainty/saltelli"),
    "sa_local_removal": _removal("SA, remedies", _drops),
    "sa_local_removal_residual": _removal("SA, remedies, residual", _drops),
    "sa_supervised": _removal("SA, remedies, learned", partial(LearnedValues, single_drops, ONE_AT_A_TIME)),
}
_causes = partial(RemovalValues, lambda errors_N_8: single_drops(-errors_N_8[:, ::-1]))
CAUSE_EXPLAINERS = {"sa_removal": ExplainerEntry("SA, remedies", _causes, ("remedies",), reads="descriptors")}
