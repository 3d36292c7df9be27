"""Test samples with their truth and an explainer's predictions, and the measures (B,) of a diagnosis."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from gpca.attribution.diagnostics import augrc
from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.truth import ALL, BORDERLINE, FAILED, NOMINAL, Truth
from gpca.errors import InputError
from gpca.evaluation.intervals import ANYTHING, centered, mean_ranks, weighted_mean
from gpca.evaluation.measures import SHARE, Measure, source_method_seed
from gpca.io.container import require_same_samples
from gpca.io.frame import Frame
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import seed_of_file

CEILING = "ceiling"  # the truth, measured again from other starts: no explainer can be expected to do better
RECALL = 0.9  # of the failed, at which false alarms are counted
BINS = 10  # of the calibration error


@dataclass(frozen=True)
class SampleTruth:
    """N test samples with their truth, as in :class:`gpca.causes.dataset.Causes`, without their clouds."""

    truth: Truth
    truth_again: Truth
    cluster: np.ndarray
    symmetric: np.ndarray
    error_shown: np.ndarray


@dataclass(frozen=True)
class Judged:
    """N test samples with an explainer's predictions."""

    label: np.ndarray  # of :data:`gpca.causes.dataset.LABELS`, or ``borderline``
    instance: np.ndarray  # the object, views of one instance together
    seed: np.ndarray  # of the repeat
    error: np.ndarray  # (N, 8) v of every subset of the causes
    phi: np.ndarray  # (N, 3)
    causes: np.ndarray  # (N, 3) whether each is one of them
    tied: np.ndarray  # (N, 3) whether each adds as much as the dominant one, up to the limit of a cause
    margin: np.ndarray  # between the two largest φ
    shown: np.ndarray  # state of the registration that the explainer sees, by its own error
    symmetric: np.ndarray  # the error is ADD-S
    alarm: np.ndarray  # how wrong the explainer takes the registration to be, larger is worse
    scores: np.ndarray  # (N, 3) of the causes
    named: np.ndarray  # the label that it names; empty where it names none
    nominal: np.ndarray  # its score of "nominal"

    def __len__(self) -> int:
        return len(self.label)

    def subset(self, rows: np.ndarray) -> Judged:
        """Return the given rows, which may be a mask."""
        return Judged(*(getattr(self, field.name)[rows] for field in fields(Judged)))

    @property
    def names_causes(self) -> bool:
        """Whether the explainer says more than whether something is wrong."""
        return bool((self.named != "").any())


def read_judged(
    prediction_files: Iterable[str | Path], causes_files: Iterable[str | Path]
) -> dict[tuple[str, str, int], Judged]:
    """Return the test samples of every source, explainer and seed, as paths name them, those of the ceiling first."""
    truths, judged = {}, {}
    for path in causes_files:
        source, seed = Path(path).parent.name, seed_of_file(path)
        causes = Causes.load(path, (source, seed))
        truth = truths[source, seed] = causes.subset(causes.rows("test"))
        judged[source, CEILING, seed] = ceiling_of(truth, seed)
    for path in prediction_files:
        source, explainer, seed = source_method_seed(path)
        if (source, seed) not in truths:
            raise InputError(path, "its ground truth was not given", f"give causes/{source}/seed{seed}.npz")
        rows = read_predictions(path)
        rows = rows[rows["split"] == "test"]
        truth = truths[source, seed]
        require_same_samples(path, rows, truth.registrations.arrays, "causes", ("sample",))
        judged[source, explainer, seed] = judged_by(rows, truth, seed)
    if not judged:
        raise InputError("diagnoses", "no files were given", "name at least one explainer in diagnosis.explainers")
    return judged


def joined(parts: Iterable[Judged]) -> Judged:
    parts = list(parts)
    return Judged(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Judged)))


def judged_by(rows: Frame, truth: Causes, seed: int) -> Judged:
    """Return test samples with the predictions of a file whose rows are in the same order."""
    scores_N_4 = rows[[f"score_{label}" for label in LABELS]].to_numpy(float)
    return judged_of(truth, seed, scores_N_4, np.where(rows["abstained"], "", rows["concept_predicted"].to_numpy(str)))


def ceiling_of(tested: Causes | SampleTruth, seed: int) -> Judged:
    """Return test samples with the truth measured from other starts as their predictions."""
    again = tested.truth_again
    error_N = again.error[:, -1]
    shares_N_3 = np.maximum(again.phi, 0) + 1e-12
    shares_N_3 /= shares_N_3.sum(axis=1, keepdims=True)
    # A sample that lies between the limits this time is named by the nearer one.
    is_nominal_N = error_N < (again.nominal_limit + again.failed_limit) / 2
    scores_N_4 = np.column_stack([is_nominal_N.astype(float), ~is_nominal_N[:, None] * shares_N_3])
    named_N = np.where(is_nominal_N, NOMINAL, np.array(CONCEPTS)[again.phi.argmax(axis=1)])
    return judged_of(tested, seed, scores_N_4, named_N, error_N)


