"""How many samples of each group are still wanted, so that rejection ends balanced; and the count of all candidates."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict
from pathlib import Path

import numpy as np

from gpca.causes.settings import CauseSettings
from gpca.causes.truth import BORDERLINE, FAILED, GEOMETRY, NOMINAL, Truth
from gpca.errors import InputError
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS

Group = tuple[str, bool]  # state or, of the failed, the dominant cause; whether there are several causes
COLUMNS = ("split", "object", "group", "several", "kept", "refused")
UNSEEN: Group = ("any", False)  # of a candidate that was not registered
REMEDIES = {
    NOMINAL: "lower causes.severities, raise causes.limits.nominal",
    BORDERLINE: "raise success.error",
    "noise": "raise causes.severities.noise or causes.severities.outliers, lower causes.points",
    "pose": "raise causes.severities.rotation_deg or causes.severities.translation",
    "overlap": "raise causes.severities.crop",
    GEOMETRY: "lower causes.points",
}


def apportion(total: int, shares: dict[str, float]) -> dict[str, int]:
    """Divide a number by shares that add up to one; the largest remainders get what is left."""
    exact = {name: total * share for name, share in shares.items()}
    parts = {name: int(value + 1e-9) for name, value in exact.items()}
    by_remainder = sorted(exact, key=lambda name: parts[name] - exact[name])
    for name in by_remainder[: total - sum(parts.values())]:
        parts[name] += 1
    return parts


class Quotas:
    """The samples that are still wanted for one split.

    Args:
        total: samples of the split.
    """

    def __init__(self, total: int, settings: CauseSettings) -> None:
        low, high = settings.several
        self._wanted = apportion(total, asdict(settings.shares))
        self._most: dict[Group, int] = {}  # so that the other kind can still reach its least number
        for name, count in self._wanted.items():
            fewest, most = (round(low * count), round(high * count)) if name in CONCEPTS else (0, 0)
            self._most |= {(name, False): count - fewest, (name, True): most}
        self._taken: Counter[Group] = Counter()

    def all_filled(self) -> bool:
        """Whether nothing is wanted any more."""
        return all(self._count(name) == wanted for name, wanted in self._wanted.items())

    def wants_applied(self, applied: np.ndarray) -> bool:
        """Whether a candidate with these causes (3,) could be wanted, whatever comes of it."""
        return any(self.wants_state(state, applied) for state in (NOMINAL, BORDERLINE, GEOMETRY, FAILED))

    def wants_state(self, state: str, applied: np.ndarray) -> bool:
        """Whether a candidate in this state with these causes (3,) could be wanted; its dominant cause is not known.

        A cause that was not applied is never dominant, and several causes need as many that were applied.
        """
        if state != FAILED:
            return self.wants((state, False))
        several_possible = applied.sum() > 1
        return any(
            self.wants((concept, several))
            for concept in np.array(CONCEPTS)[applied].tolist()
            for several in ((False, True) if several_possible else (False,))
        )

    def wants(self, group: Group) -> bool:
        """Whether a candidate of this group is wanted."""
        return self._taken[group] < self._most[group] and self._count(group[0]) < self._wanted[group[0]]

    def take(self, group: Group) -> None:
        """Count a candidate that is kept."""
        self._taken[group] += 1

    def refuse_to_go_on(self, source: str, seed: int, split: str, candidates: int) -> InputError:
        """Return the error to raise, which names the rarest group and what to widen."""
        unfilled = [name for name, wanted in self._wanted.items() if self._count(name) < wanted]
        # The least filled one; of several that are empty, the largest.
        name = min(unfilled, key=lambda name: (self._count(name) / self._wanted[name], -self._wanted[name]))
        samples = {
            NOMINAL: "nominal samples",
            BORDERLINE: "borderline samples",
            GEOMETRY: "samples misaligned when clean",
        }
        state = samples.get(name)
        change = ""
        if state is None:
            state = f"samples that failed from {name}"
            lacking = [several for several in (False, True) if self.wants((name, several))]
            if len(lacking) == 1:
                state += " among several causes" if lacking[0] else " alone"
                change = ", widen causes.several"
        fault = f"{candidates} candidates yielded {self._count(name)} of {self._wanted[name]} {state}"
        remedy = f"{REMEDIES[name]}{change}, or move part of causes.shares.{name} to another share"
        return InputError(f"causes of {source}, seed {seed}, {split}", fault, remedy)

    def _count(self, name: str) -> int:
        return self._taken[name, False] + self._taken[name, True]


def state_of(truth: Truth) -> str:
    """Return the state of the one sample of a truth; a clean pair that is off is a state of its own."""
    return GEOMETRY if truth.geometry[0] else str(truth.state[0])


def group_of(truth: Truth) -> Group:
    """Return the group of the one sample of a truth."""
    if (state := state_of(truth)) != FAILED:
        return state, False
    return str(truth.dominant[0]), bool(truth.causes[0].sum() > 1)


class Tally:
    """How many candidates were kept and refused, by split, object and group.

    A candidate that cannot be wanted is refused as soon as that is known: before any registration (group ``any``), or
    when its state is (group ``failed``). The others are those of `Quotas`, and the reasons that one has no truth.
    """

    def __init__(self) -> None:
        self._counts: Counter[tuple[str, str, str, bool, bool]] = Counter()

    def count(self, split: str, name: str, group: Group, kept: bool) -> None:
        """Count one candidate of the object `name`."""
        self._counts[split, name, *group, kept] += 1

    def save(self, path: str | Path) -> None:
        """Write the CSV described in results/README.md."""
        import pandas as pd

        rows = [
            (*key[:3], int(key[3]), self._counts[*key, True], self._counts[*key, False])
            for key in sorted({key[:-1] for key in self._counts})
        ]
        write_csv(path, pd.DataFrame(rows, columns=list(COLUMNS)))
