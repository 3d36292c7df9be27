"""Labels that a classifier needs for a concept that no encoder has seen, of samples that none has seen (Table XV)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.active_learning.settings import NEW_CONCEPT_STRATEGIES, NewConceptSettings
from gpca.experiments.experiment import Experiment, Tidy


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the strategies and seeds, and the embeddings for which the oracle also makes errors."""
    section = config["new_concepts"]
    return {
        "new_concept_strategy": list(NEW_CONCEPT_STRATEGIES),
        "new_concept_seed": list(config["seeds"])[: section["seeds"]],
        "erring": list(section["erring"]),
    }


def shown(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the conditions: those of active learning, and those that differ from them."""
    conditions = {
        **config["active_learning"],
        **config["new_concepts"],
        "seeds": names(config, sources)["new_concept_seed"],
        "test": config["registrations"]["test"],
        "of_causes": config["causes"],
    }
    return {"new_concepts": conditions}


EXPERIMENT = Experiment(
    name="new_concepts",
    sections={"new_concepts": NewConceptSettings},
    tidy=(
        Tidy(
            "new_concepts.csv",
            "gpca.active_learning.curves:collect_curves",
            {"files": "new_concepts/{source}/{new_concept_strategy}/seed{new_concept_seed}.csv"},
            {"target": "active_learning.target"},
        ),
    ),
    names=names,
    shown=shown,
)
