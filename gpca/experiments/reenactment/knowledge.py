"""What a re-enactment may be told of the truth: nothing, or the truth about some of the causes.

Nothing here needs the code that re-enacts.
"""

from __future__ import annotations

from collections.abc import Mapping

from gpca.causes.truth import ALL, BY_SIZE, SUBSETS
from gpca.pairs.perturbation import CONCEPTS, NOISE, OVERLAP, POSE

NOTHING, EVERYTHING = "nothing", "everything"
TOLD = {POSE: "true pose", NOISE: "points without noise", OVERLAP: "missing surface"}  # of each cause, in words


def _name(subset: int) -> str:
    causes = SUBSETS[subset]
    return EVERYTHING if subset == ALL else "_".join(CONCEPTS[cause] for cause in causes) or NOTHING


# Name -> the causes about which the truth is known; the fewest first.
KNOWN: Mapping[str, tuple[int, ...]] = {_name(subset): SUBSETS[subset] for subset in BY_SIZE}


def in_words(name: str) -> str:
    """Return what a table prints, such as ``true pose + missing surface``."""
    told = [words for cause, words in TOLD.items() if cause in KNOWN[name]]
    return {NOTHING: "nothing: the estimate", EVERYTHING: "all three"}.get(name) or " + ".join(told)
