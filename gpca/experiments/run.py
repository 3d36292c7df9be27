"""What a run consists of, worked out from its configuration: the names in its paths, and what its results show.

The registry of results (:mod:`gpca.reporting.registry`) refers to both by name, as do the rules of the workflow.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.experiments.real_world.tables import encoder_title
from gpca.experiments.registry import experiments
from gpca.explainers.gpca import GPCA_FORMS
from gpca.explainers.registry import explainer_entry
from gpca.frames.source import ONE_ENCODER, REAL_WORLD
from gpca.objects.title import dataset_of, title_of


def names_of(config: Mapping, sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return what stands in the braces of paths: one value, or the list of all.

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
    """Return what tables and figures show besides numbers: titles by name, and conditions of the protocol."""
    of_experiments = {name: value for each in experiments() for name, value in each.shown(config, sources).items()}
    of_frames = of_experiments["frames"]
    shown = {name: {"title": entry["title"], "stand_in": entry["stand_in"]} for name, entry in sources.items()}
    datasets = {name: dataset_of(entry) for name, entry in sources.items()}
    of_model = {**shown, REAL_WORLD: of_frames}[config["model"]["source"]]
    entries = {name: explainer_entry(name) for name in config["explainers"]}
    explainers = {name: entry.title for name, entry in entries.items()}
    return {
        "sources": shown,
        "compared_sources": {**shown, REAL_WORLD: of_frames, ONE_ENCODER: of_frames, "model": of_model},
        "compared_titles": of_experiments["learners"] | of_experiments["strategies"] | explainers,
        "source_titles": {name: title_of(entry) for name, entry in shown.items()},
        "shown_title": title_of(shown[config["figures"]["source"]]),
        "source_datasets": datasets,
        "shown_dataset": datasets[config["figures"]["source"]],
        "model": of_model,
        "model_title": title_of(of_model),
        "explainers": {name: {"title": entry.title, "oracle": entry.oracle} for name, entry in entries.items()},
        "explainer_titles": explainers,
        "cause_settings": {**config["causes"], "icp": config["registrations"]["icp"]},
        "encoder_title": encoder_title(**config["embedding"]),
        **of_experiments,
    }


def explainer_of(method: str, names: Mapping[str, Any]) -> str:
    """Return the explainer behind a row of predictions: itself, or GP-CA for a ``{backbone}-{reduction}``."""
    return "gpca" if method in names["backbone"] else method


def files_behind(method: str, names: Mapping[str, Any]) -> dict[str, str]:
    """Return what an explainer reads besides the registrations: option of the step ``attribute`` -> pattern of files.

    ``input_timings`` are the seconds that were spent before it starts.
    """
    entry = explainer_entry(explainer_of(method, names))
    encoder, reduction = method.split("-") if method in names["backbone"] else names["embedding"].split("/")
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
