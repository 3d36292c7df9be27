"""Limits of the answers of a model, set on registrations that a user has labeled as right or wrong."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from gpca.causes.truth import NOMINAL
from gpca.errors import InputError
from gpca.evaluation.conformal import ROUNDING
from gpca.guarantee.guarantee import STATES, WHETHER_FAILED, calibrate, whether_failed
from gpca.model.diagnoser import LEVEL, MISSED, Diagnoser, threshold_of
from gpca.model.diagnosis import Diagnosis, state_probabilities
from gpca.model.result import ROUNDED, Calibrated

RIGHT, WRONG = "right", "wrong"
BOTH = "label some that are right and some that are wrong"
LABELS = (RIGHT, WRONG, *STATES[1:])  # a cause, or several, is the label of a wrong result


def require_labels(labels: Sequence[str], groups: Sequence[str] | None, names: Sequence[str]) -> None:
    """Raise an InputError for labels that are unknown or all alike, and for a missing group."""
    for name, label, group in zip(names, labels, groups or labels, strict=True):
        if label not in LABELS:
            raise InputError(name, f"has the label '{label}'", f"choose one of {', '.join(LABELS)}")
        if not group:
            raise InputError(name, "has no group", "give each registration a group, or none")
    if len({label == RIGHT for label in labels}) < 2:
        raise InputError("labels", f"are all {RIGHT if RIGHT in labels else WRONG}", BOTH)


@dataclass(frozen=True)
class LabeledRegistrations:
    """N diagnosed registrations, labeled at the tolerance of their diagnoses; those without a state are left out."""

    diagnoses: tuple[Diagnosis, ...]
    label_N: np.ndarray  # of `LABELS`
    group_N: np.ndarray | None  # families or scenes: the promise is for a new one. None: for others like these
    unknown: int = 0  # number of those left out
    risk: float = MISSED  # largest share of either wrong call

    @classmethod
    def of(
        cls,
        diagnoses: Sequence[Diagnosis],
        labels: Sequence[str],
        groups: Sequence[str] | None = None,
        names: Sequence[str] | None = None,
        risk: float = MISSED,
    ) -> LabeledRegistrations:
        """Check and combine them; an InputError names what cannot be."""
        names = names or [f"registration {number}" for number in range(len(diagnoses))]
        if {len(labels), len(groups or labels)} != {len(diagnoses)}:
            raise InputError("labels", f"are not one for each of {len(diagnoses)} registrations", "give one each")
        require_labels(labels, groups, names)
        before: dict[tuple, tuple[str, str]] = {}
        kept: list[tuple[Diagnosis, str, str]] = []
        for name, diagnosis, label, group in zip(names, diagnoses, labels, groups or labels, strict=True):
            # The same clouds give the same numbers, and others do not.
            key = diagnosis.result, diagnosis.start, diagnosis.unlikeness, diagnosis.expected_error
            other, earlier = before.setdefault(key, (name, label))
            if other is not name:
                fault = "is the registration of" if earlier == label else f"is '{label}' and contradicts '{earlier}' of"
                raise InputError(name, f"{fault} {other}", "label each registration once")
            if not diagnosis.void:
                kept.append((diagnosis, label, group))
        label_N = np.array([label for _, label, _ in kept], str)
        if len({label == RIGHT for label in label_N}) < 2:
            raise InputError("labeled registrations", "with a known state are not both right and wrong", BOTH)
        group_N = np.array([group for *_, group in kept], str) if groups else None
        return cls(tuple(each for each, *_ in kept), label_N, group_N, len(names) - len(kept), risk)

    def levels(self) -> list[Calibrated]:
        """Calibrate at the tolerance of the labels: at the ends of its range, if it differs between targets."""
        causes_N_3 = np.array([[*diagnosis.causes.values()] for diagnosis in self.diagnoses])
        result_N = np.array([diagnosis.result for diagnosis in self.diagnoses])
        scores_N_K, state_N = state_probabilities(causes_N_3, result_N), np.where(self._right_N, NOMINAL, self.label_N)
        states: tuple[str, ...] = STATES
        if not self._named:
            states = WHETHER_FAILED
            scores_N_K, state_N = whether_failed(scores_N_K), np.where(self._right_N, *WHETHER_FAILED)
        guarantee = calibrate(
            scores_N_K, state_N, self.group_N, states=states, level=LEVEL, missed=self.risk, false_alarms=self.risk
        )
        guarantee = replace(guarantee, labeled=True)
        threshold = guarantee.within(threshold_of(result_N[self._right_N], self.risk))
        return [Calibrated(tolerance, threshold, guarantee) for tolerance in self._ends]

    def set_in(self, diagnoser: Diagnoser) -> Diagnoser:
        """Return a diagnoser with these limits, which keeps others that a user has set at other tolerances alone."""
        low, high = self._ends[0] / ROUNDED, self._ends[-1] * ROUNDED
        others = (level for level in diagnoser.levels if level.guarantee and level.guarantee.labeled)
        kept = [level for level in others if not low <= level.tolerance <= high]
        levels = sorted([*kept, *self.levels()], key=lambda level: level.tolerance)
        return replace(diagnoser, levels=tuple(levels))

    def report(self) -> Iterator[str]:
        """Yield lines of text: what is promised, and how many more labels take what is not."""
        right, wrong = int(self._right_N.sum()), int((~self._right_N).sum())
        ends = " to ".join(f"{100 * end:.3g}" for end in self._ends)
        groups = "" if self.group_N is None else f" in {len(np.unique(self.group_N))} groups"
        left_out = f"; {self.unknown} of unknown state are left out" if self.unknown else ""
        yield f"labeled   {right} right and {wrong} wrong{groups}, within {ends} % of the diameter{left_out}"
        yield self._promise("missed", f"at most {self.risk:.0%} of failures are called good", 1 - self.risk, WRONG)
        yield self._promise("alarms", f"at most {self.risk:.0%} of good ones are called failed", 1 - self.risk, RIGHT)
        what = "the true state" if self._named else "right or wrong, whichever is true (some wrong ones lack a cause)"
        yield self._promise("sets", f"at least {LEVEL:.0%} of the sets contain {what}", LEVEL, "")

    @property
    def _named(self) -> bool:  # whether each wrong registration has its cause
        return not (self.label_N == WRONG).any()

    @property
    def _right_N(self) -> np.ndarray:
        return self.label_N == RIGHT

    @property
    def _ends(self) -> list[float]:
        shares = [diagnosis.tolerance_share for diagnosis in self.diagnoses]
        low, high = min(shares), max(shares)
        return [low] if high <= low * ROUNDED else [low, high]

    def _promise(self, name: str, words: str, level: float, among: str) -> str:
        among_N = {RIGHT: self._right_N, WRONG: ~self._right_N}.get(among, np.ones(len(self.label_N), bool))
        count = int(among_N.sum()) if self.group_N is None else len(np.unique(self.group_N[among_N]))
        more = ceil(level / (1 - level) - ROUNDING) - count
        if more <= 0:
            return f"{name:10}promised: {words}"
        what = f"{among} registrations".strip() if self.group_N is None else f"groups{among and f' with {among} ones'}"
        return f"{name:10}not yet: {words}; label {more} more {what}"
