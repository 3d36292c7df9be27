"""Checks of the sources, and of the keys that name one."""

from __future__ import annotations

from collections.abc import Set

from gpca.errors import require_names, with_key
from gpca.frames.source import REAL_WORLD
from gpca.objects.source import resolve


def resolve_sources(config: dict) -> dict[str, dict]:
    """Return the resolved entry of every source, by name, with ``stand_in`` set."""
    return {
        name: {"stand_in": entry["kind"] == "procedural"}
        | with_key(f"sources.{name}", resolve, entry, config["data_dir"])
        for name, entry in config["sources"].items()
    }


def check_named_sources(config: dict, sources_left_out: Set[str], encoders_left_out: Set[str]) -> None:
    """Check what figures and the model are made of."""
    sources = config["sources"]
    require_names("figures.source", [config["figures"]["source"]], sources, "source", sources_left_out)
    model = config["model"]
    require_names("model.source", [model["source"]], (*sources, REAL_WORLD), "source", sources_left_out)
    require_names("model.encoder", [model["encoder"]], config["encoders"], "encoder", encoders_left_out)
