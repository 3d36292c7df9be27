"""Which conditions of a pair are run for which question, and how they are run for many registrations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cache, partial
from typing import Any

import numpy as np

from gpca.errors import InputError
from gpca.io.files import SPLITS
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS, SEVERITIES
from gpca.process.progress import progress
from gpca.seeds import generator, seed_of
from gpca.uncertainty.interventions import MIDDLE, UNTOUCHED, UPPER, Clouds, KnobRuns, Knobs, PairDraws, RemedyRuns
from gpca.uncertainty.outcomes import Outcomes
from gpca.uncertainty.settings import CORNERS, LATIN, SALTELLI, Remedies, UncertaintySettings
from gpca.uncertainty.spread import Spread, divergence

STEP = 0.1  # a local derivative takes this step, in the knob's range
KNOB_RANGE = np.subtract(UPPER, UNTOUCHED)
# The settings of design ``additive``: the corners, and a small step of one knob.
ADDITIVE_KNOBS = (
    *(Knobs(*np.where(switches, MIDDLE, UNTOUCHED)) for switches in CORNERS),
    *(Knobs(*np.where(row, UNTOUCHED + STEP * KNOB_RANGE, UNTOUCHED)) for row in np.eye(3, dtype=bool)),
)


@dataclass(frozen=True)
class Design:
    """K conditions (`CONDITIONS`): `evaluate` returns the outcomes for a pair with its starts and random numbers."""

    evaluate: Callable[[RegisteredRow, PairDraws], list[Spread]]
    reference: int = 0  # number of the clean condition
    splits: tuple[str, ...] = ("test",)  # which rows are evaluated
    oracle: bool = False  # whether it needs to know what was perturbed


class RegisteredRow:
    """The clouds of one registration, in units of the diameter; the target's points come in random order."""

    def __init__(self, registrations: Registrations, row: int) -> None:
        self.T_init = registrations.T_target_source("init", row)
        self.T_icp = registrations.T_target_source("icp", row)
        self.source = registrations.source(row)
        self.target = registrations.target(row).astype(np.float64)
        self._severity = {name: getattr(registrations, f"severity_{name}")[row] for name in SEVERITIES}

    def observed(self, points: int, random: np.random.Generator) -> Clouds:
        """Return source, target, initial pose and reference pose of the pair as it is, thinned to `points` points."""
        return self.source[random.permutation(len(self.source))[:points]], self.target[:points], self.T_init, self.T_icp

    def clean(self, points: int, part: int = 1) -> Clouds:
        """Return the clean pair at the true pose; its source is `part` 1 or 2 of the target, its target part 0."""
        points = min(points, len(self.target) // 3)
        source = self.target[part * points : (part + 1) * points]
        return source, self.target[:points], np.eye(4), np.eye(4)

    def true_knobs(self, settings: UncertaintySettings) -> Knobs:
        """Return the knobs that make what was perturbed, a pose error in units of the starts' one; NaN if hidden."""
        angle = np.rad2deg(self._severity["rotation_rad"]) / settings.start_rotation_deg
        length = self._severity["translation"] / settings.start_translation
        spread = np.max([UNTOUCHED.spread, angle, length])
        return Knobs(float(self._severity["noise"]), float(spread), float(self._severity["crop"]))


def _turned(design: str, pair: RegisteredRow, draws: PairDraws) -> list[Spread]:
    runs = KnobRuns(pair.observed(draws.settings.icp_points, draws.random), draws)
    return [runs(knobs) for knobs in knobs_of(design)]


def _removal(pair: RegisteredRow, draws: PairDraws) -> list[Spread]:
    runs = RemedyRuns((pair.source, pair.target, pair.T_init, pair.T_icp), draws)
    return [runs(Remedies(*switches)) for switches in CORNERS]


def _oracle(pair: RegisteredRow, draws: PairDraws) -> list[Spread]:
    runs, true = KnobRuns(pair.clean(draws.settings.icp_points), draws), pair.true_knobs(draws.settings)
    # Two of the three knobs are at rest, so the eight corners are two settings, and each is run once.
    return [runs(Knobs(*np.where(switches, true, UNTOUCHED))) for switches in CORNERS]


def _causal(pair: RegisteredRow, draws: PairDraws) -> list[Spread]:
    n = draws.settings.icp_points
    return [
        KnobRuns(clouds, draws)(UNTOUCHED)
        for clouds in (pair.clean(n, 1), pair.clean(n, 2), pair.observed(n, draws.random))
    ]


def knobs_of(design: str) -> Sequence[Knobs]:
    if design == "additive":
        return ADDITIVE_KNOBS
    turned = np.empty((0, 3)) if design == "observed" else sample_knobs(design)
    return UNTOUCHED, *(Knobs(*knobs) for knobs in turned)


@cache
def sample_knobs(kind: str) -> np.ndarray:
    """Return settings of the knobs (K, 3) up to their upper ends, through SALib, the same for every pair."""
    from SALib.sample import latin, sobol

    bounds = [list(limits) for limits in zip(UNTOUCHED, UPPER, strict=True)]
    problem = {"num_vars": len(UPPER), "names": list(Knobs._fields), "bounds": bounds}
    seed = seed_of("knobs", kind) % 2**32
    if kind == "latin":
        return latin.sample(problem, LATIN, seed=seed)
    return sobol.sample(problem, SALTELLI, calc_second_order=False, seed=seed)


DESIGNS = {
    # SHAP and local sensitivity as the paper describes them: fixed knobs on top of the observed pair.
    **{name: Design(partial(_turned, name)) for name in ("additive", "latin", "saltelli")},
    # The true knobs on a clean pair.
    "oracle": Design(_oracle, oracle=True),
    # Remedies applied to the observed pair; the clean run is the one with all of them.
    "removal": Design(_removal, reference=len(CORNERS) - 1, splits=SPLITS),
    # The observed pair alone, for explainers that need no more: the reference is itself, so the uncertainty is none.
    "observed": Design(partial(_turned, "observed"), splits=SPLITS),
    # Whether the pair is uncertain at all, beside a second clean pair.
    "causal": Design(_causal),
}


def design_rows(registrations: Registrations, design: str, samples: int | None) -> np.ndarray:
    """Return the rows that a design evaluates: of its splits, the first `samples` test samples (all if None)."""
    subject = f"uncertainty '{design}'"
    if samples is not None and samples % len(CONCEPTS):
        raise InputError(subject, f"{samples} samples do not balance the concepts", "give a multiple of 3")
    chosen = np.isin(registrations.split, DESIGNS[design].splits)
    if samples is not None:
        chosen &= (registrations.split != "test") | (registrations.sample < samples)
    if not chosen.any():
        raise InputError(subject, "has no registrations to evaluate", "increase their number")
    return np.flatnonzero(chosen)


def draws_of(
    registrations: Registrations, row: int, source: str, seed: int, settings: UncertaintySettings
) -> PairDraws:
    axes = (source, seed, "uncertainty", registrations.split[row], registrations.sample[row])
    xi_n_6 = generator(*axes, "starts").normal(size=(settings.starts, 6)) * settings.deviation_6()
    return PairDraws(xi_n_6, settings, generator(*axes, "clouds"))


def evaluate_design(
    design: str, registrations: Registrations, source: str, seed: int, settings: UncertaintySettings
) -> tuple[Outcomes, np.ndarray, np.ndarray]:
    """Run every condition of the design for every registration: outcomes, seconds (S, K) and those in ICP (S, K)."""
    entry = DESIGNS[design]
    observed = registrations if entry.oracle else registrations.without_labels()
    rows = []
    for i in progress(range(len(observed)), f"uncertainty ({design}) of {source}, seed {seed}"):
        rows.append(entry.evaluate(RegisteredRow(observed, i), draws_of(observed, i, source, seed, settings)))
    columns: dict[str, Any] = {
        field.name: np.array([[getattr(outcome, field.name) for outcome in row] for row in rows])
        for field in fields(Spread)
    }
    seconds_S_K, icp_seconds_S_K = columns.pop("seconds"), columns.pop("icp_seconds")
    clean = columns["covariance"][:, entry.reference, None]
    uncertainty_S_K = divergence(clean, columns["covariance"], settings.floor)
    outcomes = Outcomes(sample=observed.sample, split=observed.split, uncertainty=uncertainty_S_K, **columns)
    return outcomes, seconds_S_K, icp_seconds_S_K
