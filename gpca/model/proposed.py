"""Proposals for registrations whose errors are known: what a judge calls repaired is calibrated on them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import Causes
from gpca.causes.descriptors import observed_pair
from gpca.causes.measuring import Subject
from gpca.causes.settings import Moved
from gpca.causes.truth import capped
from gpca.guarantee.acceptance import accepted_below
from gpca.io.arrays import TEXT
from gpca.io.container import Container, array
from gpca.model.repair import Proposals, measured, propose, unrefined
from gpca.model.result import Calibrated, Evidence, ResultJudge
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.distances import ObservedPair
from gpca.reenactment.dataset import Reenactments
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, transform

FOLDS = 5  # of families, at most
Errors = Callable[[int, np.ndarray], np.ndarray]  # row, poses T_target_source (n, 4, 4) -> capped errors, diameters


@dataclass(frozen=True)
class Proposed(Container):
    """The proposals for N registrations, P each: the registered pose, then others, the first again with weight 0."""

    error_N_P: np.ndarray = array("N P", least=0)  # diameters, capped as those of causes
    weight_N_P: np.ndarray = array("N P", least=0, most=1)
    distance_N_P_K: np.ndarray = array("N P K", least=0)
    hypothesis_N_P_K: np.ndarray = array("N P K", least=0, most=1)  # probabilities
    inlier_rmse_N_P: np.ndarray = array("N P", least=0)
    fitness_N_P: np.ndarray = array("N P", least=0, most=1)
    family_N: np.ndarray = array("N", TEXT)

    def evidence(self, place: Any) -> Evidence:
        """What is read of some proposals, which are given as an index into (N, P)."""
        arrays = self.distance_N_P_K, self.hypothesis_N_P_K, self.inlier_rmse_N_P, self.fitness_N_P
        return Evidence(*(values[place] for values in arrays))

    def at(self, row: int) -> Proposals:
        """Return the proposals for one registration, without their poses."""
        count = self.error_N_P.shape[1]
        return Proposals(np.tile(np.eye(4), (count, 1, 1)), self.weight_N_P[row], self.evidence(row))

    def judge(self) -> ResultJudge:
        """Return a judge that learned from the registered poses."""
        return ResultJudge.fit(self.evidence(np.s_[:, 0]), self.error_N_P[:, 0])

    def probabilities(self, judge: ResultJudge, tolerance: float) -> np.ndarray:
        """Return the probability (N, P) of each pose to be off by more than the tolerance."""
        columns = range(self.error_N_P.shape[1])
        return np.column_stack([judge.probability(self.evidence(np.s_[:, column]), tolerance) for column in columns])

    def folds(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield rows of some families, and rows of all others."""
        from sklearn.model_selection import GroupKFold

        count = min(FOLDS, len(np.unique(self.family_N)))
        if count > 1:
            yield from GroupKFold(count).split(self.family_N, groups=self.family_N)


def pose_errors(causes: Causes, objects: ObjectClouds) -> Errors:
    """Return what measures the errors of poses of these registrations: ADD, or ADD-S of symmetric objects."""
    subjects: dict[tuple[int, bool], Subject] = {}

    def errors(row: int, T_n: np.ndarray) -> np.ndarray:
        registrations = causes.registrations
        key = int(registrations.object_index[row]), bool(causes.symmetric[row])
        if key not in subjects:
            subjects[key] = Subject.of(objects, *key)
        T_true = registrations.T_target_source("true", row)
        return capped(subjects[key].errors(np.array([T_true @ inverse(T) for T in T_n])))

    return errors


def propose_for(
    pair: ObservedPair, T_K: np.ndarray, weight_K: np.ndarray, icp: ICPSettings, moved: Moved, surface: ModelSurface
) -> Proposals:
    """Return the proposals for a pair under hypotheses (K, 4, 4), which the search has refined on all of its points."""
    before, registered = transform(pair.T_init, pair.observed), inverse(pair.T_init)
    measure = measured(before, pair.model, icp, moved)
    return propose(before, surface, registered, T_K, weight_K, unrefined, measure)


def proposed_for_all(
    causes: Causes, reenactments: Reenactments, errors: Errors, icp: ICPSettings, moved: Moved
) -> Proposed:
    proposals, error_N = [], []
    for row, hypotheses in enumerate(zip(reenactments.T_model_observed, reenactments.weight, strict=True)):
        pair = observed_pair(causes, row)
        proposals.append(propose_for(pair, *hypotheses, icp, moved, ModelSurface(pair.model)))
        error_N.append(errors(row, proposals[-1].T_n))
    return joined(proposals, error_N, causes.registrations.cluster)


def joined(proposals: Sequence[Proposals], errors: Sequence[np.ndarray], family_N: np.ndarray) -> Proposed:
    """Return proposals for N registrations, under as many hypotheses each, with the errors of their poses."""
    columns: list[tuple] = []
    for each, error_n in zip(proposals, errors, strict=True):
        count = each.evidence.weight_N_K.shape[1]  # as many as hypotheses, and one
        row_P = np.where(np.arange(count) < len(error_n), np.arange(count), 1)
        # Sums of probabilities may be rounded up.
        weight_P = np.where(np.arange(count) < len(error_n), each.weight_n[row_P], 0).clip(0, 1)
        columns.append((error_n[row_P], weight_P, *each.evidence.subset(row_P).arrays.values()))
    arrays = [*map(np.array, zip(*columns, strict=True)), np.asarray(family_N)]
    return Proposed(*arrays)


def with_repair(
    levels: Sequence[Calibrated], proposed: Proposed, result_N_of: Mapping[float, np.ndarray] | None = None
) -> tuple[Calibrated, ...]:
    """Return levels with the probability below which few of the called repaired are off, for unseen families."""
    probability_L_N_P = np.zeros((len(levels), *proposed.error_N_P.shape))
    for seen, unseen in proposed.folds():
        judge, asked = proposed.subset(seen).judge(), proposed.subset(unseen)
        probability_L_N_P[:, unseen] = [asked.probabilities(judge, level.tolerance) for level in levels]
    calibrated = []
    for level, probability_N_P in zip(levels, probability_L_N_P, strict=True):
        result_N = probability_N_P[:, 0] if result_N_of is None else result_N_of[level.tolerance]
        called = np.flatnonzero(result_N >= level.threshold)
        best_n = 1 + probability_N_P[called, 1:].argmin(axis=1)
        off_n = proposed.error_N_P[called, best_n] > level.tolerance
        below = accepted_below(probability_N_P[called, best_n], off_n, proposed.family_N[called])
        calibrated.append(replace(level, repaired_below=below))
    return tuple(calibrated)
