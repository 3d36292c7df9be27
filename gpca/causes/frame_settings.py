"""Settings of the measured causes of registrations in depth frames (docs/causes.md)."""

from __future__ import annotations

from dataclasses import dataclass

from gpca.causes.settings import CloudPoints
from gpca.settings import Count


@dataclass(frozen=True)
class FrameCauseSettings:
    """Which instances are measured, and with how many points.

    Attributes:
        seeds: the first so many of the run's, each with other points, starts and explainers.
        instances: drawn of all, at most; None for all.
        points: of what was measured, at most, and of the model.
    """

    seeds: Count = 1
    instances: Count | None = None
    points: CloudPoints = 512
