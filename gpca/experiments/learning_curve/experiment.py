"""How the diagnosis of causes grows with the training samples: an estimate of what an observer can reach."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gpca.errors import InputError, require_names
from gpca.experiments.experiment import Experiment, LeftOut, Tidy
from gpca.experiments.learning_curve.settings import CurveSettings, labeled_samples
from gpca.objects.entry import title_of
from gpca.settings import Distinct, read_settings


@dataclass(frozen=True, kw_only=True)
class Section(CurveSettings):
    """The learning curve, and the sources whose objects are registered."""

    sources: Distinct[str]


def check(config: dict, left_out: LeftOut) -> None:
    """Check the names of the sources, and that there are samples enough."""
    section = config["learning_curve"]
    require_names("learning_curve.sources", section["sources"], config["sources"], "source", left_out("sources"))
    pool = labeled_samples(config["causes"]) + section["further"]
    if max(section["sizes"]) > pool:
        fault = f"{max(section['sizes'])} is more than the {pool} labeled samples that there are"
        raise InputError("config key learning_curve.sizes", fault, "lower it, or raise learning_curve.further")


def of_curve(section: Mapping[str, Any]) -> dict[str, Any]:
    """Return the section without the names of the sources."""
    return {name: value for name, value in section.items() if name != "sources"}


def names(config: Mapping[str, Any], _sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the sources, seeds and chunks."""
    section = config["learning_curve"]
    chunks = read_settings(CurveSettings, of_curve(section)).chunks()
    return {
        "curve_source": list(section["sources"]),
        "curve_seed": list(config["seeds"])[: section["seeds"]],
        "chunk": list(range(len(chunks))),
    }


def shown(config: Mapping[str, Any], sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the titles of the sources."""
    chosen = config["learning_curve"]["sources"]
    return {"curve_titles": {name: title_of(entry) for name, entry in sources.items() if name in chosen}}


EXPERIMENT = Experiment(
    name="learning_curve",
    sections={"learning_curve": Section},
    tidy=(
        Tidy(
            "learning_curve.csv",
            "gpca.experiments.learning_curve.curve:collect_curves",
            {"files": "learning_curve/{curve_source}/seed{curve_seed}.csv"},
            rule="learning_curve_metrics",
        ),
    ),
    names=names,
    shown=shown,
    check=check,
    lists={"learning_curve.sources": "sources"},
)
