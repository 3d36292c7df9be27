"""Checks of sizes that have to fit each other though they stand in different sections, as far as no data is needed."""

from __future__ import annotations

from gpca.encoders.settings import require_draws
from gpca.errors import InputError


def check_sizes(config: dict) -> None:
    """Check draws and neighbors against the points of the clouds.

    How many points a depth frame has of an object is not known here, and clouds of fewer points than a draw repeat
    some; so those of frames are left out.
    """
    key, points = "registrations.cloud_points", config["registrations"]["cloud_points"]
    for name, encoder in config["encoders"].items():
        require_draws(f"encoders.{name}", encoder, points, key)
    for name, explainer in config["explainers"].items():
        if (neighbors := (explainer or {}).get("neighbours", 0)) > points:
            fault = f"{neighbors} neighbors are too many for {points} points of a cloud"
            raise InputError(f"config key explainers.{name}.neighbours", fault, f"lower it, or raise {key}")
