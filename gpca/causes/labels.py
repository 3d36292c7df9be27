"""The labels for explainers of causes: nominal where nothing is wrong, or the cause that adds most to the error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gpca.causes.dataset import Causes
from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL, Truth
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS

LABELS = (NOMINAL, *CONCEPTS)


def labels_of(truth: Truth) -> np.ndarray:
    """Return (S,) labels: nominal, the dominant cause of a failed registration, or ``borderline`` between the two.

    A failure of the geometry has no label either, since none of `LABELS` is right: it counts as borderline.
    """
    named_S = np.where(truth.state == FAILED, truth.dominant, truth.state)
    return np.where(np.isin(named_S, LABELS), named_S, BORDERLINE)


def labeled(causes: Causes) -> Registrations:
    """Return the registrations with their labels in the place of the concepts, and the sets of causes attached.

    An explainer that learns gets these; ``causes`` (S, 3) is 1 where a concept is one of the causes.
    """
    truth = {"causes": causes.truth.causes.astype(float)}
    own = causes.registrations
    return replace(own, concept=labels_of(causes.truth), attached={**own.attached, **truth})


def with_label(causes: Causes) -> Registrations:
    """Return those registrations that have a label, as :func:`labeled` returns them."""
    registrations = labeled(causes)
    return registrations.subset(np.flatnonzero(registrations.concept != BORDERLINE))
