"""Draws the registrations of one source and seed by rejection, so that every state and cause has its share."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache
from math import exp, fsum
from pathlib import Path
from typing import Any

import numpy as np

from gpca.causes.candidate import Registrar, Unmeasurable, draw_applied, draw_candidate
from gpca.causes.dataset import Causes
from gpca.causes.measuring import Measuring, Subject, as_causes, measure_clean_pairs, read_subjects, split_by_object
from gpca.causes.settings import CauseSettings, Shares
from gpca.causes.truth import ALL, BORDERLINE, FAILED, GEOMETRY, NOMINAL, NONE, Truth
from gpca.errors import InputError
from gpca.io.csv_file import read_numbers, write_columns
from gpca.io.files import SPLITS
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.trivial import TRIVIAL, trivial_numbers
from gpca.process.progress import progress
from gpca.rigid import inverse, scale_translation
from gpca.seeds import generator

Group = tuple[str, bool]  # state or, of the failed, the dominant cause; whether there are several causes
TIED = " tied"  # after the cause of a candidate in which another adds as much to the error, up to the margin
GIVEN_AWAY = " given away"  # after the cause of a candidate that was refused for its trivial numbers
COLUMNS = ("split", "object", "group", "several", "kept", "refused")
UNSEEN: Group = ("any", False)  # of a candidate that was not registered


def apportion(total: int, shares: dict[str, float]) -> dict[str, int]:
    """Divide a number by shares that add up to one; the largest remainders get what is left."""
    exact = {name: total * share for name, share in shares.items()}
    parts = {name: int(value + 1e-9) for name, value in exact.items()}
    by_remainder = sorted(exact, key=lambda name: parts[name] - exact[name])
    for name in by_remainder[: total - sum(parts.values())]:
        parts[name] += 1
    return parts


class Quotas:
    """The samples, `total` in all, that are still wanted for one split."""

    def __init__(self, total: int, settings: CauseSettings) -> None:
        low, high = settings.several
        self._wanted = apportion(total, asdict(settings.shares))
        self._most: dict[Group, int] = {}  # so that the other kind can still reach its least number
        for name, count in self._wanted.items():
            fewest, most = (round(low * count), round(high * count)) if name in CONCEPTS else (0, 0)
            self._most |= {(name, False): count - fewest, (name, True): most}
        self.taken: Counter[Group] = Counter()

    def all_filled(self) -> bool:
        """Whether nothing is wanted any more."""
        return all(self._count(name) == wanted for name, wanted in self._wanted.items())

    def wants_applied(self, applied: np.ndarray) -> bool:
        """Whether a candidate with these causes (3,) could be wanted, whatever comes of it."""
        return any(self.wants_state(state, applied) for state in (NOMINAL, BORDERLINE, GEOMETRY, FAILED))

    def wants_state(self, state: str, applied: np.ndarray, accepted: np.ndarray | bool = True) -> bool:
        """Whether a candidate in this state could be wanted: one of its causes (3,) that is accepted may dominate."""
        if state != FAILED:
            return self.wants((state, False))
        kinds = (False, True) if applied.sum() > 1 else (False,)
        named = np.array(CONCEPTS)[applied & accepted].tolist()
        return any(self.wants((concept, several)) for concept in named for several in kinds)

    def wants(self, group: Group) -> bool:
        """Whether a candidate of this group is wanted."""
        return self.taken[group] < self._most[group] and self._count(group[0]) < self._wanted[group[0]]

    def refuse_to_go_on(self, source: str, seed: int, split: str, candidates: int) -> InputError:
        """Return the error to raise, which names the rarest group and what to widen."""
        unfilled = [name for name, wanted in self._wanted.items() if self._count(name) < wanted]
        # The least filled one; of several that are empty, the largest.
        name = min(unfilled, key=lambda name: (self._count(name) / self._wanted[name], -self._wanted[name]))
        state = "samples misaligned when clean" if name == GEOMETRY else f"{name} samples"
        if name in CONCEPTS:
            lacking = [several for several in (False, True) if self.wants((name, several))]
            kind = "" if len(lacking) == 2 else " among several causes" if lacking[0] else " alone"
            state = f"samples that failed from {name}{kind}"
        fault = f"{candidates} candidates yielded {self._count(name)} of {self._wanted[name]} {state}"
        remedy = f"change causes.severities, limits, points or several, or lower causes.shares.{name}"
        return InputError(f"causes of {source}, seed {seed}, {split}", fault, remedy)

    def _count(self, name: str) -> int:
        return self.taken[name, False] + self.taken[name, True]


def state_of(truth: Truth) -> str:
    """Return the state of the one sample of a truth; a clean pair that is off is a state of its own."""
    return GEOMETRY if truth.geometry[0] else str(truth.state[0])


def group_of(truth: Truth) -> Group:
    if (state := state_of(truth)) != FAILED:
        return state, False
    return str(truth.dominant[0]), bool(truth.causes[0].sum() > 1)


class Tally(Counter[tuple[str, str, str, bool, bool]]):
    """Numbers of candidates by split, object, group (or why there is no truth), several causes, and if kept."""

    def save(self, path: str | Path) -> None:
        """Write the CSV described in results/README.md."""
        keys = sorted({key[:-1] for key in self})
        rows = [(*key[:3], int(key[3]), self[*key, True], self[*key, False]) for key in keys]
        write_columns(path, dict(zip(COLUMNS, map(np.array, zip(*rows, strict=True)), strict=True)))


ENDS = (NONE,) * ALL + (ALL,)  # they tell the state, and so whether the others are worth their time


def draw_causes(
    objects: ObjectClouds, source: str, seed: int, settings: CauseSettings
) -> tuple[Causes, Tally, np.ndarray]:
    """Return candidates that are wanted, the tally, and the seconds (S,) of ICP; InputError for an unfilled group."""
    drawing = _Drawing(objects, source, seed, settings)
    records = [record for split in SPLITS for record in drawing.of_split(split)]
    causes, icp_seconds_S = as_causes(records, (source, seed))
    return causes, drawing.tally, icp_seconds_S


def draw_further(
    objects: ObjectClouds, source: str, seed: int, settings: CauseSettings, chunk: int, wanted: int
) -> Causes:
    """Draw training samples of all objects but borderline ones; two chunks have no candidate in common."""
    further = replace(_labeled_alone(settings), train=wanted)
    drawing = _Drawing(objects, source, seed, settings, further, ("further", chunk), every=True)
    return as_causes(drawing.of_split("train"), (source, seed))[0]


def draw_shifted(
    objects: ObjectClouds, source: str, seed: int, settings: CauseSettings
) -> tuple[Causes, Tally, np.ndarray]:
    """Draw the test samples of :func:`draw_causes` but borderline ones; groups that cannot be filled stay smaller."""
    drawing = _Drawing(objects, source, seed, settings, labeled := _labeled_alone(settings))
    records = drawing.up_to(settings.candidates * settings.test, "test", Quotas(settings.test, labeled))
    if not records:
        fault = f"none of {settings.candidates * settings.test} candidates is nominal or has failed from a cause"
        raise InputError(f"causes of {source}, seed {seed}", fault, "raise causes.candidates")
    causes, icp_seconds_S = as_causes(records, (source, seed))
    return causes, drawing.tally, icp_seconds_S


def _labeled_alone(settings: CauseSettings) -> CauseSettings:
    shares = asdict(settings.shares) | {BORDERLINE: 0.0, GEOMETRY: 0.0}
    return replace(settings, shares=Shares(**{name: share / sum(shares.values()) for name, share in shares.items()}))


class _Drawing:
    """Draws by settings of its own, for each split the objects of :func:`draw_causes`, or every object."""

    def __init__(
        self,
        objects: ObjectClouds,
        source: str,
        seed: int,
        settings: CauseSettings,
        drawn_by: CauseSettings | None = None,
        part: tuple = (),
        every: bool = False,
    ) -> None:
        subjects, uncertainty_limit = measure_clean_pairs(read_subjects(objects), source, seed, settings)
        whole = dict.fromkeys(SPLITS, subjects)
        self._subjects = whole if every else split_by_object(subjects, source, seed, settings)
        self._settings = drawn_by or settings
        self._measuring = Measuring(self._settings, uncertainty_limit)
        self._axes, self._part = (source, seed), part
        self.tally = Tally()

    def of_split(self, split: str) -> list[dict[str, Any]]:
        """Return the rows of one split; its candidates show its objects in turn."""
        wanted = getattr(self._settings, split)
        quotas, most = Quotas(wanted, self._settings), self._settings.candidates * wanted
        records = self.up_to(most, split, quotas)
        if not quotas.all_filled():
            raise quotas.refuse_to_go_on(*self._axes, split, most)
        return records

    def up_to(self, most: int, split: str, quotas: Quotas) -> list[dict[str, Any]]:
        """Return the rows that are wanted of so many candidates, or of fewer where nothing is wanted any more."""
        records: list[dict[str, Any]] = []
        title = "candidates of {}, seed {}, {}".format(*self._axes, split)
        for number in progress(range(most), title, total=None):
            subject = self._subjects[split][number % len(self._subjects[split])]
            record, group = self._try(split, number, subject, quotas)
            self.tally[split, subject.name, *group, record is not None] += 1
            if record is not None:
                quotas.taken[group] += 1
                records.append(record | {"sample": len(records), "split": split, "candidate": number})
            if quotas.all_filled():
                break
        return records

    def _try(self, split: str, number: int, subject: Subject, quotas: Quotas) -> tuple[dict[str, Any] | None, Group]:
        """Return the row of a candidate and its group; no row where it is refused, as soon as it cannot be wanted."""
        settings, measuring = self._settings, self._measuring
        axes = (*self._axes, "causes", *self._part, split, number)
        random = generator(*axes)
        applied = draw_applied(settings, random)
        if not quotas.wants_applied(applied):
            return None, UNSEEN
        registrar = Registrar(draw_candidate(subject.surface, applied, settings, random), settings)
        measured = measuring.counterfactuals(registrar, subject, axes, "starts")
        accepted = np.ones(len(CONCEPTS), bool)
        try:
            if settings.matched:
                numbers_10 = numbers_of(measuring.observed(registrar, subject, axes, most=1))
                accepted = generator(*axes, "matched").random() < Matching.load().acceptances(numbers_10)
                if not accepted.any():
                    return None, (f"{UNSEEN[0]}{GIVEN_AWAY}", False)
            state = state_of(measuring.truth(measured, ENDS))
            if not quotas.wants_state(state, applied, accepted):
                return None, (state, False)
            truth = measuring.truth(measured)
            group = group_of(truth)
            if not quotas.wants(group):
                return None, group
            if group[0] in CONCEPTS:
                if truth.margin[0] < settings.limits.margin:
                    return None, (f"{group[0]}{TIED}", group[1])
                if not accepted[CONCEPTS.index(group[0])]:
                    return None, (f"{group[0]}{GIVEN_AWAY}", group[1])
            record = {**measuring.observed(registrar, subject, axes), "truth": truth}
            if split == "test":
                record["again"] = measuring.truth(measuring.counterfactuals(registrar, subject, axes, "other starts"))
        except Unmeasurable as fault:
            return None, (str(fault), False)
        return record, group


# Samples are matched by their trivial numbers, so that these know nothing of the dominant cause (docs/appendix.md).
MATCHING = Path(__file__).with_name("matching.csv")
TERM_COLUMNS = ("term", "center", "scale", *CONCEPTS)
INTERCEPT = "1"
FARTHEST = 4.0  # scales, to which the numbers are clipped
LEAST = 0.1  # probability of the least probable cause; below that, hardly any candidate would pass
DIGITS = 9  # of a probability, so that the last ones of a processor decide nothing


def numbers_of(observed: Mapping[str, Any]) -> np.ndarray:
    """Return the trivial numbers (10,) of an explainer's view (:meth:`gpca.causes.measuring.Measuring.observed`)."""
    cloud, target = (observed[name].astype(np.float64) for name in ("cloud", "target"))
    T_init = inverse(scale_translation(observed["T_target_source_icp"], 1 / observed["diameter_m"]))
    return trivial_numbers(cloud, target, T_init, observed["fitness"], observed["inlier_rmse"])


