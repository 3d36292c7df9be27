"""What the clouds do not determine of a pose, in words and as a covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gpca.numerals import in_decimals
from gpca.objects.canonical import CanonicalFrame
from gpca.reenactment.freedom import Freedom, Holder
from gpca.reenactment.surface import ModelSurface

AXES = ("x", "y", "z")
ALONG_DEG = 15.0  # largest angle between a direction and an axis of the target's frame that may name it
SLIDE, TURN = "slide", "turn"
ANY_DEG = 104.0  # standard deviation of an angle that may be any
MOSTLY_SLIDES = 0.3  # share of the displacement that is due to the rotation, up to which a direction is a slide
LEAST_POINTS = 32
NEAR = 3.0  # spacings and noises, up to which an observed point lies on the surface
OUT_OF_PLANE = "both clouds are flat, so nothing is measured out of their plane"


@dataclass(frozen=True)
class FreeDirection:
    """A slide or a turn that the clouds do not determine."""

    motion: str  # `SLIDE` or `TURN`
    axis: tuple[float, ...]  # (3,) unit vector in the target's frame, along which or about which
    through: tuple[float, ...]  # (3,) point on the axis of a turn
    deviation: float  # standard deviation: of a slide in the unit of the points, of a turn in degrees, up to `ANY_DEG`

    @property
    def words(self) -> str:
        """The direction."""
        return f"{self.motion} {'about' if self.motion == TURN else 'along'} {axis_in_words(self.axis)}"


@dataclass(frozen=True)
class Undetermined:
    """How uncertain the pose is given the clouds, where it fits best."""

    directions: tuple[FreeDirection, ...]  # in which the pose is free
    flat: bool  # whether both clouds are outlines in a plane, out of which nothing is measured
    covariance: np.ndarray  # (6, 6) of the twist (rotation, translation) on the left of T_target_source about `center`:
    # radians and the unit of the points; large along free directions
    center: tuple[float, ...]  # (3,) in the target's frame

    @classmethod
    def of(cls, freedom: Freedom) -> Undetermined:
        """Put free directions into words, in the frame and the unit of the points."""
        center, directions = freedom.center_3, list[FreeDirection]()
        for twist_6 in elementary(freedom.free_twists, freedom.metric_6_6):
            along_6 = freedom.metric_6_6 @ twist_6
            deviation = float(np.sqrt(along_6 @ freedom.covariance @ along_6))
            turn_3, shift_3 = twist_6[:3], twist_6[3:]
            if (angle := float(np.linalg.norm(turn_3))) == 0:
                directions.append(FreeDirection(SLIDE, _upward(shift_3), tuple(center.tolist()), deviation))
                continue
            axis_3, turned_deg = turn_3 / angle, float(np.rad2deg(deviation * angle))
            through = tuple((center + np.cross(axis_3, shift_3) / angle).tolist())
            directions.append(FreeDirection(TURN, _upward(axis_3), through, min(turned_deg, ANY_DEG)))
        return cls(tuple(directions), freedom.flat is not None, freedom.covariance, tuple(center.tolist()))

    def outside(self, frame: CanonicalFrame) -> Undetermined:
        """Convert from a canonical frame to the user's frame and unit of length."""
        unit_6 = np.repeat([1.0, frame.diameter], 3)

        def placed(point: tuple[float, ...]) -> tuple[float, ...]:
            return tuple((frame.center_3 + frame.diameter * np.array(point)).tolist())

        directions = []
        for each in self.directions:
            deviation = each.deviation * (frame.diameter if each.motion == SLIDE else 1.0)
            directions.append(replace(each, through=placed(each.through), deviation=deviation))
        covariance = self.covariance * np.outer(unit_6, unit_6)
        return replace(self, directions=tuple(directions), covariance=covariance, center=placed(self.center))

    @property
    def words(self) -> str:
        """What to know of the pose; empty if it is determined."""
        slides, turns = ([each for each in self.directions if each.motion == motion] for motion in (SLIDE, TURN))
        phrases = [each.words for each in slides]
        if len(slides) == 2:
            phrases = [f"slide across {axis_in_words(_upward(np.cross(slides[0].axis, slides[1].axis)))}"]
        phrases += ["turn about any axis"] if len(turns) == 3 else [each.words for each in turns]
        free = f"the pose is free to {' and to '.join(phrases)}" if phrases else ""
        return "; ".join(filter(None, (free, OUT_OF_PLANE if self.flat else "")))

    def lines(self, unit: str) -> list[str]:
        """At most one line of text."""
        deviations = []
        for each in self.directions:
            by = f"{each.deviation:.0f}°" if each.motion == TURN else f"{in_decimals(each.deviation)} {unit}"
            deviations.append(f"{each.words} ± {by}")
        return [f"free      {'; '.join(deviations)}"] if deviations else []


def lying_on(surface: ModelSurface, points: np.ndarray, noise: float) -> np.ndarray:
    """Return which points (N,) of (N, 3) lie on a surface, or all if hardly any does."""
    near_N = surface.tree.query(points)[0] <= NEAR * np.hypot(surface.spacing, noise)
    return near_N if near_N.sum() >= LEAST_POINTS else np.ones(len(points), bool)


def undetermined_at(points: np.ndarray, surface: ModelSurface, open_ends: bool = False) -> Undetermined:
    return Undetermined.of(Holder(surface.points, surface.tree, open_ends).freedom(points))


def elementary(twists_k_6: np.ndarray, metric_6_6: np.ndarray) -> list[np.ndarray]:
    """Return slides, and turns without them, that span motions (k, 6) about the center of the points."""
    if not len(twists_k_6):
        return []
    turning_k_6 = twists_k_6 * np.repeat([1.0, 0.0], 3)
    square_k, mixture_k_k = np.linalg.eigh(turning_k_6 @ metric_6_6 @ turning_k_6.T)
    spanning = mixture_k_k.T @ twists_k_6
    motions, slides = [], []
    for square, twist_6 in zip(square_k, spanning, strict=True):
        if square <= MOSTLY_SLIDES**2:
            twist_6 = twist_6 * np.repeat([0.0, 1.0], 3)
            slides.append(twist_6[3:] / np.linalg.norm(twist_6[3:]))
        else:
            turn_3, shift_3 = twist_6[:3], twist_6[3:].copy()
            # Without what slides along the axis: of a screw, the turn is meant.
            for slide_3 in (*slides, turn_3 / np.linalg.norm(turn_3)):
                shift_3 = shift_3 - (shift_3 @ slide_3) * slide_3
            twist_6 = np.concatenate([turn_3, shift_3])
        motions.append(twist_6 / np.sqrt(twist_6 @ metric_6_6 @ twist_6))
    return motions


def axis_in_words(axis: Sequence[float]) -> str:
    along = int(np.argmax(np.abs(axis)))
    if abs(axis[along]) >= np.cos(np.deg2rad(ALONG_DEG)):
        return f"the target's {AXES[along]} axis"
    return f"the target's axis ({', '.join(f'{part:.2f}' for part in axis)})"


def _upward(axis_3: np.ndarray) -> tuple[float, ...]:
    unit_3 = axis_3 / np.linalg.norm(axis_3)
    return tuple((unit_3 * np.sign(unit_3[np.abs(unit_3).argmax()])).tolist())
