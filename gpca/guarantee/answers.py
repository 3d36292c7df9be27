"""Scores of samples by models that were trained on other families, and sets and calls calibrated on yet other ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import floor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.causes.truth import NOMINAL
from gpca.errors import InputError
from gpca.evaluation.conformal import ALARM, GOOD, NOT_SURE
from gpca.evaluation.measures import ALL
from gpca.frames.source import REAL_WORLD
from gpca.guarantee.guarantee import STATES, calibrate, state_scores
from gpca.io.arrays import TEXT
from gpca.io.container import Container, array
from gpca.io.csv_file import read_numbers, write_csv
from gpca.io.files import Axes
from gpca.io.frame import Frame
from gpca.settings import OpenShare

SCORES = tuple(f"score_{label}" for label in LABELS)
TEXTS = ("model", "source", "sample", "family", "state")
NUMBERS = ("seed", "taught", "severity", "weight")  # columns
FAMILIES = "families"  # the condition under which the guarantee holds
VARIANTS = ("plain", "by_sample", "by_state", "by_family")
PLAIN, BY_SAMPLE, BY_STATE, BY_FAMILY = VARIANTS
WITH_ALARM = (PLAIN, BY_SAMPLE, BY_FAMILY)
SHIFTED = (BY_SAMPLE, BY_STATE)  # variants under shift
COVERAGE, SIZE, SINGLE = ("coverage", "set_size", "single_state")
MISSED, FALSE_ALARMS, UNSURE = RISKS = ("missed_failures", "false_alarms", "not_sure")
SHARES = (COVERAGE, SINGLE, *RISKS)
Measured = tuple[str, str, str, float, np.ndarray, np.ndarray]  # variant, metric, concept, promised, value_A, counted_A
EVEN = 0.5  # failure score of an alarm for explainers that are not trained


@dataclass(frozen=True)
class GuaranteeSettings:
    """What is guaranteed."""

    level: OpenShare = 0.9  # probability that a set holds the true state
    missed: OpenShare = 0.05  # largest probability that a failed registration is called good
    false_alarms: OpenShare = 0.05  # largest probability that a good registration is called failed
    family_risk: OpenShare = 0.1  # both for calibration by family; there are too few families for a smaller one


@dataclass(frozen=True)
class Scored(Container):
    """N scored samples: a sample occurs once for each model that scored it. Borderline samples are left out."""

    model: np.ndarray = array("N", TEXT)  # its name; scores of different models are never mixed
    source: np.ndarray = array("N", TEXT)
    seed: np.ndarray = array("N")
    sample: np.ndarray = array("N", TEXT)
    family: np.ndarray = array("N", TEXT)  # of shapes, or the scene of a depth frame
    state: np.ndarray = array("N", TEXT)  # the true one, of :data:`gpca.guarantee.guarantee.STATES`
    seen: np.ndarray = array("N")  # whether the model was trained on this sample
    severity: np.ndarray = array("N")  # of its perturbations, as a share of the largest in any sample
    weight: np.ndarray = array("N")  # of the sample in means
    scores: np.ndarray = array("N 4")  # of nominal and of the causes

    def save(self, path: str | Path, axes: Axes | None = None) -> None:
        """Write the CSV described in results/README.md."""
        import pandas as pd

        columns = {name: getattr(self, name) for name in (*TEXTS, "seed")} | {"taught": self.seen.astype(int)}
        columns |= {"severity": self.severity, "weight": self.weight} | dict(zip(SCORES, self.scores.T, strict=True))
        write_csv(path, pd.DataFrame(columns))

    @classmethod
    def load(cls, path: str | Path, expected: Axes | Container | None = None) -> Scored:
        """Read the CSV."""
        rows: Frame = read_numbers(path, (*TEXTS, *NUMBERS, *SCORES), (*NUMBERS, *SCORES))
        if unknown := set(rows["state"]) - set(STATES):
            raise InputError(path, f"unknown state '{min(unknown)}'", f"its states are {', '.join(STATES)}")
        return cls(
            **{name: rows[name].to_numpy(str) for name in TEXTS},
            seed=rows["seed"].to_numpy().astype(int),
            seen=rows["taught"].to_numpy() == 1,
            severity=rows["severity"].to_numpy(),
            weight=rows["weight"].to_numpy(),
            scores=rows[list(SCORES)].to_numpy(float),
        )


class Condition(NamedTuple):
    """Rows (N,) that may be calibrated on and those that are tested; ways of calibration to compare."""

    name: str
    calibration: np.ndarray
    tested: np.ndarray
    variants: tuple[str, ...]


@dataclass(frozen=True)
class SetsAndCalls:
    """Sets and calls for A tested rows."""

    row: np.ndarray  # (A,) numbers of the rows
    sets: dict[str, np.ndarray]  # variant -> (A, 5) which states are in the set
    calls: dict[str, np.ndarray]  # variant -> (A,) of :data:`gpca.evaluation.conformal.OUTCOMES`
    families: int  # the smallest number of families that any was calibrated on


def conditions(scored: Scored) -> list[Condition]:
    """The condition with a guarantee, and those without, as far as there are samples for them.

    They are calibrated on one source and tested on the others (from_{source}); on the half of the nominal and of the
    failed samples with less, or more, severity (milder, harder); on simulated registrations for depth frames (frames).
    """
    for_frames_N = np.char.startswith(scored.model, "frames")
    asked_N, real_N = ~scored.seen & ~for_frames_N, scored.source == REAL_WORLD
    listed = [Condition(FAMILIES, asked_N, asked_N, VARIANTS)]
    sources = list(dict.fromkeys(scored.source[asked_N].tolist()))
    for source in sources if len(sources) > 1 else []:
        inside_N = scored.source == source
        listed.append(Condition(f"from_{source}", asked_N & inside_N, asked_N & ~inside_N, SHIFTED))
    hard_N = np.zeros(len(scored), bool)
    for half_N in (scored.state == NOMINAL, scored.state != NOMINAL):
        if (half_N & asked_N).any():
            hard_N |= half_N & (scored.severity > np.median(scored.severity[half_N & asked_N]))
    listed.append(Condition("milder", asked_N & ~hard_N, asked_N & hard_N, SHIFTED))
    listed.append(Condition("harder", asked_N & hard_N, asked_N & ~hard_N, SHIFTED))
    if real_N.any():
        listed.append(Condition("frames", for_frames_N & ~real_N, real_N, SHIFTED))
    return listed


def answers_of(scored: Scored, condition: Condition, settings: GuaranteeSettings) -> SetsAndCalls | None:
    """Sets and calls for all tested rows, or None; a family's thresholds are calibrated on others, by one model."""
    probabilities_N_5 = state_scores(scored.scores)
    family_N = np.unique(scored.family, return_inverse=True)[1]
    limits = {name: getattr(settings, name) for name in ("level", "missed", "false_alarms")}
    risks = {"missed": settings.family_risk, "false_alarms": settings.family_risk}
    rows, sets, calls, counts = [], [], [], []
    for model in dict.fromkeys(scored.model[condition.tested].tolist()):
        model_N = scored.model == model
        failed_N = model_N & scored.seen & (scored.state != NOMINAL)
        for family in np.unique(family_N[model_N & condition.tested]):
            tested_N = model_N & condition.tested & (family_N == family)
            calibration_N = model_N & condition.calibration & (family_N != family)
            samples, families = (probabilities_N_5[calibration_N], scored.state[calibration_N]), family_N[calibration_N]
            ways: dict[str, dict] = {
                BY_SAMPLE: {},
                BY_STATE: {"by_state": True},
                BY_FAMILY: {"family_N": families} | risks,
            }
            made = {name: calibrate(*samples, **limits | ways[name]) for name in ways if name in condition.variants}
            tested_n_5 = probabilities_N_5[tested_N]
            failure_n = 1 - tested_n_5[:, 0]
            sets.append({name: each.sets(tested_n_5) for name, each in made.items()})
            calls.append({name: each.alarm(failure_n) for name, each in made.items() if name in WITH_ALARM})
            if PLAIN in condition.variants:
                sets[-1][PLAIN] = plain_sets(tested_n_5, settings.level)
                failures = 1 - probabilities_N_5[failed_N, 0]
                threshold = plain_threshold(failures, settings.missed) if len(failures) else EVEN
                calls[-1][PLAIN] = np.where(failure_n >= threshold, ALARM, GOOD)
            rows.append(np.flatnonzero(tested_N))
            counts.append(len(np.unique(families)))
    if not rows:
        return None
    return SetsAndCalls(
        np.concatenate(rows),
        {name: np.concatenate([part[name] for part in sets]) for name in sets[0]},
        {name: np.concatenate([part[name] for part in calls]) for name in calls[0]},
        min(counts),
    )


