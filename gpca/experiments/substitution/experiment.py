"""Explanations with other registration methods, and other estimators of uncertainty, beneath them (Table XIV)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gpca.alignment.methods.registry import installed, left_out, method_entry
from gpca.errors import require_names, with_key
from gpca.experiments.experiment import EXPLAINERS, ByName, Experiment, LeftOut, Tidy
from gpca.experiments.explained import require_exchangeable, require_explained, titles
from gpca.experiments.substitution.settings import ExchangeSettings
from gpca.explainers.registry import explainer_entry
from gpca.settings import Distinct
from gpca.uncertainty.estimators.registry import estimator_entry


@dataclass(frozen=True, kw_only=True)
class Section(ExchangeSettings):
    """The settings, the sources whose registrations are explained, and the explainers."""

    sources: Distinct[str]
    explainers: ByName


def check(config: dict, names_left_out: LeftOut) -> None:
    """Check that all names exist, and that the explainers read the parts that are exchanged."""
    exchange = config["exchange"]
    for key, noun in {"sources": "source", "methods": "registration method", "estimators": "estimator"}.items():
        require_names(f"exchange.{key}", exchange[key], config[key], noun, names_left_out(key))
    for key, name in require_explained(config, "exchange.explainers"):
        with_key(key, require_exchangeable, name)


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the sources and seeds, the methods, and the explainers whose estimator or whose method is exchanged."""
    exchange = config["exchange"]
    return {
        "exchange_source": list(exchange["sources"]),
        "exchange_seed": list(config["seeds"])[: exchange["seeds"]],
        "exchange_estimated": [name for name in exchange["explainers"] if explainer_entry(name).design],
        "exchange_registered": [name for name in exchange["explainers"] if not explainer_entry(name).design],
        "exchange_method": installed(exchange["methods"]),
    }


def shown(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles for the tables, and the methods whose package is missing here."""
    exchange = config["exchange"]
    missing = left_out(exchange["methods"])
    return {
        "exchange_sources": {
            name: {key: sources[name][key] for key in ("title", "stand_in")} for name in exchange["sources"]
        },
        "exchange_explainers": titles(exchange["explainers"]),
        "exchange_methods": {name: method_entry(name).title for name in installed(exchange["methods"])},
        "exchange_left_out": {method_entry(name).title: package for name, package in missing.items()},
        "exchange_estimators": {name: estimator_entry(name).title for name in exchange["estimators"]},
    }


EXPERIMENT = Experiment(
    name="substitution",
    sections={"exchange": Section},
    tidy=(
        Tidy(
            "exchange.csv",
            "gpca.experiments.substitution.metrics:collect",
            {"prediction_files": "exchange/{exchange_source}/seed{exchange_seed}.csv"},
            rule="exchange_metrics",
        ),
        Tidy(
            "exchange_intervals.csv",
            "gpca.experiments.substitution.metrics:collect_intervals",
            {"prediction_files": "exchange/{exchange_source}/seed{exchange_seed}.csv"},
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    leavable={"exchange.explainers": EXPLAINERS},
    lists={f"exchange.{name}": name for name in ("sources", "methods", "estimators")},
)
