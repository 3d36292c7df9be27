"""Causes of failed registrations of depth frames, where nothing was perturbed: part of Table IX."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.experiments.experiment import Experiment, Tidy
from gpca.explainers.registry import CAUSES, explainer_module
from gpca.plugins import is_outside


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the seeds for which the causes are measured and explained, and the explainers from outside."""
    explainers = config["diagnosis"]["explainers"]
    return {
        "frame_cause_seed": list(config["seeds"])[: config["real_world"]["causes"]["seeds"]],
        "outside_explainer": [name for name in explainers if is_outside(explainer_module(name, CAUSES))],
    }


EXPERIMENT = Experiment(
    name="frame_causes",
    tidy=(
        Tidy(
            "frame_causes.csv",
            "gpca.experiments.frame_causes.metrics:collect",
            {
                "causes_files": "frame_causes/seed{frame_cause_seed}.npz",
                "sample_files": "frame_causes/seed{frame_cause_seed}.csv",
                "prediction_files": "frame_diagnoses/seed{frame_cause_seed}.csv",
                "outside_files": "frame_diagnoses/{outside_explainer}/seed{frame_cause_seed}.csv",
            },
        ),
    ),
    names=names,
)
