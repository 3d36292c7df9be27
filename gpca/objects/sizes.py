"""Sizes of objects and units of length: which ones are plausible, and what the user is advised."""

from itertools import product
from typing import NamedTuple

import numpy as np

from gpca.errors import InputError
from gpca.numerals import in_decimals
from gpca.objects.surface import METERS_PER_UNIT, UNIT_NAMES, meters_per

SMALLEST_DIAMETER_M, LARGEST_DIAMETER_M = 1e-3, 10.0
LARGEST_RATIO = 8.0  # between the extents of source and target; a wrong unit gives 10 or more
SAME_SIZE = 3.0  # ratio up to which other units explain the difference


class Remedies(NamedTuple):
    """How a user sets the unit of all clouds, or that of the source and the target; what has no limits of size."""

    unit: str = "set unit: {}"
    units: str = ""
    scans: str = ""


IN_CONFIG = Remedies()
AS_OPTIONS = Remedies("give --unit {}", "give --source-unit {} --unit {}", "scans of any size: --scans")
IN_PYTHON = Remedies("pass unit='{}'", "pass source_unit='{}', unit='{}'", "scans of any size: gpca.explain_scans")


def is_of_an_object(diameter_m: float) -> bool:
    return SMALLEST_DIAMETER_M <= diameter_m <= LARGEST_DIAMETER_M


def require_size(diameter_m: float, subject: object, unit: str | None = None, say: Remedies = IN_CONFIG) -> None:
    """Raise an InputError unless a diameter is 1 mm to 10 m; advise another unit than the given one, if one fits."""
    if is_of_an_object(diameter_m):
        return
    guesses: tuple[str, ...] = ("mm", "cm") if diameter_m > LARGEST_DIAMETER_M else ("m", "cm")
    if unit is not None:
        factors = {guess: METERS_PER_UNIT[guess] / meters_per(unit) for guess in guesses}
        guesses = tuple(guess for guess, factor in factors.items() if is_of_an_object(diameter_m * factor))
    limits = f"{in_decimals(1e3 * SMALLEST_DIAMETER_M)} mm to {in_decimals(LARGEST_DIAMETER_M)} m"
    fault = f"its diameter is {in_decimals(diameter_m, 4)} m, but objects span {limits}"
    asked = [f"is it in {UNIT_NAMES[guess]}? {say.unit.format(guess)}" for guess in guesses[:1]]
    raise InputError(subject, fault, "; ".join(filter(None, [*asked, say.scans])))


def extent(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def require_sizes(
    subjects: tuple[object, object],
    extents: tuple[float, float],
    diameter: float,
    units: tuple[str, str],
    say: Remedies,
) -> None:
    """Raise an InputError if the units of source and target seem to differ by these extents, or for no object."""
    size_m, target_m = (size * meters_per(unit) for size, unit in zip(extents, units, strict=True))
    ratio = size_m / target_m if target_m > 0 else 1.0
    differ = not 1 / LARGEST_RATIO <= ratio <= LARGEST_RATIO
    if differ:
        fitting = [
            (first, second)
            for first, second in product(METERS_PER_UNIT, repeat=2)
            if (first == units[0] or second == units[1] or {first, second} == {"m", "mm"})
            and all(map(is_of_an_object, pair_m := (extents[0] * meters_per(first), extents[1] * meters_per(second))))
            and 1 / SAME_SIZE <= pair_m[0] / pair_m[1] <= SAME_SIZE
        ]
        if fitting:
            kept = max(fitting, key=lambda pair: (pair[0] == units[0]) + (pair[1] == units[1]))
            looks = f"{in_decimals(max(ratio, 1 / ratio))} times {'larger' if ratio > 1 else 'smaller'}"
            remedy = f"their units seem to differ: {say.units.format(*kept)}"
            raise InputError(subjects[0], f"looks {looks} than the target", remedy)
    require_size(diameter * meters_per(units[1]), subjects[1], units[1], say)
    if differ:
        remedy = "give both in the same unit, without points far from the object"
        raise InputError(subjects[0], f"is {in_decimals(ratio, 3)} times as large as the target", remedy)
