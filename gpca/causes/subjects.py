"""The objects of a source as the candidates need them, their clean pairs, and their splits."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gpca.alignment.pose_error import PoseErrors
from gpca.causes.candidate import draw_candidate, redrawn
from gpca.causes.counterfactuals import Counterfactuals, Registrar, Unmeasurable
from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import NONE
from gpca.errors import InputError
from gpca.io.files import SPLITS
from gpca.objects.bop import find_symmetries
from gpca.objects.canonical import ObjectClouds, drawn, unseen
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.seeds import generator
from gpca.uncertainty.spread import divergence

JUDGED_POINTS = 256  # of the model, over which an error is the mean
# Of an object's clean pairs. Where more are off, hardly any of its candidates would be kept; of the others, those whose
# own clean pair is off are refused one by one. Half would be a matter of chance for mugs, at so few pairs each.
MOST_FAILING = 0.9
MORE = 3  # times as many pairs again before an object is left out: a few may all be off by chance
FEWEST_FAMILIES = 2  # one for training, one for testing; intervals over objects need more


@dataclass(frozen=True)
class Subject:
    """One object.

    Attributes:
        index: its number in the file of the objects.
        family, fold: as :class:`gpca.objects.canonical.ObjectClouds` has them.
        surface: (N, 3) its points, in diameters.
        errors: of poses (n, 4, 4) of it, in diameters (n,); the identity is right.
    """

    index: int
    name: str
    diameter_m: float
    surface: np.ndarray
    symmetric: bool
    errors: Callable[[np.ndarray], np.ndarray]
    family: str
    fold: int

    @classmethod
    def of(cls, objects: ObjectClouds, index: int, symmetric: bool) -> Subject:
        """Return an object of the file."""
        diameter_m = float(objects.diameters_m[index])
        surface = objects.points(index).astype(np.float64) / diameter_m
        errors = PoseErrors(surface, JUDGED_POINTS, symmetric)
        return cls(
            index,
            str(objects.names[index]),
            diameter_m,
            surface,
            symmetric,
            errors,
            objects.family(index),
            objects.fold(index),
        )


def read_subjects(objects: ObjectClouds) -> list[Subject]:
    """Return the objects, with errors that respect their symmetries."""
    symmetries = (find_symmetries(objects.points(i), float(objects.diameters_m[i])) for i in range(len(objects)))
    return [Subject.of(objects, i, bool(symmetric)) for i, symmetric in enumerate(symmetries)]


def split_by_object(
    subjects: list[Subject], source: str, seed: int, settings: CauseSettings
) -> dict[str, list[Subject]]:
    """Return the subjects of each split; those of one family are in the same.

    Raises:
        InputError: fewer than two families.
    """
    family_N = np.array([subject.family for subject in subjects])
    if len(set(family_N.tolist())) < FEWEST_FAMILIES:
        fault = "has objects of one family alone, which cannot be split into training and test objects"
        raise InputError(f"causes of {source}", fault, "give objects of at least two families of shapes")
    is_test_N = unseen(np.array([subject.fold for subject in subjects]), seed)
    if is_test_N is None:
        is_test_N = drawn(family_N, settings.test_objects, source, seed, "causes", "objects")
    train, tested = SPLITS
    return {
        train: [subject for subject, is_test in zip(subjects, is_test_N, strict=True) if not is_test],
        tested: [subject for subject, is_test in zip(subjects, is_test_N, strict=True) if is_test],
    }


def measure_clean_pairs(
    subjects: list[Subject], source: str, seed: int, settings: CauseSettings
) -> tuple[list[Subject], float]:
    """Measure clean pairs, of which no cause is more than small.

    An object of which nearly all clean pairs are off is left out, unless the settings ask for samples of that kind.

    Returns:
        the subjects that are left; the limit of the uncertainty: the quantile `settings.limits.clean` of the divergence
        between two clean pairs of the same object, with equal numbers of points, from the same starts.

    Raises:
        InputError: no object is left.
    """
    left, uncertainties = [], []
    count = -(-settings.clean_pairs // len(subjects))
    for subject in progress(subjects, f"clean pairs of {source}, seed {seed}"):
        measured = [_clean_pair(subject, source, seed, number, settings) for number in range(count)]
        if _most_are_off(measured, settings) and not settings.shares.geometry:
            further = [_clean_pair(subject, source, seed, count + number, settings) for number in range(MORE * count)]
            if _most_are_off(looked_at := measured + further, settings):
                print(
                    f"causes of {source}: object '{subject.name}' is skipped: nearly all of {len(looked_at)} clean "
                    f"pairs have an error of at least {100 * settings.limits.nominal:g} % of the diameter or cannot be "
                    "registered",
                    file=sys.stderr,
                )
                continue
        left.append(subject)
        uncertainties += [pair[1] for pair in measured if pair is not None]
    if not uncertainties:
        limit = f"{100 * settings.limits.nominal:g} % of the diameter"
        fault = f"nearly all clean pairs of every object have an error of at least {limit} or cannot be registered"
        raise InputError(f"causes of {source}", fault, "raise causes.limits.nominal or causes.points")
    return left, float(np.quantile(uncertainties, settings.limits.clean))


def _most_are_off(pairs: list[tuple[float, float] | None], settings: CauseSettings) -> bool:
    """Return whether the share of the pairs that are off, or have no error, is above `MOST_FAILING`."""
    right = sum(pair is not None and pair[0] < settings.limits.nominal for pair in pairs)
    return len(pairs) - right > MOST_FAILING * len(pairs)


def _clean_pair(
    subject: Subject, source: str, seed: int, number: int, settings: CauseSettings
) -> tuple[float, float] | None:
    """Return error and uncertainty of a clean pair, None where it has none."""
    random = generator(source, seed, "causes", "clean", subject.name, number)
    first = draw_candidate(subject.surface, np.zeros(len(CONCEPTS), bool), settings, random)
    second = redrawn(first, subject.surface, random)
    xi_n_6 = random.normal(size=(settings.starts, 6)) * settings.deviation_6()
    runs = [Counterfactuals(Registrar(pair, settings), subject.errors, xi_n_6, settings) for pair in (first, second)]
    try:
        uncertainty = divergence(runs[0].covariance(NONE), runs[1].covariance(NONE), settings.floor)
        return runs[0].error(NONE), float(uncertainty)
    except Unmeasurable:
        return None
