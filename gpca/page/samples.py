"""Picks the registrations that the page shows in 3-D, with the poses of their clouds and GP-CA's predictions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import concepts_of, read_predictions
from gpca.causes.settings import Limits
from gpca.errors import InputError
from gpca.experiments.method.shown_sample import observed_uncertainties, registration_error, state_of_error
from gpca.page.scenes import packed_registration
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS

if TYPE_CHECKING:
    import pandas as pd

OF_EACH_CONCEPT = 2  # The page shows this many samples of each concept in every source.
RULE = (
    f"Of every source, the first {OF_EACH_CONCEPT} test samples of each concept in the run's first seed, in the order "
    "of their numbers, right or wrong."
)


def page_samples(files: Mapping[str, str | Path], source: Mapping, limits: Limits, reach: float) -> list[dict]:
    """Return the samples of one source that `RULE` names, for the page's 3-D view, as plain JSON values.

    Each holds its ``scene`` (:func:`gpca.page.scenes.packed_registration`), object, concept, severity, scores with
    standard deviations, fitness, how far off ICP ends (ADD-S in % of the diameter) and the state that this is called;
    the uncertainty in nats and that below which 95 % of the clean pairs lie, where they are known.

    Args:
        files: The ``registrations`` and ``predictions`` of one source and seed, and perhaps its ``uncertainty``.
        source: The ``title`` of the source, and whether it is a ``stand_in``.
        limits: What states are told apart by.
        reach: How far ICP looks for a partner, in diameters.

    Raises:
        InputError: an unusable file, or a sample that was not predicted.
    """
    registrations, predictions = Registrations.load(files["registrations"]), read_predictions(files["predictions"])
    u_S, clean = np.full(len(registrations), np.nan), np.nan
    if "uncertainty" in files:
        u_S, clean = observed_uncertainties(files["uncertainty"], registrations)
    test = predictions[predictions["split"] == "test"].set_index("sample")
    samples = []
    for row in first_of_each_concept(registrations):
        number = str(registrations.sample[row])
        if number not in test.index:
            fault = f"lacks test sample {number} of {files['registrations']}"
            raise InputError(files["predictions"], fault, "regenerate both")
        error = registration_error(registrations, row)
        samples.append(
            _sample(registrations, row, test.loc[number], concepts_of(predictions))
            | {"error_percent": _number(100 * error), "state": state_of_error(error, limits)}
            | {"scene": packed_registration(registrations, row, reach)}
            | {"uncertainty": _number(u_S[row]), "clean_uncertainty": _number(clean), "source": dict(source)}
        )
    return samples


def first_of_each_concept(registrations: Registrations) -> list[int]:
    """Return the rows that `RULE` names, concept by concept."""
    test = registrations.rows("test")
    in_order = test[np.argsort(registrations.sample[test], kind="stable")]
    return [int(row) for c in CONCEPTS for row in in_order[registrations.concept[in_order] == c][:OF_EACH_CONCEPT]]


def severity_words(registrations: Registrations, row: int) -> str:
    """Return a sample's perturbation in words; lengths are in % of the object's diameter."""
    concept = str(registrations.concept[row])
    if concept == "noise":
        return f"σ = {100 * registrations.severity_noise[row]:.1f} % of the diameter"
    if concept == "pose":
        angle_deg = np.degrees(registrations.severity_rotation_rad[row])
        return f"turned by {angle_deg:.0f}°, moved by {100 * registrations.severity_translation[row]:.0f} %"
    return f"{100 * registrations.severity_crop[row]:.0f} % of the points cut off"


def _sample(registrations: Registrations, row: int, prediction: pd.Series, concepts: list[str]) -> dict:
    return {
        "object": str(registrations.object_name[row]),
        "sample": int(registrations.sample[row]),
        "concept": str(registrations.concept[row]),
        "severity": severity_words(registrations, row),
        "fitness": _number(registrations.fitness[row]),
        "predicted": str(prediction["concept_predicted"]),
        "scores": [
            {
                "concept": concept,
                "mean": _number(prediction[f"score_{concept}"]),
                "deviation": _number(np.sqrt(prediction[f"variance_{concept}"])),
            }
            for concept in concepts
        ],
    }


def _number(value: float) -> float | None:
    """Return a rounded number, or None for NaN, which JSON lacks: it is the score of an explainer that abstains."""
    return round(float(value), 3) if np.isfinite(value) else None
