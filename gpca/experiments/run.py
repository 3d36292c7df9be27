"""What a run consists of, worked out from its configuration: the names in its paths, and what its results show.

The registry of results (:mod:`gpca.reporting.registry`) refers to both by name, as do the rules of the workflow.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gpca.active_learning.settings import NEW_CONCEPT_STRATEGIES
from gpca.experiments.kernel_grid.tables import PRINTED
from gpca.experiments.real_world.tables import encoder_title
from gpca.experiments.registry import experiments
from gpca.experiments.specification_curve.registry import FRAME_INPUT, GROUPS
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
    kernels = config["kernel_grid"]
    return {
        "source": list(sources),
        "seed": list(config["seeds"]),
        "first_seed": str(config["seeds"][0]),
        "explainer": list(config["explainers"]),
        "gpca": next((name for name in reversed(GPCA_FORMS) if name in config["explainers"]), ""),
        "learner": list(config["learners"]),
        "new_concept_strategy": list(NEW_CONCEPT_STRATEGIES),
        "erring": list(config["new_concepts"]["erring"]),
        "new_concept_seed": new_concept_seeds(config),
        "frame_label_seed": list(config["seeds"])[: config["frame_labels"]["seeds"]],
        "embedding": f"{config['embedding']['encoder']}/{config['embedding']['reduction']}",
        "shown_source": config["figures"]["source"],
        "reading_group": reading_groups(config),
        "frame_input": [name for name in reading_groups(config) if name == FRAME_INPUT],
        "kernel_source": list(kernels["sources"]),
        "printed_kernels": [kernel for kernel, rate, n in PRINTED if _is_fitted(kernels, kernel, rate, n)],
        **{name: value for each in experiments() for name, value in each.names(config, sources).items()},
    }


def settings_of(config: Mapping, sources: Mapping[str, Mapping]) -> dict[str, Any]:
    """Return what tables and figures show besides numbers: titles by name, and conditions of the protocol."""
    frames, learning = config["real_world"], config["active_learning"]
    of_experiments = {name: value for each in experiments() for name, value in each.shown(config, sources).items()}
    of_frames = of_experiments["frames"]
    shown = {name: {"title": entry["title"], "stand_in": entry["stand_in"]} for name, entry in sources.items()}
    datasets = {name: dataset_of(entry) for name, entry in sources.items()}
    of_grid = {name: entry for name, entry in shown.items() if name in config["kernel_grid"]["sources"]}
    of_model = {**shown, REAL_WORLD: of_frames}[config["model"]["source"]]
    entries = {name: explainer_entry(name) for name in config["explainers"]}
    explainers = {name: entry.title for name, entry in entries.items()}
    learners = {name: explainer_entry(name).title.removesuffix(" on the embedding") for name in config["learners"]}
    return {
        "sources": shown,
        "compared_sources": {**shown, REAL_WORLD: of_frames, ONE_ENCODER: of_frames, "model": of_model},
        "compared_titles": learners | of_experiments["strategies"] | explainers,
        "source_titles": {name: title_of(entry) for name, entry in shown.items()},
        "shown_title": title_of(shown[config["figures"]["source"]]),
        "source_datasets": datasets,
        "shown_dataset": datasets[config["figures"]["source"]],
        "model": of_model,
        "model_title": title_of(of_model),
        "explainers": {name: {"title": entry.title, "oracle": entry.oracle} for name, entry in entries.items()},
        "explainer_titles": explainers,
        "cause_settings": {**config["causes"], "icp": config["registrations"]["icp"]},
        "learners": learners,
        "reading_groups": {name: GROUPS[name].title for name in reading_groups(config)},
        "new_concepts": {
            **learning,
            **config["new_concepts"],
            "seeds": new_concept_seeds(config),
            "test": config["registrations"]["test"],
            "of_causes": config["causes"],
        },
        "frame_labels": {**learning, **config["frame_labels"], "train": frames["train"], "test": frames["test"]},
        "test_samples": config["registrations"]["test"],
        "kernel_sources": of_grid,
        "kernel_source_titles": {name: title_of(entry) for name, entry in of_grid.items()},
        "encoder_title": encoder_title(**config["embedding"]),
        **of_experiments,
    }


def new_concept_seeds(config: Mapping) -> list[int]:
    """Return the seeds for which new concepts are learned where no encoder has seen them."""
    return list(config["seeds"])[: config["new_concepts"]["seeds"]]


def reading_groups(config: Mapping) -> list[str]:
    """Return the groups of readings; one of them trains encoders of depth frames, and is run where there are seeds."""
    groups, frames = config["readings"]["groups"], config["real_world"]
    trains = config["readings"]["frame_seeds"] and "none" in frames["reductions"]
    return [name for name in groups if name != FRAME_INPUT or trains]


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


def _is_fitted(kernels: Mapping, kernel: str, rate: float, iterations: int) -> bool:
    return kernel in kernels["kernels"] and rate in kernels["learning_rates"] and iterations in kernels["iterations"]
