"""The truth about S registrations under every subset of the causes: subset b has cause i where bit i of b is set."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gpca.pairs.perturbation import CONCEPTS

SUBSETS = tuple(tuple(i for i in range(len(CONCEPTS)) if subset >> i & 1) for subset in range(2 ** len(CONCEPTS)))
NONE, ALL = 0, len(SUBSETS) - 1
BY_SIZE = tuple(sorted(range(len(SUBSETS)), key=lambda subset: (len(SUBSETS[subset]), subset)))  # as figures show them
# Of a value, by how many of the other concepts are present: |S|! (2 − |S|)! / 3!
WEIGHTS = (1 / 3, 1 / 6, 1 / 3)
NOMINAL, BORDERLINE, FAILED = ("nominal", "borderline", "failed")
LARGEST_ERROR = 0.5  # diameters: a pose that is farther off is as wrong as one can be
GEOMETRY = "geometry"  # the clean pair is off already: too little shape to hold the pose


def shapley_values(worth_S_8: np.ndarray) -> np.ndarray:
    """Return φ (S, 3), φ_i = Σ_{S ∌ i} |S|! (2 − |S|)! / 3! (v(S ∪ i) − v(S)), together v(all) − v(none)."""
    phi_S_3 = np.zeros((len(worth_S_8), len(CONCEPTS)))
    for i in range(len(CONCEPTS)):
        for subset, present in enumerate(SUBSETS):
            if i not in present:
                gain_S = worth_S_8[:, subset | 1 << i] - worth_S_8[:, subset]
                phi_S_3[:, i] += WEIGHTS[len(present)] * gain_S
    return phi_S_3


@dataclass(frozen=True)
class Truth:
    """The measurements of S registrations, and the limits that tell their states apart."""

    error: np.ndarray  # (S, 8) v, mean over the starts of min(ADD(-S), d/2) / d, with only those causes applied
    uncertainty: np.ndarray  # (S, 8) u against the clean pair of the same sample, nats
    nominal_limit: float  # of errors, see :class:`gpca.causes.settings.Limits`
    failed_limit: float
    cause_limit: float
    uncertainty_limit: float  # of a nominal registration, nats

    def __len__(self) -> int:
        return len(self.error)

    def subset(self, rows: np.ndarray) -> Truth:
        """Return the given rows."""
        return replace(self, error=self.error[rows], uncertainty=self.uncertainty[rows])

    @cached_property
    def phi(self) -> np.ndarray:
        """(S, 3) what each cause adds to the error; together v(all) − v(none)."""
        return shapley_values(self.error)

    @cached_property
    def state(self) -> np.ndarray:
        """(S,) ``nominal``, ``borderline`` or ``failed``."""
        error_S, uncertainty_S = self.error[:, ALL], self.uncertainty[:, ALL]
        nominal_S = (error_S < self.nominal_limit) & (uncertainty_S <= self.uncertainty_limit)
        return np.select([nominal_S, error_S > self.failed_limit], [NOMINAL, FAILED], BORDERLINE)

    @property
    def geometry(self) -> np.ndarray:
        """(S,) the clean pair is off by more than a nominal registration may be."""
        return self.error[:, NONE] >= self.nominal_limit

    @property
    def dominant(self) -> np.ndarray:
        """(S,) the concept that adds most to the error, in any state, or ``geometry`` where what is left is more."""
        named_S = np.array(CONCEPTS)[self.phi.argmax(axis=1)]
        return np.where(self.geometry & (self.error[:, NONE] > self.phi.max(axis=1)), GEOMETRY, named_S)

    @property
    def tied(self) -> np.ndarray:
        """(S, 3) whether each concept adds as much as the one that adds most, up to `cause_limit`."""
        return self.phi >= self.phi.max(axis=1, keepdims=True) - self.cause_limit

    @property
    def margin(self) -> np.ndarray:
        """(S,) by how much the largest φ exceeds the next one."""
        ranked_S_3 = np.sort(self.phi, axis=1)
        return ranked_S_3[:, -1] - ranked_S_3[:, -2]

    @property
    def causes(self) -> np.ndarray:
        """(S, 3) whether each concept is one of the causes."""
        return self.phi > self.cause_limit


def capped(error_N: np.ndarray) -> np.ndarray:
    """Return errors in diameters, none larger than `LARGEST_ERROR`."""
    return np.minimum(error_N, LARGEST_ERROR)
