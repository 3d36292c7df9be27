"""Settings of the re-enactment (docs/causes.md); nothing here needs the code that it runs."""

from dataclasses import dataclass
from typing import Annotated

from gpca.causes.settings import Angle
from gpca.pairs.perturbation import CONCEPTS
from gpca.settings import Bounds, OpenShare, Positive, Share

STEEPNESS = 8.0  # of the probability of a failure in the logarithm of the error
SMALLEST_ERROR = 1e-4  # diameters, before its logarithm is taken


@dataclass(frozen=True)
class ReenactmentSettings:
    """What is believed of a pose error beforehand, and how many hypotheses of the true pose are enacted."""

    hypotheses: Annotated[int, Bounds(minimum=2, maximum=20)] = 4  # enacted of each pair, at most
    good_starts: OpenShare = 0.5  # how probable it is that the initial pose is good
    good_rotation_deg: Angle = 3.0  # root mean square angle
    good_translation: Positive = 0.017  # and length (diameters) of a good start's error
    bad_rotation_deg: Angle = 70.0  # and those of any other hypothesis
    bad_translation: Positive = 0.35
    lost_starts: Share = 0.0  # how probable it is that the initial pose says nothing, and any other is as likely

    def calls(self, starts: int) -> int:
        """Return how many runs of ICP take whole clouds, at most: of all subsets of the causes from so many starts."""
        return self.hypotheses * 2 ** len(CONCEPTS) * starts
