"""Explainers without training: guessing, the most frequent label, and a rule of three lines."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from baselines.gates import GATES, NominalThreshold, motion_alarm
from baselines.pair import WITH_MOTION, WITH_RUNS
from gpca.causes.dataset import LABELS
from gpca.causes.truth import NOMINAL
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer, for_causes
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS, HalfTurn
from gpca.seeds import generator
from gpca.settings import PositiveShare

TILT = 1e-3  # of a score, by which the drawn order differs from a tie


class Chance(ScoringExplainer):
    """Equal scores for all labels, but for a `TILT` that orders them at random, sample by sample."""

    def __init__(self, source: str, seed: int) -> None:
        self._axes = (source, seed, "chance")

    def scores(self, registrations: Registrations) -> np.ndarray:
        samples = zip(registrations.split, registrations.sample, strict=True)
        ranks_N_C = [generator(*self._axes, *sample).permutation(len(self.labels)) for sample in samples]
        scores_N_C = 1 + TILT * np.array(ranks_N_C).reshape(len(registrations), len(self.labels))
        return scores_N_C / scores_N_C.sum(axis=1, keepdims=True)


class MostFrequent(ScoringExplainer):
    """Scores are the shares of the labels in training; of equal ones, the first is named."""

    def fit(self, registrations: Registrations) -> None:
        self._shares_C = np.array([(registrations.concept == label).mean() for label in self.labels])

    def scores(self, registrations: Registrations) -> np.ndarray:
        return np.tile(self._shares_C, (len(registrations), 1))


class Rule(ScoringExplainer):
    """Base of rules: turned, pose; else too little of it, overlap; else noise."""

    @staticmethod
    def named(turned_N: np.ndarray, missing_N: np.ndarray) -> np.ndarray:
        """Return the scores (N, 3), 1 of the concept that is named."""
        name_N = np.select([turned_N, missing_N], ["pose", "overlap"], "noise")
        return (name_N[:, None] == np.array(CONCEPTS)).astype(float)


class ThresholdRule(Rule):
    """ICP turned the observed cloud by more than `turned_deg`: pose; it has too few points: overlap; else noise."""

    def __init__(self, source: str, seed: int, turned_deg: HalfTurn = 5.0, complete: PositiveShare = 0.95) -> None:
        self._cosine = math.cos(math.radians(turned_deg))
        self._complete = complete

    def scores(self, registrations: Registrations) -> np.ndarray:
        R_init_N_3_3 = registrations.T_target_source_init[:, :3, :3]
        R_icp_N_3_3 = registrations.T_target_source_icp[:, :3, :3]
        cosine_N = ((R_init_N_3_3 * R_icp_N_3_3).sum(axis=(1, 2)) - 1) / 2
        points_N = np.diff(registrations.offsets) / np.diff(registrations.target_offsets)
        return self.named(cosine_N < self._cosine, points_N < self._complete)


class GatedRule(ScoringExplainer):
    """A rule, with "nominal" by the one of three gates (:mod:`baselines.gates`) that is best in training."""

    labels = LABELS

    def __init__(self, rule: Callable[[str, int], Rule], source: str, seed: int) -> None:
        self._rule = rule(source, seed)

    def fit(self, registrations: Registrations) -> None:
        """Choose the gate and its threshold; the rule learns from the failed."""
        label_N = registrations.concept
        self._rule.fit(registrations.subset(np.flatnonzero(label_N != NOMINAL)))
        fitted = {name: NominalThreshold().fit(motion_alarm(registrations, name), label_N) for name in GATES}
        self._gate = max(fitted, key=lambda name: fitted[name].accuracy)
        self._threshold = fitted[self._gate]

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return the score of nominal by the gate; the concept that the rule names has the rest."""
        return self._threshold.scores(motion_alarm(registrations, self._gate), self._rule.scores(registrations))


EXPLAINERS = {
    "chance": ExplainerEntry("Chance", Chance, ()),
    "most_frequent": ExplainerEntry("Most frequent label", MostFrequent, ()),
    "rule": ExplainerEntry("Rule of three lines", ThresholdRule, WITH_MOTION),
}
CAUSE_EXPLAINERS = {
    "chance": ExplainerEntry("Chance", for_causes(Chance), ()),
    "most_frequent": ExplainerEntry("Most frequent label", for_causes(MostFrequent), ()),
    "rule": ExplainerEntry(
        "Rule, nominal by the best gate", partial(GatedRule, ThresholdRule), WITH_RUNS, reads="descriptors"
    ),
}
