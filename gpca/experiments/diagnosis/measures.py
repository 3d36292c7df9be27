"""The measures of a diagnosis, for any weights of the samples: ones, or how often a bootstrap drew each.

Borderline samples count nowhere. All functions take weights (B, N) and return B values, NaN where a measure has no
samples.
"""

from __future__ import annotations

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.causes.truth import ALL, BORDERLINE, NOMINAL
from gpca.experiments.diagnosis.judged import Judged
from gpca.pairs.perturbation import CONCEPTS

RECALL = 0.9  # of the failed, at which false alarms are counted
OF_ALARM = ("auroc_failed", "auprc_failed", "false_alarm_rate", "nominal_calibration")
OF_STATES = ("state_accuracy", "state_accuracy_shown", "auroc_failed_shown")
HEADLINES = ("regret", "tied_accuracy")
OF_CAUSES = (
    *(*HEADLINES, "named_right", "balanced_accuracy", "dominant_accuracy", "average_precision"),
    *("spearman_attribution", "cosine_attribution", "deletion_gain"),
)
MEASURES = (*OF_CAUSES[:5], *OF_ALARM, *OF_STATES, *OF_CAUSES[5:])
OF_FAILED = (*HEADLINES, "dominant_accuracy", "spearman_attribution", "cosine_attribution", "deletion_gain")
OF_SHOWN = ("state_accuracy_shown", "auroc_failed_shown")
# Shares of samples or of pairs of them: an interval of these is never of no width.
SHARES = (*OF_CAUSES[1:6], *OF_ALARM[:3], *OF_STATES)
SMALLER_IS_BETTER = ("regret", "false_alarm_rate", "nominal_calibration")
BINS = 10  # of the calibration error


