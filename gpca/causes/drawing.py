"""Draws the registrations of one source and seed by rejection, so that every state and cause has its share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gpca.alignment.rigid import inverse, scale_translation, transform
from gpca.causes.candidate import draw_applied, draw_candidate
from gpca.causes.counterfactuals import Counterfactuals, Registrar, Unmeasurable
from gpca.causes.dataset import COLUMNS, Causes
from gpca.causes.quotas import UNSEEN, Group, Quotas, Tally, group_of, state_of
from gpca.causes.settings import CauseSettings, Shares
from gpca.causes.shapley import ALL, NONE, SUBSETS
from gpca.causes.subjects import Subject, measure_clean_pairs, read_subjects, split_by_object
from gpca.causes.truth import Truth, joined
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import as_registrations
from gpca.progress import progress
from gpca.seeds import generator

ENDS = (NONE,) * ALL + (ALL,)  # they tell the state, and so whether the others are worth their time


def draw_causes(
    objects: ObjectClouds, source: str, seed: int, settings: CauseSettings
) -> tuple[Causes, Tally, np.ndarray]:
    """Draw candidates, measure their causes and keep those that are wanted.

    What is random in a candidate comes from generators named by source, seed, split and its number. Which candidates
    are kept depends on how many samples are wanted.

    Returns:
        the registrations; how many candidates were kept and refused; the seconds (S,) that ICP took for the
        registration of each from its initial pose and the other starts.

    Raises:
        InputError: too few objects, no clean pair that can be registered, or a group that cannot be filled.
    """
    subjects, uncertainty_limit = measure_clean_pairs(read_subjects(objects), source, seed, settings)
    drawing = _Drawing(source, seed, settings, uncertainty_limit)
    records: list[dict[str, Any]] = []
    for split, of_split in split_by_object(subjects, source, seed, settings).items():
        records += drawing.of_split(split, of_split)
    causes, icp_seconds_S = _as_causes(records)
    return causes, drawing.tally, icp_seconds_S


def draw_geometry(
    objects: ObjectClouds, source: str, seed: int, settings: CauseSettings, wanted: Mapping[str, int], most: int
) -> Causes | None:
    """Draw what fails without any cause: candidates that :func:`draw_causes` refuses, of the same objects per split.

    Args:
        settings: those of the other causes.
        wanted: samples of each split, at most.
        most: candidates of each split.

    Returns:
        the registrations; None where a split has none.
    """
    subjects, uncertainty_limit = measure_clean_pairs(read_subjects(objects), source, seed, settings)
    alone = replace(
        settings,
        present=0.0,
        limits=replace(settings.limits, nominal=settings.limits.failed),
        shares=Shares(0, 0, 0, 0, 0, geometry=1),
    )
    drawing = _Drawing(source, seed, alone, uncertainty_limit)
    of_splits = [
        drawing.up_to(most, split, of_split, Quotas(wanted[split], alone))
        for split, of_split in split_by_object(subjects, source, seed, settings).items()
    ]
    return _as_causes([record for records in of_splits for record in records])[0] if all(of_splits) else None


@dataclass
class _Drawing:
    source: str
    seed: int
    settings: CauseSettings
    uncertainty_limit: float
    tally: Tally = field(default_factory=Tally)

    def of_split(self, split: str, subjects: list[Subject]) -> list[dict[str, Any]]:
        """Return the rows of one split; its candidates show its objects in turn."""
        wanted = getattr(self.settings, split)
        quotas = Quotas(wanted, self.settings)
        most = self.settings.candidates * wanted
        records = self.up_to(most, split, subjects, quotas)
        if not quotas.all_filled():
            raise quotas.refuse_to_go_on(self.source, self.seed, split, most)
        return records

    def up_to(self, most: int, split: str, subjects: list[Subject], quotas: Quotas) -> list[dict[str, Any]]:
        """Return the rows that are wanted of so many candidates, or of fewer where nothing is wanted any more."""
        records: list[dict[str, Any]] = []
        for number in progress(range(most), f"candidates of {self.source}, seed {self.seed}, {split}", total=None):
            subject = subjects[number % len(subjects)]
            record, group = self._try(split, number, subject, quotas)
            self.tally.count(split, subject.name, group, kept=record is not None)
            if record is not None:
                quotas.take(group)
                records.append(record | {"sample": len(records), "split": split, "candidate": number})
            if quotas.all_filled():
                break
        return records

    def _try(self, split: str, number: int, subject: Subject, quotas: Quotas) -> tuple[dict[str, Any] | None, Group]:
        """Return the row of a candidate and its group; no row where it is refused, as soon as it cannot be wanted."""
        axes = (self.source, self.seed, "causes", split, number)
        random = generator(*axes)
        applied = draw_applied(self.settings, random)
        if not quotas.wants_applied(applied):
            return None, UNSEEN
        registrar = Registrar(draw_candidate(subject.surface, applied, self.settings, random), self.settings)
        measured = self._counterfactuals(registrar, subject, axes, "starts")
        try:
            state = state_of(self._truth(measured, ENDS))
            if not quotas.wants_state(state, applied):
                return None, (state, False)
            truth = self._truth(measured)
            group = group_of(truth)
            if not quotas.wants(group):
                return None, group
            record = {**self._observed(registrar, subject, axes), "truth": truth}
            if split == "test":
                record["again"] = self._truth(self._counterfactuals(registrar, subject, axes, "other starts"))
        except Unmeasurable as fault:
            return None, (str(fault), False)
        return record, group

    def _counterfactuals(self, registrar: Registrar, subject: Subject, axes: tuple, starts: str) -> Counterfactuals:
        return Counterfactuals(registrar, subject.errors, self._twists(axes, starts), self.settings)

    def _twists(self, axes: tuple, starts: str) -> np.ndarray:
        shape = (self.settings.starts, 6)
        return generator(*axes, starts).normal(size=shape) * self.settings.deviation_6()

    def _truth(self, measured: Counterfactuals, subsets: Sequence[int] = range(len(SUBSETS))) -> Truth:
        """Return the truth of one candidate, with these in the places of all eight subsets."""
        limits = self.settings.limits
        return Truth(
            np.array([[measured.error(subset) for subset in subsets]]),
            np.array([[measured.uncertainty(subset) for subset in subsets]]),
            nominal_limit=limits.nominal,
            failed_limit=limits.failed,
            cause_limit=limits.cause,
            uncertainty_limit=self.uncertainty_limit,
        )

    def _observed(self, registrar: Registrar, subject: Subject, axes: tuple) -> dict[str, Any]:
        """Return what an explainer may see of a candidate, and what was done to it."""
        candidate = registrar.candidate
        xi_n_6 = self._twists(axes, "observed starts")
        xi_n_6[0] = 0
        causes = tuple(np.flatnonzero(candidate.applied).tolist())
        runs = registrar.run(causes, xi_n_6)
        # The source is what was observed, in the frame of the initial pose.
        T_true = inverse(candidate.start(causes))
        poses_n_m = [scale_translation(T @ T_true, subject.diameter_m) for T in runs.T_target_source_n]
        return {
            "object_index": subject.index,
            "object_name": subject.name,
            "diameter_m": subject.diameter_m,
            "cloud": transform(runs.T_target_source_n[0], candidate.observed(causes)).astype(np.float32),
            "target": candidate.model.astype(np.float32),
            "T_target_source_true": scale_translation(T_true, subject.diameter_m),
            "T_target_source_init": np.eye(4),
            "T_target_source_icp": poses_n_m[0],
            "fitness": runs.fitness_n[0],
            "inlier_rmse": runs.inlier_rmse_n[0],
            "icp_seconds": runs.icp_seconds,
            **{f"severity_{name}": value for name, value in candidate.severity.items()},
            "applied": candidate.applied,
            "symmetric": subject.symmetric,
            "T_target_source_runs": np.stack(poses_n_m),
            "fitness_runs": runs.fitness_n,
            "inlier_rmse_runs": runs.inlier_rmse_n,
        }


def _as_causes(records: list[dict[str, Any]]) -> tuple[Causes, np.ndarray]:
    truth = joined([record["truth"] for record in records])
    concept_S = np.array(CONCEPTS)[truth.phi.argmax(axis=1)]
    registrations, icp_seconds_S = as_registrations(
        [record | {"concept": concept} for record, concept in zip(records, concept_S, strict=True)]
    )
    columns = {name: np.array([record[name] for record in records]) for name in COLUMNS}
    again = joined([record["again"] for record in records if "again" in record])
    return Causes(registrations, **columns, truth=truth, truth_again=again), icp_seconds_S
