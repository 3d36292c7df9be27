"""Draws the registrations of one source and seed by rejection, so that every state and cause has its share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from gpca.causes.candidate import draw_applied, draw_candidate
from gpca.causes.counterfactuals import Registrar, Unmeasurable
from gpca.causes.dataset import Causes
from gpca.causes.measuring import Measuring, as_causes
from gpca.causes.quotas import UNSEEN, Group, Quotas, Tally, group_of, state_of
from gpca.causes.settings import CauseSettings, Shares
from gpca.causes.shapley import ALL, NONE
from gpca.causes.subjects import Subject, measure_clean_pairs, read_subjects, split_by_object
from gpca.objects.canonical import ObjectClouds
from gpca.process.progress import progress
from gpca.seeds import generator

ENDS = (NONE,) * ALL + (ALL,)  # they tell the state, and so whether the others are worth their time


def draw_causes(
    objects: ObjectClouds, source: str, seed: int, settings: CauseSettings
) -> tuple[Causes, Tally, np.ndarray]:
    """Draw candidates, measure their causes and keep those that are wanted.

    The random numbers of a candidate come from generators named by source, seed, split and its number. Which candidates
    are kept depends on how many samples are wanted.

    Returns:
        the registrations; how many candidates were kept and refused; the seconds (S,) that ICP took for the
        registration of each from its initial pose and the other starts.

    Raises:
        InputError: too few objects, no clean pair that can be registered, or a group that cannot be filled.
    """
    subjects, uncertainty_limit = measure_clean_pairs(read_subjects(objects), source, seed, settings)
    drawing = _Drawing(source, seed, settings, Measuring(settings, uncertainty_limit))
    records: list[dict[str, Any]] = []
    for split, of_split in split_by_object(subjects, source, seed, settings).items():
        records += drawing.of_split(split, of_split)
    causes, icp_seconds_S = as_causes(records, (source, seed))
    return causes, drawing.tally, icp_seconds_S


def draw_geometry(
    objects: ObjectClouds, source: str, seed: int, settings: CauseSettings, wanted: Mapping[str, int], most: int
) -> Causes | None:
    """Draw failures without a cause: candidates refused by :func:`draw_causes`, of the same objects per split.

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
    drawing = _Drawing(source, seed, alone, Measuring(alone, uncertainty_limit))
    of_splits = [
        drawing.up_to(most, split, of_split, Quotas(wanted[split], alone))
        for split, of_split in split_by_object(subjects, source, seed, settings).items()
    ]
    if not all(of_splits):
        return None
    return as_causes([record for records in of_splits for record in records], (source, seed))[0]


def draw_further(
    objects: ObjectClouds, source: str, seed: int, settings: CauseSettings, chunk: int, wanted: int
) -> Causes:
    """Draw training samples of the same objects as those of :func:`draw_causes`, and of the same states but borderline.

    Args:
        settings: those of the other causes.
        chunk: names the draws: two chunks have no candidate in common, and neither depends on the other.
        wanted: how many.

    Raises:
        InputError: see :func:`draw_causes`.
    """
    shares = asdict(settings.shares) | {"borderline": 0.0, "geometry": 0.0}
    labeled = {name: share / sum(shares.values()) for name, share in shares.items()}
    own = replace(settings, train=wanted, shares=Shares(**labeled))
    subjects, uncertainty_limit = measure_clean_pairs(read_subjects(objects), source, seed, settings)
    drawing = _Drawing(source, seed, own, Measuring(own, uncertainty_limit), part=("further", chunk))
    train = split_by_object(subjects, source, seed, settings)["train"]
    return as_causes(drawing.of_split("train", train), (source, seed))[0]


@dataclass
class _Drawing:
    source: str
    seed: int
    settings: CauseSettings
    measuring: Measuring
    tally: Tally = field(default_factory=Tally)
    part: tuple = ()  # more axes of the draws

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
        axes = (self.source, self.seed, "causes", *self.part, split, number)
        random = generator(*axes)
        applied = draw_applied(self.settings, random)
        if not quotas.wants_applied(applied):
            return None, UNSEEN
        registrar = Registrar(draw_candidate(subject.surface, applied, self.settings, random), self.settings)
        measured = self.measuring.counterfactuals(registrar, subject, axes, "starts")
        try:
            state = state_of(self.measuring.truth(measured, ENDS))
            if not quotas.wants_state(state, applied):
                return None, (state, False)
            truth = self.measuring.truth(measured)
            group = group_of(truth)
            if not quotas.wants(group):
                return None, group
            record = {**self.measuring.observed(registrar, subject, axes), "truth": truth}
            if split == "test":
                again = self.measuring.counterfactuals(registrar, subject, axes, "other starts")
                record["again"] = self.measuring.truth(again)
        except Unmeasurable as fault:
            return None, (str(fault), False)
        return record, group
