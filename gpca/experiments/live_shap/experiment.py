"""SHAP by a live function: does a table of outcomes, computed beforehand, give the values that shap would find?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from gpca.experiments.experiment import Experiment, Tidy
from gpca.settings import Bounds, Count

LOOKUP = "shap_additive"  # the explainer whose values are compared: its design has the corners in a table


@dataclass(frozen=True)
class Section:
    """The registrations for which ``shap.KernelExplainer`` calls a function that registers.

    Attributes:
        sources, seeds: how many of the run's are used, from the first.
        samples: test samples of each source and seed, balanced.
    """

    sources: Count = 1
    seeds: Count = 1
    samples: Annotated[int, Bounds(minimum=3, multipleOf=3)] = 3


def names(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the sources, none where the explainer that is compared is left out, and the seeds."""
    own = config["live_shap"]
    is_made = LOOKUP in config["explainers"] and "additive" in config["uncertainty"]
    chosen = list(sources)[: own["sources"]] if is_made else []
    return {"live_source": chosen, "live_seed": list(config["seeds"])[: own["seeds"]]}


EXPERIMENT = Experiment(
    name="live_shap",
    sections={"live_shap": Section},
    tidy=(
        Tidy(
            "live_shap.csv",
            "gpca.evaluation.measures:read_all_metrics",
            {"paths": "live_shap/{live_source}/seed{live_seed}.csv"},
            rule="live_shap_metrics",
        ),
    ),
    needs=("live_source",),
    names=names,
)