def measure(samples: Judged, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    """Return every measure (B,) of :data:`MEASURES` that the explainer has.

    - regret: of a failed sample, the error that the best single removal would take away minus that which the named
      cause's removal takes away, as a share of the error; mean. Naming nominal, or nothing, removes nothing.
    - tied_accuracy: as dominant_accuracy, but any cause counts whose φ is that of the dominant one up to the limit of a
      cause.
    - named_right: share of the nominal and the failed whose label is named, causes counted as in tied_accuracy.
    - balanced_accuracy: mean over nominal and the three dominant causes of the share that is named rightly.
    - dominant_accuracy: share of the failed whose dominant cause has the largest score among the causes.
    - auroc_failed, auprc_failed: how well the alarm tells failed from nominal.
    - false_alarm_rate: share of the nominal above the alarm that finds 90 % of the failed.
    - state_accuracy: mean of the shares of the nominal and of the failed that are called so; of what is shown
      (_shown), by the state of that registration alone, whatever it does from other starts.
    - auroc_failed_shown: as auroc_failed, by the same state.
    - nominal_calibration: expected calibration error of the score of "nominal", in ten bins.
    - average_precision: of each cause's score for being one of the causes, mean over the causes.
    - spearman_attribution, cosine_attribution: between scores and φ of a failed sample, mean.
    - deletion_gain: share of the error of a failed sample that goes when the cause named first is removed, mean.
    """
    labeled_N = samples.label != BORDERLINE
    failed_N = labeled_N & (samples.label != NOMINAL)
    shown_N = samples.shown != BORDERLINE
    called_failed_N = samples.nominal < samples.scores.max(axis=1)
    alarms_shown = ranking(samples.alarm[shown_N], samples.shown[shown_N] != NOMINAL, weights_B_N[:, shown_N])
    measures = {
        "state_accuracy": _state_accuracy(samples.label, called_failed_N, weights_B_N),
        "state_accuracy_shown": _state_accuracy(samples.shown, called_failed_N, weights_B_N),
        "auroc_failed_shown": alarms_shown["area"],
        **_of_alarm(samples.alarm[labeled_N], failed_N[labeled_N], weights_B_N[:, labeled_N]),
        "nominal_calibration": _calibration_error(
            samples.nominal[labeled_N], samples.label[labeled_N] == NOMINAL, weights_B_N[:, labeled_N]
        ),
    }
    if samples.names_causes:
        measures |= _of_causes(samples, labeled_N, failed_N, weights_B_N)
    return measures


def counted(samples: Judged, metric: str) -> np.ndarray:
    """Return which samples (N,) a measure is taken over: those of a label, and of these the nominal or the failed."""
    if metric in OF_SHOWN:
        return samples.shown != BORDERLINE
    labeled_N, nominal_N = samples.label != BORDERLINE, samples.label == NOMINAL
    if metric in OF_FAILED:
        return labeled_N & ~nominal_N
    return nominal_N if metric == "false_alarm_rate" else labeled_N


def _of_causes(samples: Judged, labeled_N, failed_N, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    right_N = samples.named == samples.label
    recalls = [_mean(right_N[of], weights_B_N[:, of]) for of in (samples.label == label for label in LABELS)]
    first_N = samples.scores.argmax(axis=1)
    of_failed = weights_B_N[:, failed_N]
    scores_F_3, phi_F_3 = samples.scores[failed_N], samples.phi[failed_N]
    precisions = [
        ranking(samples.scores[labeled_N, i], samples.causes[labeled_N, i], weights_B_N[:, labeled_N])["precision"]
        for i in range(len(CONCEPTS))
    ]
    rows_N = np.arange(len(samples))
    gain_N, tied_N = gains(samples)[rows_N, first_N], samples.tied[rows_N, first_N]
    return {
        **of_decisions(samples, weights_B_N),
        "tied_accuracy": _mean(tied_N[failed_N], of_failed),
        "balanced_accuracy": np.mean(recalls, axis=0),
        "dominant_accuracy": _mean((np.array(CONCEPTS)[first_N] == samples.label)[failed_N], of_failed),
        "average_precision": np.mean(precisions, axis=0),
        "spearman_attribution": _mean(_correlations(_ranks(scores_F_3), _ranks(phi_F_3)), of_failed),
        "cosine_attribution": _mean(_cosines(scores_F_3, np.maximum(phi_F_3, 0)), of_failed),
        "deletion_gain": _mean(gain_N[failed_N], of_failed),
    }


def of_decisions(samples: Judged, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    """Return regret and named_right, which judge what is named alone, whatever the other scores are."""
    labeled_N = samples.label != BORDERLINE
    failed_N = labeled_N & (samples.label != NOMINAL)
    gain_N_3, named_N_3 = gains(samples), samples.named[:, None] == np.array(CONCEPTS)
    regret_N = np.maximum(gain_N_3.max(axis=1), 0) - np.where(named_N_3, gain_N_3, 0).sum(axis=1)
    right_N = np.where(failed_N, (named_N_3 & samples.tied).any(axis=1), samples.named == samples.label)
    return {
        "regret": _mean(regret_N[failed_N], weights_B_N[:, failed_N]),
        "named_right": _mean(right_N[labeled_N], weights_B_N[:, labeled_N]),
    }


def gains(samples: Judged) -> np.ndarray:
    """Return (N, 3) the share of each sample's error that goes if a single cause is removed."""
    all_N = np.maximum(samples.error[:, ALL], 1e-9)
    return np.stack([1 - samples.error[:, ALL ^ 1 << cause] / all_N for cause in range(len(CONCEPTS))], axis=1)


def _state_accuracy(state_N: np.ndarray, called_failed_N: np.ndarray, weights_B_N: np.ndarray) -> np.ndarray:
    nominal_N = state_N == NOMINAL
    failed_N = ~nominal_N & (state_N != BORDERLINE)
    groups = ((nominal_N, ~called_failed_N), (failed_N, called_failed_N))
    return np.mean([_mean(right_N[of_N], weights_B_N[:, of_N]) for of_N, right_N in groups], axis=0)


def _of_alarm(alarm_N: np.ndarray, failed_N: np.ndarray, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    ranked = ranking(alarm_N, failed_N, weights_B_N)
    return {
        "auroc_failed": ranked["area"],
        "auprc_failed": ranked["precision"],
        "false_alarm_rate": ranked["false_alarms"],
    }


def ranking(score_N: np.ndarray, true_N: np.ndarray, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    """Return area under the ROC curve, average precision, and false alarms at `RECALL`; equal scores count together."""
    if not len(score_N):
        return dict.fromkeys(("area", "precision", "false_alarms"), np.full(len(weights_B_N), np.nan))
    order = np.argsort(-score_N, kind="stable")
    starts = np.flatnonzero(np.r_[True, np.diff(score_N[order]) != 0])
    true_B_G, false_B_G = (
        np.add.reduceat(weights_B_N[:, order] * of[order], starts, axis=1) for of in (true_N, ~true_N)
    )
    hits_B_G, alarms_B_G = np.cumsum(true_B_G, axis=1), np.cumsum(false_B_G, axis=1)
    positives_B, negatives_B = hits_B_G[:, -1], alarms_B_G[:, -1]
    with np.errstate(divide="ignore", invalid="ignore"):
        # A positive beats every negative that is ranked below it, and half of those beside it.
        below_B_G = negatives_B[:, None] - alarms_B_G + false_B_G / 2
        area_B = (true_B_G * below_B_G).sum(axis=1) / (positives_B * negatives_B)
        share_B_G = hits_B_G / np.maximum(hits_B_G + alarms_B_G, 1e-300)
        precision_B = (true_B_G * share_B_G).sum(axis=1) / positives_B
        enough_B = (hits_B_G >= RECALL * positives_B[:, None] - 1e-9).argmax(axis=1)
        alarms_B = np.take_along_axis(alarms_B_G, enough_B[:, None], axis=1)[:, 0] / negatives_B
    return {"area": area_B, "precision": precision_B, "false_alarms": alarms_B}


def _calibration_error(score_N: np.ndarray, true_N: np.ndarray, weights_B_N: np.ndarray) -> np.ndarray:
    bin_N = np.minimum((score_N * BINS).astype(int), BINS - 1)
    error_B = np.zeros(len(weights_B_N))
    for number in range(BINS):
        inside = bin_N == number
        error_B += np.abs((weights_B_N[:, inside] * (score_N - true_N)[inside]).sum(axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        return error_B / weights_B_N.sum(axis=1)


def _mean(value_N: np.ndarray, weights_B_N: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return (weights_B_N * value_N).sum(axis=1) / weights_B_N.sum(axis=1)


def _ranks(values_N_3: np.ndarray) -> np.ndarray:
    from scipy.stats import rankdata

    return rankdata(values_N_3, axis=1) if len(values_N_3) else values_N_3


def _correlations(a_N_3: np.ndarray, b_N_3: np.ndarray) -> np.ndarray:
    a_N_3, b_N_3 = (x - x.mean(axis=1, keepdims=True) for x in (a_N_3, b_N_3))
    return _cosines(a_N_3, b_N_3)


def _cosines(a_N_3: np.ndarray, b_N_3: np.ndarray) -> np.ndarray:
    """Return the cosine of each pair of rows, 0 where one of them is zero."""
    lengths_N = np.sqrt((a_N_3**2).sum(axis=1) * (b_N_3**2).sum(axis=1))
    return (a_N_3 * b_N_3).sum(axis=1) / np.where(lengths_N > 0, lengths_N, np.inf)
