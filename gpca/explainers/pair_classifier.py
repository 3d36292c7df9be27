"""GP-CA's classifiers on the descriptors of a pair, averaged with boosted trees; variances and BALD are GP-CA's."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtri

from gpca.causes.truth import FAILED, NOMINAL
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.explainers.classifiers import BoostedQuestion
from gpca.io.container import Container, array
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import seed_of

QUANTILES = 100  # of each descriptor, at most
RANKED = 10_000  # samples of which the quantiles are taken, at most
FARTHEST = 3.0  # standard deviations, to which normalized descriptors are clipped
AT_THE_END = 1e-7  # a descriptor this close to its last quantile has reached it
NEIGHBORS = 3  # training samples to which the distance is averaged
USUAL = 0.99  # quantile of the training samples' distances that is the unit of unlikeness
ABSENT, PRESENT = "absent", "present"


class NormalizedFeatures:
    """Every descriptor, often with heavy tails, mapped to a normal distribution by its ranks in training."""

    def __init__(self, *axes: object) -> None:
        self._axes = axes

    def fit(self, features_N_F: np.ndarray) -> NormalizedFeatures:
        rows_N, seed = np.arange(len(features_N_F)), seed_of(*self._axes, "quantiles") % 2**32
        if len(rows_N) > RANKED:
            np.random.RandomState(seed).shuffle(rows_N)
        percents_Q = 100 * np.linspace(0, 1, min(QUANTILES, len(rows_N)))
        self.quantiles_Q_F = np.nanpercentile(features_N_F[rows_N[:RANKED]], percents_Q, axis=0)
        return self

    def __call__(self, features_N_F: np.ndarray) -> np.ndarray:
        """Return the normalized descriptors (N, F), as scikit-learn to the last digit; ties get their mean rank."""
        ranks_Q, ranks = np.linspace(0, 1, len(self.quantiles_Q_F)), []
        for values_N, quantiles_Q in zip(features_N_F.T, self.quantiles_Q_F.T, strict=True):
            from_above_N = -np.interp(-values_N, -quantiles_Q[::-1], -ranks_Q[::-1])
            ranks_N = 0.5 * (np.interp(values_N, quantiles_Q, ranks_Q) + from_above_N)
            ranks_N[values_N + AT_THE_END > quantiles_Q[-1]] = 1
            ranks_N[values_N - AT_THE_END < quantiles_Q[0]] = 0
            ranks.append(ranks_N)
        return ndtri(np.column_stack(ranks)).clip(-FARTHEST, FARTHEST)


@dataclass(frozen=True)
class Judgment(Container):
    """The probabilities of N pairs."""

    failure_N: np.ndarray = array("N")  # probability that the registration failed
    causes_N_3: np.ndarray = array("N 3")  # probability that each concept is one of the causes
    causes_variances_N_3: np.ndarray = array("N 3")  # their variances over the posterior draws (Eq. 5).
    bald_N: np.ndarray = array("N")  # the largest BALD of the four classifiers, nats (Eq. 7).


class PairClassifier:
    """Independent binary Gaussian processes: one for failure, and one for each cause."""

    def __init__(self, settings: GPCSettings, *axes: object, trees: bool = False) -> None:
        self._axes = axes
        self._with_trees = trees
        self._trees: list[BoostedQuestion] = []
        self.normalized = NormalizedFeatures(*axes)
        self._failure = GPC((NOMINAL, FAILED), settings, *axes, FAILED)
        self._causes = [GPC((ABSENT, PRESENT), settings, *axes, concept) for concept in CONCEPTS]

    def fit(self, features_N_F: np.ndarray, failed_N: np.ndarray, causes_N_3: np.ndarray) -> PairClassifier:
        inputs_N_F = self.normalized.fit(features_N_F)(features_N_F)
        self._failure.fit(inputs_N_F, np.where(failed_N, FAILED, NOMINAL))
        for gpc, present_N in zip(self._causes, causes_N_3.T, strict=True):
            gpc.fit(inputs_N_F, np.where(present_N, PRESENT, ABSENT))
        if self._with_trees:
            questions = zip((FAILED, *CONCEPTS), (failed_N, *causes_N_3.T), strict=True)
            self._trees = [BoostedQuestion.fit(inputs_N_F, yes_N, *self._axes, name) for name, yes_N in questions]
        return self

    def judge(self, inputs_N_F: np.ndarray) -> Judgment:
        """Return the probabilities for descriptors that `normalized` has mapped."""
        judged = [gpc.attribute(inputs_N_F) for gpc in (self._failure, *self._causes)]
        yes_N_4 = np.column_stack([scores_N_2[:, 1] for scores_N_2, _, _ in judged])
        if self._trees:
            yes_N_4 = (yes_N_4 + np.column_stack([trees.probability(inputs_N_F) for trees in self._trees])) / 2
        return Judgment(
            failure_N=yes_N_4[:, 0],
            causes_N_3=yes_N_4[:, 1:],
            causes_variances_N_3=np.column_stack([variances_N_2[:, 1] for _, variances_N_2, _ in judged[1:]]),
            bald_N=np.max([bald_N for _, _, bald_N in judged], axis=0),
        )

    def unlikeness(self, inputs_N_F: np.ndarray) -> np.ndarray:
        """Return the mean distance (N,) to the nearest training samples, in units of their quantile `USUAL`."""
        learned = self._failure.learned_N_d
        return _to_nearest(self._failure.project(inputs_N_F).inputs_N_d, learned, 0) / self.usual_distance

    @cached_property
    def usual_distance(self) -> float:
        """The quantile `USUAL`; a model file keeps it, as all distances among the samples take a fifth of a second."""
        learned = self._failure.learned_N_d
        return float(np.quantile(_to_nearest(learned, learned, 1), USUAL))

    @property
    def samples(self) -> int:
        return len(self._failure.learned_N_d)

    def state(self) -> dict[str, object]:
        """Return arrays, numbers and names for :meth:`from_state`; the same inputs of all four as one array."""
        failure, *causes = (gpc.state() for gpc in (self._failure, *self._causes))
        for gpc, state in zip(self._causes, causes, strict=True):
            if np.array_equal(gpc.learned_N_d, self._failure.learned_N_d):
                state["labelled"] = failure["labelled"]
        trees = {"trees": [vars(trees) for trees in self._trees]} if self._trees else {}
        usual = {"usual_distance": self.usual_distance}
        return {"quantiles": self.normalized.quantiles_Q_F, "failure": failure, "causes": causes, **usual, **trees}

    @classmethod
    def from_state(cls, state: dict) -> PairClassifier:
        made = cls.__new__(cls)
        made.normalized = NormalizedFeatures()
        made.normalized.quantiles_Q_F = state["quantiles"]
        made._failure = GPC.from_state(state["failure"])
        made._causes = [GPC.from_state(part) for part in state["causes"]]
        made._trees = [BoostedQuestion(**part) for part in state.get("trees", ())]
        if "usual_distance" in state:  # added by version 5
            made.usual_distance = state["usual_distance"]
        return made


def _to_nearest(inputs_N_F: np.ndarray, learned_M_F: np.ndarray, skipped: int) -> np.ndarray:
    """Mean distance (N,) to the nearest `NEIGHBORS` samples after the skipped ones (a sample itself)."""
    from scipy.spatial.distance import cdist

    nearest_N_M = np.sort(cdist(inputs_N_F, learned_M_F), axis=1)
    return nearest_N_M[:, skipped : skipped + NEIGHBORS].mean(axis=1)
