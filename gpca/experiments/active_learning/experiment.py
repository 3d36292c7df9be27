"""Labels that a classifier needs for a concept that it has never seen, by every strategy (Table III)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gpca.active_learning.acquisition import STREAMS, strategies
from gpca.active_learning.settings import ActiveLearningSettings, RareSettings, StreamSettings
from gpca.encoders.registry import EncoderChanges, require_draws
from gpca.errors import require_names
from gpca.experiments.experiment import Experiment, LeftOut, Names, Tidy
from gpca.pairs.perturbation import Concept
from gpca.settings import Distinct, PositiveShare


def titles() -> dict[str, str]:
    """Return the titles of all strategies by name."""
    return {name: strategy.title for name, strategy in strategies().items()} | STREAMS


@dataclass(frozen=True, kw_only=True)
class Section(ActiveLearningSettings):
    """The rounds, the concepts that the classifier has never seen, and the encoder that has not seen them either."""

    held_out: Distinct[Concept]
    target: PositiveShare
    rare: RareSettings | None = None
    without: EncoderChanges
    stream: StreamSettings
    strategies: Distinct[str]


def check(config: dict, _left_out: LeftOut) -> None:
    """Check the names of the strategies, and the encoder that never sees the concept."""
    learning = config["active_learning"]
    require_names("active_learning.strategies", learning["strategies"], titles(), "strategy")
    encoder = config["encoders"][config["embedding"]["encoder"]] | learning["without"]
    points = config["registrations"]["cloud_points"]
    require_draws("active_learning.without", encoder, points, "registrations.cloud_points")


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the strategies, and those of them that choose from a pool."""
    chosen = list(config["active_learning"]["strategies"])
    return {"strategy": chosen, "pool_strategy": [name for name in chosen if name not in STREAMS]}


def shown(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the strategies, the conditions, and the accuracy to which labels are counted."""
    learning, registrations = config["active_learning"], config["registrations"]
    return {
        "strategies": {name: titles()[name] for name in learning["strategies"]},
        "active_learning": {**learning, "train": registrations["train"], "test": registrations["test"]},
        "target": learning["target"],
    }


EXPERIMENT = Experiment(
    name="active_learning",
    sections={"active_learning": Section},
    tidy=(
        Tidy(
            "active_learning.csv",
            "gpca.active_learning.curves:collect_curves",
            {"files": "active_learning/{source}/{strategy}/seed{seed}.csv"},
            {"target": "active_learning.target"},
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    switches={"active_learning.strategies": Names("strategy", titles)},
)
