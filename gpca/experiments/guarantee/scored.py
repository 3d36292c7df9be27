"""Samples with the scores of one explainer, by models that learned from some families and not from others."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.errors import InputError
from gpca.guarantee.guarantee import STATES
from gpca.io.csv_file import read_numbers, write_csv

if TYPE_CHECKING:
    import pandas as pd

SCORES = tuple(f"score_{label}" for label in LABELS)
TEXTS = ("model", "source", "sample", "family", "state")
NUMBERS = ("seed", "taught", "severity", "weight")


@dataclass(frozen=True)
class Scored:
    """N answers: a sample occurs once for each model that was asked about it. Borderline samples are left out.

    Attributes:
        model: (N,) names what gave the scores. Those of different models are never mixed.
        source, seed, sample: (N,) what was asked about.
        family: (N,) of shapes, or the scene of a depth frame.
        state: (N,) the true one, of :data:`gpca.guarantee.guarantee.STATES`.
        taught: (N,) the model learned from this very sample.
        severity: (N,) of what was done to it, as a share of the most in any sample.
        weight: (N,) how much it counts.
        scores: (N, 4) of nominal and of the causes.
    """

    model: np.ndarray
    source: np.ndarray
    seed: np.ndarray
    sample: np.ndarray
    family: np.ndarray
    state: np.ndarray
    taught: np.ndarray
    severity: np.ndarray
    weight: np.ndarray
    scores: np.ndarray

    def __len__(self) -> int:
        return len(self.model)

    def subset(self, rows: np.ndarray) -> Scored:
        """Return the given rows, which may be a mask."""
        return Scored(*(getattr(self, field.name)[rows] for field in fields(Scored)))

    def save(self, path: str | Path) -> None:
        """Write the CSV described in results/README.md."""
        import pandas as pd

        columns = {name: getattr(self, name) for name in TEXTS} | {name: getattr(self, name) for name in NUMBERS}
        columns |= {"taught": self.taught.astype(int)} | dict(zip(SCORES, self.scores.T, strict=True))
        write_csv(path, pd.DataFrame(columns))

    @classmethod
    def load(cls, path: str | Path) -> Scored:
        """Read the CSV.

        Raises:
            InputError: the file is missing or damaged, or has an unknown state.
        """
        rows: pd.DataFrame = read_numbers(path, (*TEXTS, *NUMBERS, *SCORES), (*NUMBERS, *SCORES))
        if unknown := set(rows["state"]) - set(STATES):
            raise InputError(path, f"unknown state '{min(unknown)}'", f"its states are {', '.join(STATES)}")
        columns = {name: rows[name].to_numpy(str) for name in TEXTS} | {name: rows[name].to_numpy() for name in NUMBERS}
        columns |= {"seed": columns["seed"].astype(int), "taught": columns["taught"] == 1}
        return cls(**columns, scores=rows[list(SCORES)].to_numpy(float))


def joined(parts: Iterable[Scored]) -> Scored:
    """Return the answers of several one after the other."""
    parts = list(parts)
    return Scored(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Scored)))
