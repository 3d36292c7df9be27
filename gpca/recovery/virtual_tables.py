"""The virtual tables of a run: those that explainers learn from, those that they are calibrated on, those of failures.

No two parts share a table.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gpca.alignment.pose_error import CORRECT
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.situations import Shelf, Situations
from gpca.objects import procedural
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import as_registrations
from gpca.progress import progress
from gpca.recovery.cases import register_first
from gpca.recovery.settings import LoopSettings, RecoverySettings

PARTS = ("train", "test", "failures")


def lay_tables(settings: RecoverySettings, source: str, seed: int) -> dict[str, Situations]:
    """Return the situations of every part; source and seed name all that is random in them."""
    families = settings.situation.scenes.families
    recovery = settings.section
    surfaces = [surface for family in families for surface in procedural.surfaces(family)]
    shelf = Shelf(surfaces, source, recovery["model_points"], InitialPoseSettings(**recovery["estimator"]))
    return {part: Situations(shelf, settings.situation, (source, seed, part)) for part in PARTS}


def register_situations(
    situations: Mapping[str, Situations], train: int, calibration: int, settings: LoopSettings
) -> tuple[Registrations, np.ndarray]:
    """Register situations of all causes, failed or not: what the classifier learns from, and is calibrated on.

    Samples 3t to 3t + 2 of a split are of the three causes. The calibration samples are the split ``test``.

    Args:
        situations: those of ``train`` and ``test``, which share no table.

    Returns:
        the registrations, and which of them failed (S,).
    """
    records, failed = [], []
    for split, count in (("train", train), ("test", calibration)):
        for number in progress(range(count), f"situations of split {split}"):
            cause = CONCEPTS[number % len(CONCEPTS)]
            start, redraw = None, 0
            while start is None:
                situation, _ = situations[split].draw(cause, cause, number, redraw)
                start = register_first(situation, settings.cloud_points, settings.icp)
                redraw += 1
            records.append(start.record | {"sample": number, "split": split})
            failed.append(start.error > CORRECT)
    return as_registrations(records)[0], np.array(failed)
