"""Runs a design for many registrations."""

from __future__ import annotations

import numpy as np

from gpca.errors import InputError
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.seeds import generator
from gpca.uncertainty.designs import DESIGNS, RegisteredRow
from gpca.uncertainty.outcomes import Outcomes
from gpca.uncertainty.settings import UncertaintySettings
from gpca.uncertainty.spread import divergence


def design_rows(registrations: Registrations, design: str, samples: int | None) -> np.ndarray:
    """Return the rows that a design evaluates: of its splits, the first `samples` test samples (all if None).

    Samples come in threes of one object under the three concepts, and the threes go round the objects, so the first
    ones are a stratified choice.

    Raises:
        InputError: `samples` is not divisible by the number of concepts, or there are no rows.
    """
    if samples is not None and samples % len(CONCEPTS):
        raise InputError(
            f"uncertainty '{design}'", f"{samples} samples do not balance the concepts", "give a multiple of 3"
        )
    chosen = np.isin(registrations.split, DESIGNS[design].splits)
    if samples is not None:
        chosen &= (registrations.split != "test") | (registrations.sample < samples)
    if not chosen.any():
        raise InputError(f"uncertainty '{design}'", "has no registrations to evaluate", "increase their number")
    return np.flatnonzero(chosen)


def evaluate_design(
    design: str, registrations: Registrations, source: str, seed: int, settings: UncertaintySettings
) -> tuple[Outcomes, np.ndarray, np.ndarray]:
    """Run every condition of the design for every registration.

    The random numbers of a sample are named by source, seed, split and number, not by the design: the observed pair has
    the same starts in all of them.

    Returns:
        the outcomes, and seconds (S, K) and seconds inside ICP (S, K).
    """
    entry = DESIGNS[design]
    observed = registrations if entry.oracle else registrations.without_labels()
    rows = []
    for i in progress(range(len(observed)), f"uncertainty ({design}) of {source}, seed {seed}"):
        axes = (source, seed, "uncertainty", observed.split[i], observed.sample[i])
        xi_n_6 = generator(*axes, "starts").normal(size=(settings.starts, 6)) * settings.deviation_6()
        rows.append(entry.evaluate(RegisteredRow(observed, i), xi_n_6, settings, generator(*axes, "clouds")))
    columns = {
        name: np.array([[getattr(outcome, name) for outcome in row] for row in rows])
        for name in ("covariance", "residual", "degenerate", "icp_calls", "seconds", "icp_seconds")
    }
    seconds_S_K, icp_seconds_S_K = columns.pop("seconds"), columns.pop("icp_seconds")
    clean = columns["covariance"][:, entry.reference, None]
    uncertainty_S_K = divergence(clean, columns["covariance"], settings.floor)
    outcomes = Outcomes(sample=observed.sample, split=observed.split, uncertainty=uncertainty_S_K, **columns)
    return outcomes, seconds_S_K, icp_seconds_S_K
