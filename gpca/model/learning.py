"""Learning a diagnosis from the registrations of several sources whose causes were measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gpca.causes.dataset import Causes, labels_of
from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import ALL
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.explainers.pair_classifier import PairClassifier
from gpca.features.dataset import Descriptors
from gpca.features.settings import GROUPS, DescriptorSettings
from gpca.model.diagnoser import SMALLEST_ERROR, Diagnoser

RIDGE = 10.0  # of the regression of the error, in samples


@dataclass(frozen=True)
class Lessons:
    """N registrations whose causes were measured.

    Attributes:
        features_N_F: their descriptors.
        label_N: nominal, a dominant cause, or borderline.
        causes_N_3: whether each concept is one of the causes.
        error_N: expected over the starts, diameters.
        unseen_N: they show objects that none of the others shows.
    """

    features_N_F: np.ndarray
    label_N: np.ndarray
    causes_N_3: np.ndarray
    error_N: np.ndarray
    unseen_N: np.ndarray

    @classmethod
    def of(cls, causes: Causes, descriptors: Descriptors) -> Lessons:
        """Return those of one source."""
        return cls(
            features_N_F=np.hstack([descriptors.groups[group] for group in GROUPS]),
            label_N=labels_of(causes.truth),
            causes_N_3=causes.truth.causes,
            error_N=causes.truth.error[:, ALL],
            unseen_N=causes.registrations.split == "test",
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
    descriptors: DescriptorSettings,
    false_alarms: float,
    *axes: object,
) -> tuple[Diagnoser, np.ndarray]:
    """Return what learned all lessons, and the BALD (nats) of failures of unseen objects.

    A first classifier learns without the unseen objects. Its threshold is the one that at most the share
    `false_alarms` of their nominal registrations reaches, and its BALD tells how uncertain a failure may be.
    """
    clear = lessons.subset(lessons.label_N != BORDERLINE)
    first = _classifier(clear.subset(~clear.unseen_N), gpc, *axes, "calibration")
    unseen = clear.subset(clear.unseen_N)
    judged = first.judge(first.normalized(unseen.features_N_F))
    nominal_N = unseen.label_N == NOMINAL
    classifier = _classifier(clear, gpc, *axes)
    diagnoser = Diagnoser(
        classifier=classifier,
        error_weights=fit_error(classifier.normalized(lessons.features_N_F), lessons.error_N),
        threshold=threshold_of(judged.failure_N[nominal_N], false_alarms),
        points=causes.points[1],
        runs=causes.runs(),
        descriptors=descriptors,
    )
    return diagnoser, judged.bald_N[~nominal_N]


def threshold_of(failure_N: np.ndarray, false_alarms: float) -> float:
    """Return the smallest probability of failure that at most the share `false_alarms` of nominal samples reaches.

    Raises:
        InputError: no samples.
    """
    if not len(failure_N):
        fault = "has no nominal registration of unseen objects"
        raise InputError("model", fault, "raise causes.test, causes.test_objects or causes.shares.nominal")
    return float(np.nextafter(np.quantile(failure_N, 1 - false_alarms, method="inverted_cdf"), 1))


def fit_error(inputs_N_F: np.ndarray, error_N: np.ndarray) -> np.ndarray:
    """Return the weights (F + 1,) of a ridge regression of ln error on normalized descriptors, the constant last."""
    from sklearn.linear_model import Ridge

    fitted = Ridge(alpha=RIDGE).fit(inputs_N_F, np.log(np.maximum(error_N, SMALLEST_ERROR)))
    return np.append(fitted.coef_, fitted.intercept_)


def _classifier(lessons: Lessons, gpc: GPCSettings, *axes: object) -> PairClassifier:
    return PairClassifier(gpc, *axes).fit(lessons.features_N_F, lessons.label_N != NOMINAL, lessons.causes_N_3)
