"""Checks that an explainer can run with something else beneath it."""

from __future__ import annotations

from gpca.errors import InputError
from gpca.explainers.registry import explainer_entry

DESIGN = "additive"  # the design whose conditions are estimated


def require_exchangeable(name: str) -> None:
    """Raise an InputError unless the explainer is known and reads what is exchanged.

    That is registrations, their embeddings, the conditions of design ``additive``, or of any the observed pair alone.
    """
    entry = explainer_entry(name)
    if entry.design not in (None, DESIGN) and not entry.observed_only:
        fault = f"reads design '{entry.design}', which estimators do not provide"
        raise InputError(f"explainer '{name}'", fault, f"choose one that reads '{DESIGN}'")