def plain_sets(probabilities_N_K: np.ndarray, level: float) -> np.ndarray:
    """The most probable states (N, K) until their uncalibrated probabilities add up to the level."""
    order_N_K = np.argsort(-probabilities_N_K, axis=1, kind="stable")
    ranked_N_K = np.take_along_axis(probabilities_N_K, order_N_K, axis=1)
    before_N_K = np.cumsum(ranked_N_K, axis=1) - ranked_N_K
    inside_N_K = np.zeros(probabilities_N_K.shape, bool)
    np.put_along_axis(inside_N_K, order_N_K, before_N_K < level - 1e-9, axis=1)
    return inside_N_K


def plain_threshold(failure_M: np.ndarray, missed: float) -> float:
    """Largest threshold below which at most this share of the failed samples lie."""
    return float(np.sort(failure_M)[min(floor(missed * len(failure_M) + 1e-9), len(failure_M) - 1)])


def measures(asked: Scored, answers: SetsAndCalls, settings: GuaranteeSettings) -> Iterator[Measured]:
    """Yield every measure of every variant (results/README.md), over all samples or those of each state."""
    everything_A, nominal_A = np.ones(len(asked), bool), asked.state == NOMINAL
    true_A_5 = asked.state[:, None] == np.array(STATES)
    for variant, inside_A_5 in answers.sets.items():
        holds_A, size_A = (inside_A_5 & true_A_5).any(axis=1).astype(float), inside_A_5.sum(axis=1).astype(float)
        for concept, counted_A in {ALL: everything_A, **dict(zip(STATES, true_A_5.T, strict=True))}.items():
            yield variant, COVERAGE, concept, settings.level, holds_A, counted_A
            yield variant, SIZE, concept, np.nan, size_A, counted_A
        yield variant, SINGLE, ALL, np.nan, (size_A == 1).astype(float), everything_A
    for variant, called_A in answers.calls.items():
        risks = (settings.family_risk,) * 2 if variant == BY_FAMILY else (settings.missed, settings.false_alarms)
        yield variant, MISSED, ALL, risks[0], (called_A == GOOD).astype(float), ~nominal_A
        yield variant, FALSE_ALARMS, ALL, risks[1], (called_A == ALARM).astype(float), nominal_A
        yield variant, UNSURE, ALL, np.nan, (called_A == NOT_SURE).astype(float), everything_A
