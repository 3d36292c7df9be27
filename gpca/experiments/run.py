"""The names in the paths of a run, worked out from its configuration."""

from collections.abc import Mapping
from typing import Any

from gpca.declarations.registry import experiments
from gpca.explainers.gpca import GPCA_FORMS
from gpca.explainers.registry import explainer_entry


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


def explainer_of(method: str, names: Mapping[str, Any]) -> str:
    """Return the explainer behind a row of predictions: itself, or GP-CA for a ``{backbone}-{reduction}``."""
    return "gpca" if method in (*names["backbone"], *names["published"]) else method


def files_behind(method: str, names: Mapping[str, Any]) -> dict[str, str]:
    """Return the files that an explainer reads besides the registrations: option of ``attribute`` -> pattern.

    ``input_timings`` are the seconds that were spent before it starts.
    """
    explainer = explainer_of(method, names)
    entry = explainer_entry(explainer)
    encoder, reduction = names["embedding"].split("/") if explainer == method else method.split("-")
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
