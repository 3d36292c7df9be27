"""Explainers of what was perturbed (``EXPLAINERS``), and of what is wrong with a registration."""

from __future__ import annotations

import numpy as np

from gpca.causes.dataset import LABELS
from gpca.explainers.interface import ExplainerEntry, ScoringExplainer
from gpca.pairs.dataset import Registrations


class NearestQuality(ScoringExplainer):
    """Scores are the softmax of the negative distances to each label's mean quality, in standard deviations.

    Args:
        source, seed: not used, since nothing is drawn.
        sharpness: of the softmax.
    """

    def __init__(self, source: str, seed: int, sharpness: float = 1.0) -> None:
        self._sharpness = sharpness

    def fit(self, registrations: Registrations) -> None:
        """Learn each label's mean quality; a label without a sample is never near."""
        quality_N_3 = _quality(registrations)
        self._deviation_3 = quality_N_3.std(axis=0) + 1e-9
        label_N = registrations.concept
        self._means_C_3 = np.array(
            [
                quality_N_3[label_N == label].mean(axis=0) if (label_N == label).any() else np.full(3, 1e6)
                for label in self.labels
            ]
        )

    def scores(self, registrations: Registrations) -> np.ndarray:
        """Return a score for each registration and label (N, C)."""
        offsets_N_C_3 = (_quality(registrations)[:, None] - self._means_C_3) / self._deviation_3
        distances_N_C = np.sqrt((offsets_N_C_3**2).sum(axis=-1))
        weights_N_C = np.exp(-self._sharpness * (distances_N_C - distances_N_C.min(axis=1, keepdims=True)))
        return weights_N_C / weights_N_C.sum(axis=1, keepdims=True)


class NearestQualityOfCauses(NearestQuality):
    """The same over nominal, noise, pose and overlap."""

    labels = LABELS


def _quality(registrations: Registrations) -> np.ndarray:
    """Return ICP's fitness and inlier RMSE, and the share of the target's points that the source has (N, 3)."""
    points_N = np.diff(registrations.offsets) / np.diff(registrations.target_offsets)
    return np.column_stack([registrations.fitness, registrations.inlier_rmse, points_N])


EXPLAINERS = {"my_nearest_quality": ExplainerEntry("Nearest quality (mine)", NearestQuality, sees=("pair",))}
CAUSE_EXPLAINERS = {
    "my_nearest_quality": ExplainerEntry("Nearest quality (mine)", NearestQualityOfCauses, sees=("pair",))
}
