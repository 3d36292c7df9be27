"""What an explainer sees of a registration, in words that tables print, and how many further runs of ICP that takes."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Literal, get_args

from gpca.errors import InputError

if TYPE_CHECKING:
    from gpca.causes.settings import DescriptorSettings

Part = Literal["source", "pair", "motion", "runs", "quick_remedies", "remedies", "reenactment", "truth"]
PARTS: tuple[str, ...] = get_args(Part)
Sees = tuple[Part, ...]
WORDS = {
    "source": "aligned source",  # where ICP put it
    "pair": "pair",  # both clouds after ICP, and what follows from them: numbers of points, ICP's fitness and RMSE
    "motion": "motion",  # of ICP: how far it moved the cloud
    "runs": "further runs",  # of the same registration, from other starts or with knobs turned
    "quick_remedies": "remedies",  # those without restarts
    "remedies": "remedies",  # the registration again, with each combination of them
    "reenactment": "re-enactment",  # the registration again under hypotheses of the true pose
    "truth": "truth",
}
NOTHING = "nothing"


def require_parts(subject: str, sees: object) -> None:
    """Raise an InputError unless this is a tuple of :data:`PARTS`."""
    if not isinstance(sees, tuple) or not set(sees) <= set(PARTS):
        raise InputError(subject, f"sees {sees!r}", f"give a tuple of {', '.join(PARTS)}, or () for {NOTHING}")


def in_words(sees: Collection[str]) -> str:
    """Return what a table prints, such as ``pair + motion``."""
    return " + ".join(WORDS[part] for part in PARTS if part in sees) or NOTHING


def icp_calls(sees: Collection[str], starts: int, descriptors: DescriptorSettings, reenactment: int = 0) -> int:
    """Return how many runs of ICP an explainer of causes needs beyond the one that it explains.

    Args:
        sees: what it sees.
        starts: of each registration, the observed one among them.
        descriptors: the settings of the registrations with remedies.
        reenactment: the runs of a re-enactment, at most.
    """
    further = starts - 1 if "runs" in sees else 0
    further += reenactment if "reenactment" in sees else 0
    if "remedies" in sees:
        return further + descriptors.remedy_calls
    return further + (descriptors.quick_remedy_calls if "quick_remedies" in sees else 0)