def terms() -> list[str]:
    """Return the names of the terms: the intercept, the numbers, and their squares and products."""
    products = [f"{a}*{b}" for i, a in enumerate(TRIVIAL) for b in TRIVIAL[i:]]
    return [INTERCEPT, *TRIVIAL, *products]


@dataclass(frozen=True)
class Matching:
    """How probable each cause is by trivial numbers x (10,), by center, scale (10,) and weights (3, terms)."""

    center: np.ndarray
    scale: np.ndarray
    weights: np.ndarray

    @classmethod
    @cache
    def load(cls, path: Path = MATCHING) -> Matching:
        """Read the fitted weights; center and scale are in the rows of the numbers."""
        rows = read_numbers(path, TERM_COLUMNS, TERM_COLUMNS[1:], optional=TERM_COLUMNS[1:3])
        rows = rows.set_index("term").loc[terms()]
        numbers = rows.loc[list(TRIVIAL)]
        return cls(numbers["center"].to_numpy(), numbers["scale"].to_numpy(), rows[list(CONCEPTS)].to_numpy().T)

    def expanded(self, numbers_10: np.ndarray) -> np.ndarray:
        """Return the terms of trivial numbers."""
        z = np.clip((numbers_10 - self.center) / self.scale, -FARTHEST, FARTHEST)
        return np.concatenate([[1.0], z, *(z[i] * z[i:] for i in range(len(z)))])

    def acceptances(self, numbers_10: np.ndarray) -> np.ndarray:
        """Return the probabilities (3,) by which a candidate is accepted, by the dominant cause that it may have."""
        term_T = self.expanded(numbers_10)
        logits = [fsum((weights_T * term_T).tolist()) for weights_T in self.weights]
        odds = [exp(logit - max(logits)) for logit in logits]  # nothing else depends on the processor
        probabilities = [round(each / fsum(odds), DIGITS) for each in odds]
        if (least := min(probabilities)) < LEAST:
            return np.zeros(len(CONCEPTS))
        return least / np.array(probabilities)
