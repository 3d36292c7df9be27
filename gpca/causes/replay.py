"""A sample's counterfactuals once more, for pictures: the candidate is drawn again and registered without starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpca.alignment.rigid import transform
from gpca.causes.candidate import draw_applied, draw_candidate
from gpca.causes.counterfactuals import Registrar
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import ALL, SUBSETS
from gpca.errors import InputError
from gpca.objects.canonical import ObjectClouds
from gpca.seeds import generator


@dataclass(frozen=True)
class Replay:
    """One sample under every subset of its causes.

    Attributes:
        model: (P, 3) in diameters.
        observed: for each of the eight subsets the observed cloud (Q, 3) where ICP put it in the model's frame.
    """

    model: np.ndarray
    observed: list[np.ndarray]


def replay(objects: ObjectClouds, causes: Causes, row: int, source: str, seed: int, settings: CauseSettings) -> Replay:
    """Return the results of ICP under each subset from the initial pose itself.

    Raises:
        InputError: the objects or the settings are not those that the sample was drawn with.
    """
    registrations = causes.registrations
    split, number = str(registrations.split[row]), int(causes.candidate[row])
    index = int(registrations.object_index[row])
    surface = objects.points(index).astype(np.float64) / float(objects.diameters_m[index])
    random = generator(source, seed, "causes", split, number)
    candidate = draw_candidate(surface, draw_applied(settings, random), settings, random)
    registrar = Registrar(candidate, settings)
    observed = []
    for present in SUBSETS:
        applied = tuple(cause for cause in present if candidate.applied[cause])
        runs = registrar.run(applied, np.zeros((1, 6)))
        observed.append(transform(runs.T_target_source_n[0], candidate.observed(applied)))
    shown = registrations.cloud(row)
    if shown.shape != observed[ALL].shape or np.abs(observed[ALL] - shown).max() > 1e-3:
        fault = "is not reproduced by these settings"
        raise InputError(
            f"sample {registrations.sample[row]} of {source}", fault, "regenerate the causes from a single config"
        )
    return Replay(candidate.model, observed)
