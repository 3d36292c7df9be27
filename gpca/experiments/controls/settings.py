"""Settings of the controls: nothing here needs torch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from gpca.errors import InputError
from gpca.settings import Bounds, Count, Different, Distinct

PAPER = "paper"  # the protocol itself, which every control is compared with
Control = Literal[
    "density",
    "unseen_objects",
    "hard",
    "reversed",
    "label_noise_30",
    "shuffled",
    "transfer",
]
CONTROLS: tuple[str, ...] = get_args(Control)
UNSEEN = "unseen_objects"
SEEN = "seen_objects"  # tests of the explainers for unseen objects on new samples of known objects
HARD = "hard"  # samples of its own, in which no state is perfect and the label is what was measured
RETRAINED = ("density", UNSEEN, HARD)  # need an encoder of their own
OF_EVERY_SEED = (UNSEEN, HARD)  # of these, the ones for which every seed has one
Training = Literal["random_draws"]
TRAININGS: tuple[str, ...] = get_args(Training)  # other ways to train the encoder, on the samples for unseen objects
WRONG_LABELS = {"label_noise_30": 0.3}  # share of the training labels
RELABELED = (*WRONG_LABELS, "shuffled")
TRANSFER = "transfer"
Points = Annotated[int, Bounds(minimum=32, maximum=65536)]


@dataclass(frozen=True)
class ControlSettings:
    """The controls, and their sizes.

    Attributes:
        controls: their names.
        encoders: other ways to train GP-CA's encoder, compared on known and on unseen objects.
        encoder_seeds: how many of `seeds`, from the first, train more encoders than those of `OF_EVERY_SEED`.
        seeds: how many of the run's seeds are used, from the first.
        draw_points: range of the random number of points of a cloud where density is matched.
        folds: the number of folds of a source's objects, of which one is unseen.
        bins: the number of equally wide bins of each severity.
    """

    controls: Distinct[Control] = ("density", "unseen_objects", "label_noise_30", "shuffled", "transfer")
    encoders: Annotated[tuple[Training, ...], Different(fewest=0)] = ()
    encoder_seeds: Count = 1
    seeds: Count = 3
    draw_points: tuple[Points, Points] = (200, 512)
    folds: Annotated[int, Bounds(minimum=2, maximum=5)] = 3
    bins: Annotated[int, Bounds(minimum=1, maximum=20)] = 4

    def __post_init__(self) -> None:
        if self.draw_points[0] > self.draw_points[1]:
            fault = f"{list(self.draw_points)} is in descending order"
            raise InputError("setting draw_points of controls", fault, "swap the two")


def trained_otherwise(explainer: str, way: str) -> str:
    """Return the name of an explainer whose encoder is trained in another way."""
    return f"{explainer}_{way}"


def plain_of(explainer: str) -> str | None:
    """Return the explainer that :func:`trained_otherwise` named so; None of one with the paper's training."""
    return next((explainer.removesuffix(f"_{way}") for way in TRAININGS if explainer.endswith(f"_{way}")), None)