def judged_of(
    tested: Causes | SampleTruth,
    seed: int,
    scores_N_4: np.ndarray,
    named_N: np.ndarray,
    alarm_N: np.ndarray | None = None,
) -> Judged:
    """Return test samples with scores of labels and the label named, empty for none; alarms are 1 − nominal if None."""
    truth, shown_N = tested.truth, tested.error_shown
    return Judged(
        label=labels_of(truth),
        instance=tested.registrations.cluster if isinstance(tested, Causes) else tested.cluster,
        seed=np.full(len(truth), seed),
        error=truth.error,
        phi=truth.phi,
        causes=truth.causes,
        tied=truth.tied,
        margin=truth.margin,
        # A single registration has an error and no uncertainty.
        shown=np.select([shown_N < truth.nominal_limit, shown_N > truth.failed_limit], [NOMINAL, FAILED], BORDERLINE),
        symmetric=tested.symmetric,
        alarm=np.asarray(1 - scores_N_4[:, 0] if alarm_N is None else alarm_N, float),
        scores=scores_N_4[:, 1:],
        named=named_N,
        nominal=scores_N_4[:, 0],
    )


def _labeled(samples: Judged) -> np.ndarray:
    return samples.label != BORDERLINE


def _failed(samples: Judged) -> np.ndarray:
    return _labeled(samples) & (samples.label != NOMINAL)


def _shown(samples: Judged) -> np.ndarray:
    return samples.shown != BORDERLINE


# What :func:`measure` returns: the samples that each depends on, whether it is a share, and whether least is best.
MEASURES: Mapping[str, Measure] = {
    # The error that the best single removal would take away minus what the named cause's removal takes away, as a share
    # of the error; mean. Naming nominal, or nothing, removes nothing.
    "regret": Measure(counted=_failed, limits=ANYTHING, least_is_best=True),
    # As dominant_accuracy, but any cause counts whose φ is that of the dominant one up to the limit of a cause.
    "tied_accuracy": Measure(counted=_failed),
    "named_right": Measure(counted=_labeled),  # whose label is named, causes counted as in tied_accuracy
    # Area under the curve of generalized risk over coverage, of named_right by the largest score (Traub et al. 2024).
    "augrc": Measure(counted=_labeled, limits=ANYTHING, least_is_best=True),
    "balanced_accuracy": Measure(counted=_labeled),  # mean over nominal and causes of the share that is named rightly
    "dominant_accuracy": Measure(counted=_failed),  # whose dominant cause has the largest score among the causes
    "auroc_failed": Measure(counted=_labeled),  # how well the alarm tells failed from nominal
    "auprc_failed": Measure(counted=_labeled),
    # Share of the nominal above the alarm that finds 90 % of the failed.
    "false_alarm_rate": Measure(counted=lambda samples: samples.label == NOMINAL, least_is_best=True),
    # Expected calibration error of the score of "nominal", in ten bins.
    "nominal_calibration": Measure(counted=_labeled, limits=(0.0, 1.0), least_is_best=True),
    "state_accuracy": Measure(counted=_labeled),  # mean of the shares of the nominal and the failed that are called so
    "state_accuracy_shown": Measure(counted=_shown),  # by the state of that registration alone,
    "auroc_failed_shown": Measure(counted=_shown),  # whatever it does from other starts
    "average_precision": Measure(counted=_labeled),  # of each cause's score for being one of the causes, mean
    "spearman_attribution": Measure(counted=_failed, limits=ANYTHING),  # between scores and φ, mean
    "cosine_attribution": Measure(counted=_failed, limits=ANYTHING),
    # Share of the error that goes when the cause named first is removed, mean.
    "deletion_gain": Measure(counted=_failed, limits=ANYTHING),
}
SHARES = tuple(name for name, each in MEASURES.items() if each.limits is SHARE)
SMALLER_IS_BETTER = tuple(name for name, each in MEASURES.items() if each.least_is_best)


