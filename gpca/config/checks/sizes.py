"""Checks of sizes that have to fit each other though they stand in different sections, as far as no data is needed."""

from __future__ import annotations

from collections.abc import Iterator

from gpca.encoders.settings import require_draws
from gpca.errors import InputError


def check_sizes(config: dict) -> None:
    """Check neighbors and draws against the samples and the points that there will be."""
    _check_neighbours(config)
    for key, encoder, points, points_key in _encoders(config):
        require_draws(key, encoder, points, points_key)


def _check_neighbours(config: dict) -> None:
    train, cloud_points = (config["registrations"][key] for key in ("train", "cloud_points"))
    of_learners = {f"learners.{name}": entry for name, entry in config["learners"].items()}
    of_explainers = {f"explainers.{name}": entry for name, entry in config["explainers"].items()}
    for entries, most, things, remedy in (
        (of_learners | {"shift": config["shift"]}, train, "training samples", "registrations.train"),
        (of_explainers, cloud_points, "points of a cloud", "registrations.cloud_points"),
    ):
        for key, entry in entries.items():
            if (neighbours := (entry or {}).get("neighbours", 0)) > most:
                fault = f"{neighbours} neighbors are too many for {most} {things}"
                raise InputError(f"config key {key}.neighbours", fault, f"lower it, or raise {remedy}")


def _encoders(config: dict) -> Iterator[tuple[str, dict, int, str]]:
    """Yield each encoder's key and settings, and the number of points of the clouds that it sees, with its key.

    How many points a depth frame has of an object is not known here, and clouds of fewer points than a draw repeat
    some; so those of frames are left out.
    """
    cloud_points = config["registrations"]["cloud_points"], "registrations.cloud_points"
    for name, encoder in config["encoders"].items():
        yield f"encoders.{name}", encoder, *cloud_points
    explained = config["encoders"][config["embedding"]["encoder"]]
    for key in ("shift.encoder", "new_concepts.encoder"):
        section, name = key.split(".")
        yield key, explained | config[section][name], *cloud_points
