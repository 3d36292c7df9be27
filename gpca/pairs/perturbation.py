"""Controlled perturbations of the source, one concept at a time (paper Sec. IV-A); lengths are in diameters."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Annotated, Literal, get_args

import numpy as np
from scipy.spatial.transform import Rotation

from gpca.rigid import inverse, random_direction, rigid_motion, transform
from gpca.settings import Bounds, Share, require_ascending

Concept = Literal["noise", "pose", "overlap"]
CONCEPTS: tuple[str, ...] = get_args(Concept)
NOISE, POSE, OVERLAP = range(len(CONCEPTS))
# What the perturbation of each concept draws, as files name it.
SEVERITIES_OF = {"noise": ("noise",), "pose": ("rotation_rad", "translation"), "overlap": ("crop",)}
SEVERITIES = tuple(name for names in SEVERITIES_OF.values() for name in names)
HalfTurn = Annotated[float, Bounds(minimum=0, maximum=180)]  # in degrees
Shift = Annotated[float, Bounds(minimum=0, maximum=10)]  # in diameters
Hidden = Annotated[float, Bounds(minimum=0, maximum=0.95)]  # share; of what is left a pose has to be found


@dataclass(frozen=True)
class Severities:
    """Ranges (low, high) of the severities; lengths are relative to the diameter."""

    noise: tuple[Share, Share] = (0.01, 0.03)  # standard deviation of the Gaussian jitter
    rotation_deg: tuple[HalfTurn, HalfTurn] = (15.0, 60.0)  # angle of the pose error about a random axis
    translation: tuple[Shift, Shift] = (0.05, 0.30)  # its length in a random direction
    crop: tuple[Hidden, Hidden] = (0.20, 0.60)  # of the points, cut off by a half-space in a random direction

    def __post_init__(self) -> None:
        require_ascending("severity ", self, *(severity.name for severity in fields(self)))


@dataclass(frozen=True)
class Perturbed:
    """A source cloud and how it was made."""

    points: np.ndarray  # (P, 3) in the source frame, relative to the diameter
    # 4×4, takes the source back onto the target; identity unless the pose was perturbed.
    T_target_source_true: np.ndarray = field(default_factory=lambda: np.eye(4))
    severity: dict[str, float] = field(default_factory=dict)  # of `SEVERITIES`, those that were applied


def add_noise(points: np.ndarray, severities: Severities, random: np.random.Generator) -> Perturbed:
    sigma = random.uniform(*severities.noise)
    return Perturbed(points + random.normal(scale=sigma, size=points.shape), severity={"noise": sigma})


def misplace(points: np.ndarray, severities: Severities, random: np.random.Generator) -> Perturbed:
    """Rotate about a random axis through the object's center and shift in a random direction."""
    angle_rad = np.deg2rad(random.uniform(*severities.rotation_deg))
    distance = random.uniform(*severities.translation)
    T_source_target = misplacement(angle_rad, distance, random)
    severity = {"rotation_rad": angle_rad, "translation": distance}
    return Perturbed(transform(T_source_target, points), inverse(T_source_target), severity)


def misplacement(angle_rad: float, distance: float, random: np.random.Generator) -> np.ndarray:
    """Return the transform (4, 4) of a turn about a random axis and a shift in a random direction."""
    return displacement(angle_rad * random_direction(random), distance * random_direction(random))


def displacement(turn: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Return the transform (4, 4) of a rotation vector (3,), in radians, and then a shift (3,)."""
    return rigid_motion(Rotation.from_rotvec(turn).as_matrix(), shift)


def crop(points: np.ndarray, severities: Severities, random: np.random.Generator) -> Perturbed:
    """Cut off the points beyond a plane with a random normal, placed so that the drawn share is lost."""
    share = random.uniform(*severities.crop)
    return Perturbed(points[within_half_space(points @ random_direction(random), share, 1)], severity={"crop": share})


def within_half_space(along_N: np.ndarray, share: float, fewest: int) -> np.ndarray:
    """Return the rows, in order, that remain where a half-space, along toward it, takes a share of the points."""
    left = max(min(fewest, len(along_N)), round(len(along_N) * (1 - share)))
    return np.sort(np.argsort(along_N, kind="stable")[:left])


Perturbation = Callable[[np.ndarray, Severities, np.random.Generator], Perturbed]
PERTURBATIONS: dict[str, Perturbation] = {"noise": add_noise, "pose": misplace, "overlap": crop}
