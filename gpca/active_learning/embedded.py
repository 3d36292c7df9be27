"""Samples as active learning sees them: embeddings with labels and splits, whatever they were made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Embedded:
    """S samples.

    Attributes:
        embedding: (S, d).
        concept, split: (S,) label, and ``train`` or ``test``.
    """

    embedding: np.ndarray
    concept: np.ndarray
    split: np.ndarray

    def rows(self, split: str) -> np.ndarray:
        """Return the row numbers of a split."""
        return np.flatnonzero(self.split == split)

    def followed_by(self, other: Embedded) -> Embedded:
        """Return these samples and those of the other after them."""
        return Embedded(
            np.concatenate([self.embedding, other.embedding]),
            np.concatenate([self.concept, other.concept]),
            np.concatenate([self.split, other.split]),
        )
