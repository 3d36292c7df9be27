"""Sets and calls for every sample, each calibrated on other families: the tested one is left out, one after another."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import numpy as np

from gpca.causes.truth import NOMINAL
from gpca.experiments.guarantee.scored import Scored
from gpca.experiments.guarantee.settings import GuaranteeSettings
from gpca.frames.source import REAL_WORLD
from gpca.guarantee.conformal import ALARM, GOOD
from gpca.guarantee.guarantee import calibrate, state_scores

FAMILIES = "families"  # the condition in which the promises are made
PLAIN, BY_SAMPLE, BY_STATE, CONFIDENT, BY_FAMILY = VARIANTS = (
    "plain",
    "by_sample",
    "by_state",
    "confident",
    "by_family",
)
OF_SETS = (PLAIN, BY_SAMPLE, BY_STATE, BY_FAMILY)
OF_ALARMS = (PLAIN, BY_SAMPLE, CONFIDENT, BY_FAMILY)
SHIFTED = (BY_SAMPLE, BY_STATE)  # variants under shift
EVEN = 0.5  # score of failure from which an explainer that learned from nothing says that it failed


@dataclass(frozen=True)
class Condition:
    """What is calibrated on, and what is tested.

    Attributes:
        name: ``families``, ``from_{source}``, ``milder``, ``harder`` or ``frames``: what was calibrated on.
        known, tested: (N,) which answers may be calibrated on, and which are tested.
        variants: those that are tried.
    """

    name: str
    known: np.ndarray
    tested: np.ndarray
    variants: tuple[str, ...]


@dataclass(frozen=True)
class Answers:
    """What was said of A tested answers.

    Attributes:
        row: (A,) their rows.
        sets: variant -> (A, 5) which states are in the set.
        calls: variant -> (A,) of :data:`gpca.guarantee.conformal.OUTCOMES`.
        families: the smallest number of families that any was calibrated on.
    """

    row: np.ndarray
    sets: dict[str, np.ndarray]
    calls: dict[str, np.ndarray]
    families: int


def conditions(scored: Scored) -> list[Condition]:
    """Return the promised condition, and those under which nothing is promised, as far as there are samples for them.

    - from_{source}: calibrated on one source and tested on the others;
    - milder, harder: calibrated on the half of the samples of less, or more, severity, and tested on the other half;
      nominal and failed samples are halved each by themselves;
    - frames: calibrated on simulated registrations and tested on those of depth frames.
    """
    of_frames_N = np.char.startswith(scored.model, "frames")
    asked_N, real_N = ~scored.taught & ~of_frames_N, scored.source == REAL_WORLD
    found = [Condition(FAMILIES, asked_N, asked_N, VARIANTS)]
    sources = list(dict.fromkeys(scored.source[asked_N].tolist()))
    found += [
        Condition(f"from_{source}", asked_N & (scored.source == source), asked_N & (scored.source != source), SHIFTED)
        for source in (sources if len(sources) > 1 else [])
    ]
    hard_N = _more_severe(scored, asked_N)
    found += [
        Condition("milder", asked_N & ~hard_N, asked_N & hard_N, SHIFTED),
        Condition("harder", asked_N & hard_N, asked_N & ~hard_N, SHIFTED),
    ]
    if real_N.any():
        found.append(Condition("frames", of_frames_N & ~real_N, real_N, SHIFTED))
    return found


def _more_severe(scored: Scored, asked_N: np.ndarray) -> np.ndarray:
    hard_N = np.zeros(len(scored), bool)
    for of_N in (scored.state == NOMINAL, scored.state != NOMINAL):
        if (of_N & asked_N).any():
            hard_N |= of_N & (scored.severity > np.median(scored.severity[of_N & asked_N]))
    return hard_N


def answers_of(scored: Scored, condition: Condition, settings: GuaranteeSettings) -> Answers | None:
    """Return the sets and calls for all that is tested, or None where nothing is.

    Every family is tested with thresholds that were set on the scores that the same model gave other families, none of
    which it learned from.
    """
    probabilities_N_5 = state_scores(scored.scores)
    family_N = np.unique(scored.family, return_inverse=True)[1]
    rows, sets, calls, counts = [], [], [], []
    for model in dict.fromkeys(scored.model[condition.tested].tolist()):
        of_model = scored.model == model
        for family in np.unique(family_N[of_model & condition.tested]):
            tested = np.flatnonzero(of_model & condition.tested & (family_N == family))
            known = np.flatnonzero(of_model & condition.known & (family_N != family))
            taught = np.flatnonzero(of_model & scored.taught)
            of_sets, of_calls = _said(
                probabilities_N_5, scored.state, family_N, known, taught, tested, condition, settings
            )
            rows.append(tested)
            sets.append(of_sets)
            calls.append(of_calls)
            counts.append(len(np.unique(family_N[known])))
    if not rows:
        return None
    return Answers(
        np.concatenate(rows),
        {name: np.concatenate([of_part[name] for of_part in sets]) for name in sets[0]},
        {name: np.concatenate([of_part[name] for of_part in calls]) for name in calls[0]},
        min(counts),
    )


def _said(
    probabilities_N_5, state_N, family_N, known, taught, tested, condition: Condition, settings: GuaranteeSettings
):
    """Return the sets and the calls (n, …) for the tested rows by each variant."""
    asked_n_5 = probabilities_N_5[tested]
    failure_n = 1 - asked_n_5[:, 0]
    samples = (probabilities_N_5[known], state_N[known])
    promised = {name: getattr(settings, name) for name in ("level", "missed", "false_alarms", "nonconformity")}
    risks = {"missed": settings.family_risk, "false_alarms": settings.family_risk}
    made = {
        BY_SAMPLE: lambda: calibrate(*samples, **promised),
        BY_STATE: lambda: calibrate(*samples, **promised, by_state=True),
        CONFIDENT: lambda: calibrate(*samples, **promised, confidence=settings.confidence),
        BY_FAMILY: lambda: calibrate(*samples, family_N[known], **promised | risks),
    }
    guarantees = {name: make() for name, make in made.items() if name in condition.variants}
    sets = {name: guarantee.sets(asked_n_5) for name, guarantee in guarantees.items() if name in OF_SETS}
    calls = {name: guarantee.alarm(failure_n) for name, guarantee in guarantees.items() if name in OF_ALARMS}
    if PLAIN in condition.variants:
        sets[PLAIN] = plain_sets(asked_n_5, settings.level)
        failed = taught[state_N[taught] != NOMINAL]
        threshold = plain_threshold(1 - probabilities_N_5[failed, 0], settings.missed) if len(failed) else EVEN
        calls[PLAIN] = np.where(failure_n >= threshold, ALARM, GOOD)
    return sets, calls


def plain_sets(probabilities_N_K: np.ndarray, level: float) -> np.ndarray:
    """Return (N, K) the most probable states until their probabilities, as they stand, add up to the level."""
    order_N_K = np.argsort(-probabilities_N_K, axis=1, kind="stable")
    ranked_N_K = np.take_along_axis(probabilities_N_K, order_N_K, axis=1)
    before_N_K = np.cumsum(ranked_N_K, axis=1) - ranked_N_K
    inside_N_K = np.zeros(probabilities_N_K.shape, bool)
    np.put_along_axis(inside_N_K, order_N_K, before_N_K < level - 1e-9, axis=1)
    return inside_N_K


def plain_threshold(failure_M: np.ndarray, missed: float) -> float:
    """Return the largest threshold below which at most this share of the failed samples lie."""
    return float(np.sort(failure_M)[min(floor(missed * len(failure_M) + 1e-9), len(failure_M) - 1)])
