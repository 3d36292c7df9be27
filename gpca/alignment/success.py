"""When a registration counts as a success: one definition for all experiments."""

from __future__ import annotations

from dataclasses import dataclass

from gpca.errors import InputError
from gpca.settings import Distinct, PositiveShare


@dataclass(frozen=True)
class SuccessSettings:
    """The section ``success`` of the config.

    Attributes:
        error: smallest error of a failure, ADD or, of symmetric objects, ADD-S, in diameters.
        curve: errors, in ascending order, at which shares of successes are shown to see how much the limit decides.
    """

    error: PositiveShare = 0.03
    curve: Distinct[PositiveShare] = (0.02, 0.03, 0.05, 0.10)

    def __post_init__(self) -> None:
        if list(self.curve) != sorted(self.curve):
            raise InputError("success curve", f"{list(self.curve)} is not in ascending order", "sort it")


def success_within(error: float) -> str:
    """Return the name of the metric that counts errors below another limit, e.g. ``success_10`` of 10 %."""
    return f"success_{100 * error:g}"
