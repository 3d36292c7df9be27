"""The virtual tables of a run, where explainers learn, are calibrated, actions are rehearsed, and policies are judged.

No two parts share a table.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from gpca.errors import InputError
from gpca.experiments.recovery.cases import FEWEST_POINTS, register_first
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.meshes import simplified
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
) -> Registrations:
    """Register situations of all causes, failed or not, from which the classifier learns and is calibrated.

    Samples 3t to 3t + 2 of a split are of the three causes. The calibration samples are the split ``test``.

    Args:
        situations: those of ``train`` and ``test``, which share no table.

    Raises:
        InputError: the camera sees too little of the objects.
    """
    records = []
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
            records.append(start.record | {"sample": number, "split": split})
    return as_registrations(records)[0]
