"""Matches samples by their trivial numbers, so that these know nothing of the dominant cause (docs/appendix.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from math import exp, fsum
from pathlib import Path
from typing import Any

import numpy as np

from gpca.io.csv_file import read_numbers
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.trivial import TRIVIAL, trivial_numbers
from gpca.rigid import inverse, scale_translation

FILE = Path(__file__).with_suffix(".csv")
COLUMNS = ("term", "center", "scale", *CONCEPTS)
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
    def load(cls, path: Path = FILE) -> Matching:
        """Read the fitted weights; center and scale are in the rows of the numbers."""
        rows = read_numbers(path, COLUMNS, COLUMNS[1:], optional=COLUMNS[1:3]).set_index("term").loc[terms()]
        numbers = rows.loc[list(TRIVIAL)]
        return cls(numbers["center"].to_numpy(), numbers["scale"].to_numpy(), rows[list(CONCEPTS)].to_numpy().T)

    def expanded(self, numbers_10: np.ndarray) -> np.ndarray:
        """Return the terms of trivial numbers."""
        z = np.clip((numbers_10 - self.center) / self.scale, -FARTHEST, FARTHEST)
        return np.concatenate([[1.0], z, *(z[i] * z[i:] for i in range(len(z)))])

    def acceptances(self, numbers_10: np.ndarray) -> dict[str, float]:
        """Return the probability by which a candidate is accepted, by the dominant cause that it may have."""
        term_T = self.expanded(numbers_10)
        logits = [fsum((weights_T * term_T).tolist()) for weights_T in self.weights]
        odds = [exp(logit - max(logits)) for logit in logits]  # nothing else depends on the processor
        probabilities = [round(each / fsum(odds), DIGITS) for each in odds]
        if (least := min(probabilities)) < LEAST:
            return dict.fromkeys(CONCEPTS, 0.0)
        return {cause: least / probability for cause, probability in zip(CONCEPTS, probabilities, strict=True)}
