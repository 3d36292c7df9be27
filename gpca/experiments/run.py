"""The names in the paths of a run, and the settings that its results show, worked out from its configuration.

The registry of results (:mod:`gpca.reporting.registry`) refers to both by name, as do the rules of the workflow.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.experiments.frames import encoder_title
from gpca.experiments.registry import experiments
from gpca.explainers.gpca import GPCA_FORMS
from gpca.explainers.registry import explainer_entry
from gpca.frames.source import ONE_ENCODER, REAL_WORLD
from gpca.objects.entry import dataset_of, title_of


def names_of(config: Mapping, sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the values for the braces of paths: one value, or the list of all.

    Args:
        config: that :func:`gpca.config.check.check` has checked.
        sources: name -> its resolved entry.
    """
    return {
        "source": list(sources),
        "seed": list(config["seeds"]),
        "first_seed": str(config["seeds"][0]),
        "explainer": list(config["explainers"]),
        "gpca": next((name for name in reversed(GPCA_FORMS) if name in config["explainers"]), ""),
        "embedding": f"{config['embedding']['encoder']}/{config['embedding']['reduction']}",
        "shown_source": config["figures"]["source"],
        **{name: value for each in experiments() for name, value in each.names(config, sources).items()},
    }


def settings_of(config: Mapping, sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return the settings that tables and figures show: titles by name, and conditions of the protocol."""
    own = {name: value for each in experiments() for name, value in each.shown(config, sources).items()}
    frames = {REAL_WORLD: own["frames"]}
    titled = {name: {"title": entry["title"], "stand_in": entry["stand_in"]} for name, entry in sources.items()}
    titles = {name: title_of(entry) for name, entry in titled.items()}
    datasets = {name: dataset_of(entry) for name, entry in sources.items()}
    tables = {"title": "Virtual tables", "stand_in": titled[config["recovery"]["objects"]]["stand_in"]}
    model = (titled | frames)[config["model"]["source"]]
    explainers = {name: explainer_entry(name) for name in config["explainers"]}
    explainer_titles = {name: entry.title for name, entry in explainers.items()}
    shown_source = config["figures"]["source"]
    return {
        "sources": titled,
        "compared_sources": {**titled, **frames, ONE_ENCODER: own["frames"], "model": model, "recovery": tables},
        "compared_titles": own["policies"] | own["learners"] | own["strategies"] | explainer_titles,
        "source_titles": titles,
        "shown_title": titles[shown_source],
        "source_datasets": datasets,
        "shown_dataset": datasets[shown_source],
        "model": model,
        "model_title": title_of(model),
        "explainers": {
            name: {"title": entry.title, "oracle": entry.oracle, "sees": entry.sight}
            for name, entry in explainers.items()
        },
        "explainer_titles": explainer_titles,
        "cause_settings": {**config["causes"], "icp": config["registrations"]["icp"]},
        "success": config["success"]["error"],
        "success_curve": list(config["success"]["curve"]),
        "encoder_title": encoder_title(**config["embedding"]),
        **own,
    }


def explainer_of(method: str, names: Mapping[str, Any]) -> str:
    """Return the explainer behind a row of predictions: itself, or GP-CA for a ``{backbone}-{reduction}``."""
    return "gpca" if method in _embedded(names) else method


def _embedded(names: Mapping[str, Any]) -> list[str]:
    """Return the rows of depth frames that read embeddings."""
    return [*names["backbone"], *names["published"]]


def files_behind(method: str, names: Mapping[str, Any]) -> dict[str, str]:
    """Return the files that an explainer reads besides the registrations: option of ``attribute`` -> pattern.

    ``input_timings`` are the seconds that were spent before it starts.
    """
    entry = explainer_entry(explainer_of(method, names))
    encoder, reduction = method.split("-") if method in _embedded(names) else names["embedding"].split("/")
    if entry.reads == "embeddings":
        return {
            "input_timings": f"timings/{{source}}/{encoder}/seed{{seed}}.csv",
            "embeddings": f"embeddings/{{source}}/{encoder}/{reduction}/seed{{seed}}.npz",
        }
    files = {"input_timings": "timings/{source}/icp/seed{seed}.csv"}
    if entry.design:
        files["uncertainty"] = f"uncertainty/{{source}}/{entry.design}/seed{{seed}}.npz"
        files["uncertainty_timings"] = f"timings/{{source}}/uncertainty_{entry.design}/seed{{seed}}.csv"
    return files
