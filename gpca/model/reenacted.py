"""What a re-enactment says of one registration, for its user: other poses that fit, and what each cause does.

Lengths are relative to the diameter, and poses in the target's canonical frame, until they are taken outside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from gpca.alignment.canonical_frame import CanonicalFrame
from gpca.alignment.rigid import inverse
from gpca.alignment.twist import log
from gpca.causes.shapley import ALL, shapley_values
from gpca.objects.bop import symmetric_turn
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.enactment import Enactment
from gpca.reenactment.hypotheses import SAME
from gpca.reenactment.surface import ModelSurface

AXES = ("x", "y", "z")
ALONG_DEG = 15.0  # from an axis of the target's frame, within which a turn is called one about it
SMALL_TURN_DEG = 3.0  # that is not worth a word beside a shift


@dataclass(frozen=True)
class FittingPose:
    """A pose that may be the true one.

    Attributes:
        probability: among all poses that fit.
        T_target_source: 4×4; until it is taken outside, of what was observed where the registration began.
        registered: whether it is the registration's result: nowhere farther from it than poses that are told apart.
        apart: mean distance of the target's surface at this pose from its surface at the result.
        turn_deg: least angle from the result, up to turns that leave the target's shape as it is.
        axis: (3,) unit vector in the target's frame, about which that turn is.
        shift: of the target's center, from the result.
        error: v̂, the mean error that re-enacted registrations have if this pose is true.
    """

    probability: float
    T_target_source: np.ndarray
    registered: bool
    apart: float
    turn_deg: float
    axis: tuple[float, float, float]
    shift: float
    error: float

    def words(self, unit: str, fits: str) -> str:
        """Return where it lies from the result, behind the word that it fits."""
        if self.registered:
            return f"{fits} as registered, within {self.apart:.2g} {unit}"
        if self.turn_deg < SMALL_TURN_DEG:
            return f"{fits} moved by {self.shift:.2g} {unit}"
        return f"{fits} turned by {self.turn_deg:.0f}° about {axis_in_words(self.axis)}, {self.shift:.2g} {unit} away"


@dataclass(frozen=True)
class Reenacted:
    """The counterfactuals of one registration under the poses that fit.

    Attributes:
        error: v̂ with all causes, the mean over the poses.
        effects: φ̂, what each cause adds to that error.
        noise, outliers, missing: standard deviation of the noise per axis, share of points that are outliers, share of
            the target that was not observed, if the most probable pose is true.
        poses: the most probable first.
    """

    error: float
    effects: dict[str, float]
    noise: float
    outliers: float
    missing: float
    poses: tuple[FittingPose, ...]

    @classmethod
    def of(
        cls,
        enactments: Sequence[Enactment],
        weight_k: np.ndarray,
        T_result: np.ndarray,
        surface: ModelSurface,
    ) -> Reenacted:
        """Return what the re-enactments of a pair say.

        Args:
            weight_k: (k,) probabilities of their hypotheses.
            T_result: 4×4, that the registration found.
            surface: of the target.
        """
        error_k_8 = np.array([enactment.error_8 for enactment in enactments])
        mean_8 = (weight_k[:, None] * error_k_8).sum(axis=0)
        severity = enactments[0].candidate.severity
        poses = [
            _fitting(enactment, float(weight), T_result, surface)
            for enactment, weight in zip(enactments, weight_k, strict=True)
        ]
        return cls(
            error=float(mean_8[ALL]),
            effects=dict(zip(CONCEPTS, shapley_values(mean_8[None])[0].tolist(), strict=True)),
            noise=severity["noise"],
            outliers=severity["outliers"],
            missing=severity["crop"],
            poses=tuple(poses),
        )

    def outside(self, frame: CanonicalFrame, T_target_source_init: np.ndarray) -> Reenacted:
        """Return it in the user's frame and unit of length.

        Args:
            frame: the target's.
            T_target_source_init: 4×4 in that unit, where the registration began.
        """
        poses = tuple(
            replace(
                pose,
                T_target_source=frame.pose_outside(pose.T_target_source) @ T_target_source_init,
                **{name: getattr(pose, name) * frame.diameter for name in ("apart", "shift", "error")},
            )
            for pose in self.poses
        )
        effects = {cause: effect * frame.diameter for cause, effect in self.effects.items()}
        lengths = {"error": self.error * frame.diameter, "noise": self.noise * frame.diameter}
        return replace(self, **lengths, effects=effects, poses=poses)

    def as_dict(self) -> dict[str, object]:
        """Return numbers, lists and names, for JSON."""
        poses = [
            asdict(pose) | {"T_target_source": pose.T_target_source.tolist(), "axis": list(pose.axis)}
            for pose in self.poses
        ]
        return asdict(self) | {"poses": poses}

    def words(self, unit: str) -> list[str]:
        """Return where each of the poses lies from the result, behind the word that it fits."""
        return [pose.words(unit, "also fits" if number else "fits") for number, pose in enumerate(self.poses)]

    def lines(self, unit: str) -> list[str]:
        """Return it for a reader."""
        effects = ", ".join(f"{cause} {effect:.2g}" for cause, effect in self.effects.items())
        parts = f"{self.outliers:.0%} outliers, {self.missing:.0%} of the surface missing"
        poses = [
            f"{words}: probability {pose.probability:.2f}"
            for words, pose in zip(self.words(unit), self.poses, strict=True)
        ]
        return [
            f"effects   on the re-enacted error of {self.error:.2g} {unit}: {effects}",
            f"observed  noise of {self.noise:.2g} {unit}, {parts}",
            *(f"pose {number}    the object {words}" for number, words in enumerate(poses, 1)),
        ]


def axis_in_words(axis: Sequence[float]) -> str:
    """Return what to call an axis (3,), a unit vector in the target's frame."""
    along = int(np.argmax(np.abs(axis)))
    if abs(axis[along]) >= np.cos(np.deg2rad(ALONG_DEG)):
        return f"the target's {AXES[along]} axis"
    return f"the axis ({', '.join(f'{part:.2f}' for part in axis)}) of the target's frame"


def _fitting(enactment: Enactment, probability: float, T_result: np.ndarray, surface: ModelSurface) -> FittingPose:
    T = enactment.hypothesis.T
    from_result = T @ inverse(T_result)
    # Of all motions that take the source as well from the result to here, the one with the least turn.
    least = from_result.copy()
    least[:3, :3] = symmetric_turn(from_result[:3, :3].T, surface.symmetries).T @ from_result[:3, :3]
    turn_3 = log(least[None])[0, :3]
    angle = float(np.sqrt(np.square(turn_3).sum()))
    axis = turn_3 / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
    apart = float(surface.apart(from_result[None])[0])
    return FittingPose(
        probability=probability,
        T_target_source=T,
        registered=apart <= SAME,
        apart=apart,
        turn_deg=float(np.rad2deg(angle)),
        axis=(float(axis[0]), float(axis[1]), float(axis[2])),
        shift=float(np.sqrt(np.square(from_result[:3, 3]).sum())),
        error=float(enactment.error_8[ALL]),
    )