def measure(samples: Judged, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    """Return every measure (B,) of :data:`MEASURES` that the explainer has, of the samples themselves and of draws."""
    labeled_N, shown_N, failed_N = _labeled(samples), _shown(samples), _failed(samples)
    weights_B_n, weights_B_F = weights_B_N[:, labeled_N], weights_B_N[:, failed_N]
    called_failed_N = samples.nominal < samples.scores.max(axis=1)
    ranked = ranking(samples.alarm[labeled_N], failed_N[labeled_N], weights_B_n)
    alarms_shown = ranking(samples.alarm[shown_N], samples.shown[shown_N] != NOMINAL, weights_B_N[:, shown_N])
    score_n, is_nominal_n = samples.nominal[labeled_N], samples.label[labeled_N] == NOMINAL
    bin_n, calibration_B = np.minimum((score_n * BINS).astype(int), BINS - 1), np.zeros(len(weights_B_N))
    for number in range(BINS):
        inside_n = bin_n == number
        calibration_B += np.abs((weights_B_n[:, inside_n] * (score_n - is_nominal_n)[inside_n]).sum(axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        calibration_B /= weights_B_n.sum(axis=1)
    measures = {
        "state_accuracy": _state_accuracy(samples.label, called_failed_N, weights_B_N),
        "state_accuracy_shown": _state_accuracy(samples.shown, called_failed_N, weights_B_N),
        "auroc_failed_shown": alarms_shown["area"],
        "auroc_failed": ranked["area"],
        "auprc_failed": ranked["precision"],
        "false_alarm_rate": ranked["false_alarms"],
        "nominal_calibration": centered(calibration_B),
    }
    if not samples.names_causes:
        return measures
    right_N, rows_N, first_N = samples.named == samples.label, np.arange(len(samples)), samples.scores.argmax(axis=1)
    recalls = [weighted_mean(right_N[of], weights_B_N[:, of]) for of in (samples.label == label for label in LABELS)]
    precisions = [
        ranking(samples.scores[labeled_N, i], samples.causes[labeled_N, i], weights_B_n)["precision"]
        for i in range(len(CONCEPTS))
    ]
    scores_F_3, phi_F_3 = samples.scores[failed_N], samples.phi[failed_N]
    ranks = [np.array([mean_ranks(row) for row in of]).reshape(of.shape) for of in (scores_F_3, phi_F_3)]
    spearman_F = _cosines(*(ranks_F_3 - ranks_F_3.mean(axis=1, keepdims=True) for ranks_F_3 in ranks))
    return measures | {
        **decision_measures(samples, weights_B_N),
        "tied_accuracy": weighted_mean(samples.tied[rows_N, first_N][failed_N], weights_B_F),
        "balanced_accuracy": np.mean(recalls, axis=0),
        "dominant_accuracy": weighted_mean((np.array(CONCEPTS)[first_N] == samples.label)[failed_N], weights_B_F),
        "average_precision": np.mean(precisions, axis=0),
        "spearman_attribution": weighted_mean(spearman_F, weights_B_F),
        "cosine_attribution": weighted_mean(_cosines(scores_F_3, np.maximum(phi_F_3, 0)), weights_B_F),
        "deletion_gain": weighted_mean(gains(samples)[rows_N, first_N][failed_N], weights_B_F),
    }


def counted(samples: Judged, metric: str) -> np.ndarray:
    """Mask (N,) of the samples that a measure depends on; those with a label if it is none of `MEASURES`."""
    return MEASURES[metric].counted(samples) if metric in MEASURES else _labeled(samples)  # type: ignore[misc]


def decision_measures(samples: Judged, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    """Return regret and named_right, which judge what is named alone, and augrc, which judges how sure that is too."""
    labeled_N, failed_N = _labeled(samples), _failed(samples)
    gain_N_3, named_N_3 = gains(samples), samples.named[:, None] == np.array(CONCEPTS)
    regret_N = np.maximum(gain_N_3.max(axis=1), 0) - np.where(named_N_3, gain_N_3, 0).sum(axis=1)
    right_N = np.where(failed_N, (named_N_3 & samples.tied).any(axis=1), samples.named == samples.label)
    confidence_N = np.maximum(samples.nominal, samples.scores.max(axis=1))
    return {
        "augrc": augrc(confidence_N[labeled_N], ~right_N[labeled_N], weights_B_N[:, labeled_N]),
        "regret": weighted_mean(regret_N[failed_N], weights_B_N[:, failed_N]),
        "named_right": weighted_mean(right_N[labeled_N], weights_B_N[:, labeled_N]),
    }


def gains(samples: Judged) -> np.ndarray:
    """Return (N, 3) the share of each sample's error that goes if a single cause is removed."""
    all_N = np.maximum(samples.error[:, ALL], 1e-9)
    return np.stack([1 - samples.error[:, ALL ^ 1 << cause] / all_N for cause in range(len(CONCEPTS))], axis=1)


def _state_accuracy(state_N: np.ndarray, called_failed_N: np.ndarray, weights_B_N: np.ndarray) -> np.ndarray:
    nominal_N = state_N == NOMINAL
    failed_N = ~nominal_N & (state_N != BORDERLINE)
    groups = ((nominal_N, ~called_failed_N), (failed_N, called_failed_N))
    return np.mean([weighted_mean(right_N[group_N], weights_B_N[:, group_N]) for group_N, right_N in groups], axis=0)


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


def _cosines(a_N_3: np.ndarray, b_N_3: np.ndarray) -> np.ndarray:
    """Return the cosine of each pair of rows, 0 where one of them is zero."""
    lengths_N = np.sqrt((a_N_3**2).sum(axis=1) * (b_N_3**2).sum(axis=1))
    return (a_N_3 * b_N_3).sum(axis=1) / np.where(lengths_N > 0, lengths_N, np.inf)
