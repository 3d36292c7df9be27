"""Logistic regressions on a few numbers each: what residuals, density or the entropy of the clouds tell alone."""

from __future__ import annotations

from baselines.causes.described import DescriptorClassifier
from gpca.explainers.concept_classifier import standardized_regression
from gpca.explainers.interface import ExplainerEntry
from gpca.features.groups import DENSITIES, RESIDUALS
from gpca.settings import Positive


def residuals(source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make the rival that reads residuals at several scales, in both directions, and the spread.

    Quantiles of the distances are residuals of trimmed pairs, so they stand apart from how much of the clouds overlaps.
    """
    regression = standardized_regression(inverse_regularisation)
    return DescriptorClassifier(regression, ("distances", "motion"), RESIDUALS)


def density(source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make the control that reads spacings and numbers of points: the shortcut that a fixed draw of points opens."""
    return DescriptorClassifier(standardized_regression(inverse_regularisation), ("planes",), DENSITIES)


def entropies(source: str, seed: int, inverse_regularisation: Positive = 1.0) -> DescriptorClassifier:
    """Make the one that reads the entropies of the joint cloud and of the two apart (CorAl, Adolfsson et al. 2021)."""
    return DescriptorClassifier(standardized_regression(inverse_regularisation), ("entropy",))


EXPLAINERS = {
    "residuals": ExplainerEntry("Residuals (regression)", residuals, reads="descriptors"),
    "density": ExplainerEntry("Density alone (control)", density, reads="descriptors"),
    "entropies": ExplainerEntry("Entropies, CorAl (regression)", entropies, reads="descriptors"),
}
