"""The virtual tables of a run, where explainers learn, are calibrated, actions are rehearsed, and policies are judged.

No two parts share a table.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from gpca.errors import InputError
from gpca.experiments.recovery.cases import FEWEST_POINTS, register_first
from gpca.experiments.recovery.episodes import Episode
from gpca.frames.dataset import simplified
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.situations import REDRAWS, Shelf, Situations
from gpca.objects.surface import Surface
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import as_registrations
from gpca.process.progress import progress
from gpca.recovery.settings import LoopSettings, RecoverySettings

PARTS = ("train", "test", "rehearsals", "failures")


def lay_tables(
    surfaces: Iterable[Surface], settings: RecoverySettings, source: str, seed: int
) -> dict[str, Situations]:
    """Return the situations of every part; source and seed name all that is random in them.

    Raises:
        InputError: an object is a cloud of points, which hides nothing.
    """
    surfaces = [simplified(surface) for surface in surfaces]
    recovery = settings.section
    shelf = Shelf(surfaces, source, recovery["model_points"], InitialPoseSettings(**recovery["estimator"]))
    return {part: Situations(shelf, settings.situation, (source, seed, part)) for part in PARTS}


def register_situations(
    situations: Mapping[str, Situations], train: int, calibration: int, settings: LoopSettings
) -> dict[str, list[Episode]]:
    """Register situations of all causes, failed or not, from which explainers and the gate learn and are calibrated.

    Episodes 3t to 3t + 2 of a split are of the three causes. The calibration samples are the split ``test``.

    Args:
        situations: those of ``train`` and ``test``, which share no table.

    Raises:
        InputError: the camera sees too little of the objects.
    """
    registered: dict[str, list[Episode]] = {"train": [], "test": []}
    for split, count in (("train", train), ("test", calibration)):
        for number in progress(range(count), f"situations of split {split}"):
            cause = CONCEPTS[number % len(CONCEPTS)]
            for redraw in range(REDRAWS):
                situation, _ = situations[split].draw(cause, cause, number, redraw)
                start = register_first(situation, settings.cloud_points, settings.icp)
                if start is not None:
                    break
            else:
                fault = f"{REDRAWS} views of its objects show fewer than {FEWEST_POINTS} points of them"
                raise InputError("the virtual camera", fault, "give recovery.camera more pixels")
            registered[split].append(Episode(number, situation, start, settings.success))
    return registered


def as_samples(registered: Mapping[str, Iterable[Episode]]) -> Registrations:
    """Return the registrations of every split as samples of it."""
    records = [
        episode.outcomes[()].record | {"sample": episode.number, "split": split}
        for split, of_split in registered.items()
        for episode in of_split
    ]
    return as_registrations(records)[0]
