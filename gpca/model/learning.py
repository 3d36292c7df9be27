"""Learning a diagnosis from the registrations of several sources whose causes were measured.

Thresholds and promises are set on families of shapes that a classifier has not learned: the families are dealt into
folds, and each fold is judged by a classifier of the others. The one that is kept learns them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import ALL
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.explainers.pair_classifier import Judgment, PairClassifier
from gpca.guarantee.guarantee import Guarantee, calibrate
from gpca.guarantee.quantile import highest_level
from gpca.guarantee.states import states_of
from gpca.model.diagnoser import SMALLEST_ERROR, Diagnoser
from gpca.model.guaranteed import scores_of_states
from gpca.reenactment.dataset import Reenactments
from gpca.reenactment.features import reenactment_features
from gpca.reenactment.settings import ReenactmentSettings

MOST_REENACTED = 512  # points of a user's cloud: twice as many take twice the time and gain nothing
RIDGE = 10.0  # of the regression of the error, in samples
FOLDS = 3  # of the families
LEVEL = 0.9  # probability that a set of states holds the true one
MISSED = 0.05  # largest probability that a failure is called good


@dataclass(frozen=True)
class Lessons:
    """N registrations whose causes were measured.

    Attributes:
        features_N_F: their features (:func:`gpca.reenactment.features.reenactment_features`).
        label_N: nominal, a dominant cause, or borderline.
        state_N: the same, but ``several`` where a failure has several causes.
        causes_N_3: whether each concept is one of the causes.
        error_N: expected over the starts, diameters.
        family_N: of the shape that they show.
    """

    features_N_F: np.ndarray
    label_N: np.ndarray
    state_N: np.ndarray
    causes_N_3: np.ndarray
    error_N: np.ndarray
    family_N: np.ndarray

    @classmethod
    def of(cls, causes: Causes, reenactments: Reenactments) -> Lessons:
        """Return those of one source."""
        return cls(
            features_N_F=reenactment_features(reenactments),
            label_N=labels_of(causes.truth),
            state_N=states_of(causes.truth),
            causes_N_3=causes.truth.causes,
            error_N=causes.truth.error[:, ALL],
            family_N=causes.registrations.cluster,
        )

    def subset(self, rows_N: np.ndarray) -> Lessons:
        """Return the given rows."""
        return Lessons(**{name: array[rows_N] for name, array in vars(self).items()})


def joined(parts: Sequence[Lessons]) -> Lessons:
    """Return the lessons of several sources."""
    return Lessons(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])})


def learn(
    lessons: Lessons,
    gpc: GPCSettings,
    causes: CauseSettings,
    reenactment: ReenactmentSettings,
    false_alarms: float,
    *axes: object,
) -> tuple[Diagnoser, np.ndarray]:
    """Return what learned all lessons, and the BALD (nats) of failures of new families.

    The threshold of failure is the one that at most the share `false_alarms` of the nominal registrations of new
    families reaches.
    """
    clear = lessons.subset(lessons.label_N != BORDERLINE)
    judged = judged_unseen(clear, gpc, *axes)
    nominal_N = clear.label_N == NOMINAL
    threshold = threshold_of(judged.failure_N[nominal_N], false_alarms)
    classifier = _classifier(clear, gpc, *axes)
    diagnoser = Diagnoser(
        classifier=classifier,
        error_weights=fit_error(classifier.normalized(lessons.features_N_F), lessons.error_N),
        threshold=threshold,
        points=min(causes.points[1], MOST_REENACTED),
        runs=causes.runs(),
        moved=causes.moved,
        reenactment=reenactment,
        guarantee=promised(clear, judged, false_alarms),
        held_out=measured(clear, judged, threshold),
    )
    return diagnoser, judged.bald_N[~nominal_N]


def judged_unseen(lessons: Lessons, gpc: GPCSettings, *axes: object) -> Judgment:
    """Return the verdict on every registration by a classifier that has learned no other of its family.

    Raises:
        InputError: all show one family.
    """
    from sklearn.model_selection import GroupKFold

    if (families := len(np.unique(lessons.family_N))) < 2:
        raise InputError("model", "learns from objects of a single family", "add a source of others")
    parts = {name: np.full((len(lessons.label_N), *more), np.nan) for name, more in _JUDGED.items()}
    folds = GroupKFold(min(FOLDS, families)).split(lessons.label_N, groups=lessons.family_N)
    for fold, (known, unseen) in enumerate(folds):
        first = _classifier(lessons.subset(known), gpc, *axes, "calibration", fold)
        judged = first.judge(first.normalized(lessons.features_N_F[unseen]))
        for name, part in parts.items():
            part[unseen] = getattr(judged, name)
    return Judgment(**parts)


_JUDGED: dict[str, tuple[int, ...]] = {"failure_N": (), "causes_N_3": (3,), "causes_variances_N_3": (3,), "bald_N": ()}


def promised(lessons: Lessons, judged: Judgment, false_alarms: float) -> Guarantee:
    """Return the guarantee: sets that hold for a new family if there are enough families for that, and an alarm.

    The alarm, whose level is higher than there are families for, holds as far as registrations of a new family are like
    those of the others.
    """
    scores_N_5 = scores_of_states(judged)
    family_N = lessons.family_N if highest_level(0, lessons.family_N) >= LEVEL else None

    def calibrated(family_N: np.ndarray | None) -> Guarantee:
        states = (scores_N_5, lessons.state_N, family_N)
        return calibrate(*states, level=LEVEL, missed=MISSED, false_alarms=false_alarms)

    by_family, one_by_one = calibrated(family_N), calibrated(None)
    return Guarantee(by_family.state_sets, one_by_one.failure_alarm, by_family.samples, by_family.families)


def measured(lessons: Lessons, judged: Judgment, threshold: float) -> dict[str, float]:
    """Return how well registrations are judged (docs/causes.md), for the card of the model."""
    from sklearn.metrics import roc_auc_score

    failed_N = lessons.label_N != NOMINAL
    scores_N_4 = np.column_stack([1 - judged.failure_N, judged.failure_N[:, None] * judged.causes_N_3])
    right_N = np.array(LABELS)[scores_N_4.argmax(axis=1)] == lessons.label_N
    known = [label for label in LABELS if (lessons.label_N == label).any()]
    first_N = np.array(LABELS[1:])[judged.causes_N_3.argmax(axis=1)]
    alarm_N = judged.failure_N >= threshold
    both = failed_N.any() and not failed_N.all()
    return {
        "samples": float(len(failed_N)),
        "families": float(len(np.unique(lessons.family_N))),
        "balanced_accuracy": float(np.mean([right_N[lessons.label_N == label].mean() for label in known])),
        "dominant_accuracy": float((first_N == lessons.label_N)[failed_N].mean()) if failed_N.any() else 0.0,
        "auroc_failed": float(roc_auc_score(failed_N, judged.failure_N)) if both else 0.5,
        "false_alarms": float(alarm_N[~failed_N].mean()),
        "missed": float((~alarm_N)[failed_N].mean()) if failed_N.any() else 0.0,
    }


def threshold_of(failure_N: np.ndarray, false_alarms: float) -> float:
    """Return the smallest probability of failure that at most the share `false_alarms` of nominal samples reaches.

    Raises:
        InputError: no samples.
    """
    if not len(failure_N):
        raise InputError("model", "has no nominal registration", "raise causes.train or causes.shares.nominal")
    return float(np.nextafter(np.quantile(failure_N, 1 - false_alarms, method="inverted_cdf"), 1))


def fit_error(inputs_N_F: np.ndarray, error_N: np.ndarray) -> np.ndarray:
    """Return the weights (F + 1,) of a ridge regression of ln error on normalized descriptors, the constant last."""
    from sklearn.linear_model import Ridge

    fitted = Ridge(alpha=RIDGE).fit(inputs_N_F, np.log(np.maximum(error_N, SMALLEST_ERROR)))
    return np.append(fitted.coef_, fitted.intercept_)


def _classifier(lessons: Lessons, gpc: GPCSettings, *axes: object) -> PairClassifier:
    classifier = PairClassifier(gpc, *axes, trees=True)
    return classifier.fit(lessons.features_N_F, lessons.label_N != NOMINAL, lessons.causes_N_3)
