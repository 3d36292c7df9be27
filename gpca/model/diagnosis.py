"""The diagnosis of one registration: its state, the causes of a failure, guarantees and a re-enactment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from typing import Any, Self

import numpy as np

from gpca.causes.policy import NOTHING, QUEUE
from gpca.causes.truth import ALL, FAILED, NOMINAL, shapley_values
from gpca.evaluation.conformal import ALARM, GOOD, NOT_SURE
from gpca.guarantee.guarantee import SEVERAL, Guarantee
from gpca.model.undetermined import Undetermined, axis_in_words, lying_on, undetermined_at
from gpca.numerals import in_decimals
from gpca.objects.bop import symmetric_turn
from gpca.objects.canonical import CanonicalFrame
from gpca.pairs.perturbation import CONCEPTS
from gpca.reenactment.enactment import QUIET, Enactment
from gpca.reenactment.hypotheses import SAME
from gpca.reenactment.scale import Scale, find_scale
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, log, transform
from gpca.seeds import generator

UNKNOWN = "unknown"  # state of a pair whose scores mean nothing
LIKELY = 0.5  # probability from which a concept is named as a cause
SMALLEST = 1e-9  # least probability of a cause
IN_WORDS = {SEVERAL: "several causes"}
AS_FAR = "initial poses this far off"
NO_GUARANTEE = "guarantee none: a fast explanation, an unusual pair or tolerance, or a model without one"
SMALL_TURN_DEG = 3.0  # smaller rotations are not mentioned
CHECK = "check"  # action for a pair whose scores mean nothing
RERUN = "rerun"  # action where the re-enactment knows a better pose
TAKE = "take"  # action where a repaired pose takes the place of the registered one
RESCALE = "rescale"  # action where source and target differ in scale
REFINE = "refine"  # action for a given pose from which a registration would succeed
SURE = 0.5  # probability of a pose from which the advice is to start from it
LENGTHS = ("apart", "shift", "error", "noise", "noise_floor", "tolerance", "expected_error", "differs_by")  # fields
AGAIN = "start again from pose 1 (--save-pose writes it)"
ADVICE = {  # per branch of the policy
    NOTHING: "none",
    "reinitialize": "reinitialize ICP with a broader search",
    "new_view": "change the viewpoint",
    "denoise": "filter the source and check the sensor",
    CHECK: "check what was given",
    RERUN: f"run 'gpca repair' in the same way, or {AGAIN}",
    TAKE: "use the repaired pose (--save-pose writes it)",
    REFINE: "register from this pose",
    RESCALE: "rescale the source, or check the units",
    QUEUE: "queue for labeling, so that the cause can be learned",
}


def plain(items: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """Return the fields of a dataclass for JSON: arrays and tuples as lists."""
    values = {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in items}
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


def result_line(probability: float, limit: float, share: float, unit: str) -> str:
    """One line of text on how probably a pose is off by more than a limit, which is a share of the diameter."""
    above = f"{in_decimals(limit)} {unit} ({100 * share:.2g}% of the diameter)"
    return f"result    probability {probability:.2f} of an error above {above}"


def outside(part: Any, frame: CanonicalFrame, T_target_source_init: np.ndarray) -> Any:
    """Convert what a dataclass, and those in it, have in a canonical frame to that of the initial pose and its unit."""
    if isinstance(part, tuple):
        return tuple(outside(each, frame, T_target_source_init) for each in part)
    if isinstance(part, Undetermined):
        return part.outside(frame)
    if not is_dataclass(part) or isinstance(part, type):
        return part
    values = {each.name: outside(getattr(part, each.name), frame, T_target_source_init) for each in fields(part)}
    values |= {name: frame.diameter * values[name] for name in LENGTHS if name in values}
    if isinstance(part, FittingPose):
        values["T_target_source"] = frame.pose_outside(part.T_target_source) @ T_target_source_init
    if isinstance(part, Reenacted):
        values["effects"] = {cause: effect * frame.diameter for cause, effect in part.effects.items()}
    return replace(part, **values)


@dataclass(frozen=True)
class Guaranteed:
    """Guarantees for one registration (:mod:`gpca.guarantee`)."""

    states: tuple[str, ...]  # possible states of the registration
    level: float  # probability that they contain the true one
    call: str  # good, not sure or failed
    missed: float  # largest probability that a failure is called good
    false_alarms: float  # largest probability that a good registration is called failed
    families: int  # number of families of shapes used for calibration; 0 if samples were exchangeable one by one
    samples: int  # number of registrations used for calibration
    labeled: bool  # whether a user labeled these, in groups as families

    @classmethod
    def of(cls, guarantee: Guarantee, scores_1_K: np.ndarray) -> Guaranteed:
        """Apply a guarantee to the state scores of one registration."""
        sets, alarm = guarantee.state_sets, guarantee.failure_alarm
        return cls(
            states=tuple(np.array(sets.states)[guarantee.sets(scores_1_K)[0]].tolist()),
            level=sets.level,
            call=str(guarantee.alarm(1 - scores_1_K[:, 0])[0]),
            missed=alarm.missed,
            false_alarms=alarm.false_alarms,
            families=guarantee.families,
            samples=guarantee.samples,
            labeled=guarantee.labeled,
        )

    def lines(self) -> list[str]:
        """Return lines of text."""
        states = " or ".join(IN_WORDS.get(state, state) for state in self.states)
        name, (answer, risk) = f"{self.level:.0%} set", self.alarm
        return [
            f"{name:10}{states} (such a set holds the true state in {self.level:.0%} of cases)",
            f"alarm     {answer} ({risk})",
            f"guarantee both are calibrated {self.basis}",
        ]

    @property
    def alarm(self) -> tuple[str, str]:
        """Whether the failure alarm is raised, and how often that is wrong, in words."""
        if self.call == ALARM:
            return "raised", f"at most {self.false_alarms:.0%} of good registrations raise it"
        if self.call == GOOD:
            return "not raised", f"at most {self.missed:.0%} of failures do not raise it"
        return self.call, "neither answer would keep its bound on errors here"

    @property
    def basis(self) -> str:
        """What was used for calibration, and what the guarantee holds for, in words."""
        if not self.labeled:
            shapes = f"{self.families} unseen families of shapes" if self.families else "unseen objects"
            return f"on {shapes}, for objects like these"
        groups = f" of {self.families} groups, for a new group" if self.families else ", for others like these"
        return f"on {self.samples} labeled registrations{groups}"


def state_probabilities(causes_N_3: np.ndarray, result_N: np.ndarray) -> np.ndarray:
    """Return probabilities (N, 5) of `STATES`, from those of failed results (N,) and independent causes (N, 3)."""
    causes_N_3 = np.clip(causes_N_3, SMALLEST, 1)
    rest_N_3 = 1 - causes_N_3
    others_N_3 = np.stack([np.delete(rest_N_3, c, axis=1).prod(axis=1) for c in range(rest_N_3.shape[1])], axis=1)
    alone_N_3, none_N_1 = causes_N_3 * others_N_3, rest_N_3.prod(axis=1, keepdims=True)
    several_N_1 = np.maximum(1 - none_N_1 - alone_N_3.sum(axis=1, keepdims=True), 0)
    share_N_3 = causes_N_3 / causes_N_3.sum(axis=1, keepdims=True)
    if_failed_N_4 = np.hstack([alone_N_3 + none_N_1 * share_N_3, several_N_1])
    return np.hstack([1 - result_N[:, None], result_N[:, None] * if_failed_N_4])


@dataclass(frozen=True)
class FittingPose:
    """A hypothesis of the true pose."""

    probability: float  # among all hypotheses
    T_target_source: np.ndarray  # (4, 4); inside the canonical frame, relative to the initial pose
    registered: bool  # whether it equals the registration's result, up to the resolution of hypotheses
    apart: float  # mean distance between the target's surface at this pose and at the result
    turn_deg: float  # smallest rotation from the result, up to the target's symmetry
    axis: tuple[float, ...]  # (3,) unit vector of that rotation in the target's frame
    shift: float  # distance of the target's center from its place at the result
    error: float  # v̂, mean error of re-enacted registrations if this pose is true

    @classmethod
    def of(
        cls, T: np.ndarray, probability: float, error: float, T_result: np.ndarray, surface: ModelSurface, **more: Any
    ) -> Self:
        """Compare a hypothesis with the registration's result."""
        from_result = T @ inverse(T_result)
        # Among the motions from the result to this pose that are equivalent by symmetry, take the smallest rotation.
        least = from_result.copy()
        least[:3, :3] = symmetric_turn(from_result[:3, :3].T, surface.symmetries).T @ from_result[:3, :3]
        turn_3 = log(least[None])[0, :3]
        angle = float(np.sqrt(np.square(turn_3).sum()))
        axis_3 = turn_3 / angle if angle > 0 else np.array([0.0, 0.0, 1.0])
        apart = float(surface.apart(from_result[None])[0])
        return cls(
            probability=probability,
            T_target_source=T,
            registered=apart <= SAME,
            apart=apart,
            turn_deg=float(np.rad2deg(angle)),
            axis=tuple(axis_3.tolist()),
            shift=float(np.sqrt(np.square(from_result[:3, 3]).sum())),
            error=error,
            **more,
        )

    def words(self, unit: str) -> str:
        """Say how far the pose is from the result."""
        if self.registered:
            return f"the result, within {in_decimals(self.apart)} {unit}"
        turn = f"{self.turn_deg:.0f}° about {axis_in_words(self.axis)} and " * (self.turn_deg >= SMALL_TURN_DEG)
        return f"{turn}{in_decimals(self.shift)} {unit} away from the result"


@dataclass(frozen=True)
class Reenacted:
    """Counterfactuals under hypotheses of the true pose, in diameters and the canonical frame until :func:`outside`."""

    error: float  # v̂ with all causes, the mean over the hypotheses
    effects: dict[str, float]  # φ̂, the contribution of each cause to that error
    noise: float  # standard deviation per axis, under the most probable hypothesis, as the next two
    outliers: float  # share of the observed points
    missing: float  # share of the target that was not observed
    poses: tuple[FittingPose, ...]  # the hypotheses, most probable first
    undetermined: Undetermined | None = None  # directions in which the most probable pose is free
    scale: Scale | None = None  # of the source relative to the target
    noise_floor: float = QUIET  # noise up to this is taken for none, as the target's own sampling may make it

    @classmethod
    def of(
        cls, enactments: Sequence[Enactment], weight_k: np.ndarray, T_result: np.ndarray, surface: ModelSurface
    ) -> Reenacted:
        """Summarize the re-enactments of a pair: `weight_k` are the probabilities of their hypotheses."""
        error_k_8 = np.array([enactment.error_8 for enactment in enactments])
        mean_8 = (weight_k[:, None] * error_k_8).sum(axis=0)
        severity = enactments[0].candidate.severity
        return cls(
            error=float(mean_8[ALL]),
            effects=dict(zip(CONCEPTS, shapley_values(mean_8[None])[0].tolist(), strict=True)),
            noise=severity["noise"],
            outliers=severity["outliers"],
            missing=severity["crop"],
            poses=tuple(
                FittingPose.of(enactment.hypothesis.T, float(weight), float(enactment.error_8[ALL]), T_result, surface)
                for enactment, weight in zip(enactments, weight_k, strict=True)
            ),
        )

    def with_fit(self, observed: np.ndarray, T_result: np.ndarray, surface: ModelSurface, open_ends: bool) -> Reenacted:
        """Add what a cloud (N, 3) leaves undetermined, and its scale; with `open_ends`, the surface may go on."""
        first = self.poses[0]
        T_k = [first.T_target_source] if first.registered else [first.T_target_source, T_result]
        placed = transform(T_k[0], observed)
        near_N = lying_on(surface, placed, self.noise)
        undetermined = undetermined_at(placed[near_N], surface, open_ends)
        # Points beyond an open end say nothing of the scale.
        scale = find_scale(observed[near_N] if open_ends else observed, T_k, surface, generator("diagnosis", "scale"))
        return replace(self, undetermined=undetermined, scale=scale)

    @property
    def better(self) -> FittingPose | None:
        """The likeliest pose, if it is more likely than all others together and not the registration's result."""
        first = self.poses[0]
        return None if first.registered or first.probability < SURE else first

    def noise_words(self, unit: str) -> str:
        """The standard deviation of the noise per axis, or what it is below."""
        if self.noise <= self.noise_floor:
            return f"below {in_decimals(self.noise_floor)} {unit}"
        return f"{in_decimals(self.noise)} {unit}"

    def effects_line(self, unit: str) -> str:
        """One line of text on the effects of the causes."""
        effects = ", ".join(f"{cause} {in_decimals(effect)}" for cause, effect in self.effects.items())
        error = f"{in_decimals(self.error)} {unit}"
        return f"effects   {effects} {unit} (Shapley shares of the re-enacted error, {error})"

    def pose_lines(self, unit: str) -> list[str]:
        """One line of text per hypothesis."""
        poses = enumerate(self.poses, 1)
        return [f"pose {k}    probability {pose.probability:.2f}: {pose.words(unit)}" for k, pose in poses]

    @property
    def caveat(self) -> str:
        """What is not determined, and a scale that is off; empty if there is nothing to be known."""
        return "; ".join(filter(None, (part.words for part in (self.undetermined, self.scale) if part)))

    def fit_lines(self, unit: str) -> list[str]:
        """Lines of text on the scale and on free directions, if there are any."""
        scale = [f"scale     {self.scale.words}"] if self.scale and self.scale.off else []
        return scale + (self.undetermined.lines(unit) if self.undetermined else [])

    def lines(self, unit: str) -> list[str]:
        """Lines of text."""
        parts = f"{self.outliers:.0%} outliers; {self.missing:.0%} of the target unseen"
        observed = f"observed  noise σ {self.noise_words(unit)} per axis, {parts}"
        return [observed, *self.fit_lines(unit), *self.pose_lines(unit)]


@dataclass(frozen=True)
class Diagnosis:
    """The diagnosis of one registration."""

    result: float  # probability that this pose is off by more than the tolerance
    threshold: float  # of the result, from which the state is failed
    tolerance: float  # largest error of a right result
    tolerance_share: float  # the same in diameters of the target
    start: float  # probability that registrations from initial poses this far off fail
    start_threshold: float  # from which the start is called bad
    causes: dict[str, float]  # probability of each concept to be a cause, given a failure
    variances: dict[str, float]  # their variances over the posterior draws (Eq. 5).
    bald: float  # largest BALD among the questions, nats (Eq. 7).
    expected_error: float  # expected error of this pose: ADD, up to the target's symmetry
    unlikeness: float  # distance to the training samples, scaled so that 1 % of them exceed 1
    void: bool  # whether the pair is such that no number here means anything (:mod:`gpca.model.clouds`)
    guarantee: Guaranteed | None  # set of states and alarm; None in fast diagnoses
    reenacted: Reenacted  # the counterfactuals

    @property
    def state(self) -> str:
        """``nominal``, ``failed`` or ``unknown``."""
        if self.void:
            return UNKNOWN
        return NOMINAL if self.result < self.threshold and not self.wrong_scale else FAILED

    @property
    def wrong_scale(self) -> bool:
        """Whether the scale is off by more than the tolerance explains."""
        scale = self.reenacted.scale
        return scale is not None and scale.off and scale.error > self.tolerance

    @property
    def statement(self) -> str:
        """The causes, or that nothing is wrong; and what to be aware of."""
        if named := " and ".join(self.named):
            return named
        nothing = "no failure is shown" if self.doubtful else "nothing is wrong"
        return f"{nothing}, but {self.caveat}" if self.caveat else nothing

    @property
    def caveat(self) -> str:
        """What a right result leaves open; empty if nothing."""
        return self.reenacted.caveat

    @property
    def doubtful(self) -> bool:
        """Whether the alarm is not sure, so that no promise holds for the state."""
        return self.guarantee is not None and self.guarantee.call == NOT_SURE

    @property
    def remark(self) -> str:
        """What to know of a result that is right."""
        if self.start < self.start_threshold:
            return self.statement
        right = f"this result is {'probably ' * self.doubtful}right"
        return f"{right}, but registrations from {AS_FAR} often fail: start closer or search more broadly"

    @property
    def named(self) -> tuple[str, ...]:
        """Causes more likely than not, likeliest first; at least one if the state is failed, otherwise none."""
        if self.state != FAILED:
            return ()
        if self.wrong_scale:  # other causes show once it is right
            return ("scale",)
        if self.start < self.start_threshold:  # the causes are those of bad starts, and only this pose is bad
            return ("pose",)
        first, *rest = sorted(self.causes, key=lambda cause: -self.causes[cause])
        return first, *(cause for cause in rest if self.causes[cause] >= LIKELY)

    def as_dict(self) -> dict[str, object]:
        """Values for JSON."""
        values = asdict(self, dict_factory=plain)
        return values | {
            "state": self.state,
            "named": list(self.named),
            "doubtful": self.doubtful,
            "caveat": self.caveat,
        }

    def lines(self, unit: str, verbose: bool) -> list[str]:
        """Lines of text, with lengths in this unit; `verbose` also tells causes and effects of a good result."""
        odd = (self.result >= LIKELY) != (self.result >= self.threshold)  # as few good ones are to be called failed
        called = f"; failed from {self.threshold:.2f} on" * (odd and self.threshold <= 1)
        causes = ", ".join(f"{cause} {share:.2f}" for cause, share in self.causes.items())
        why = [
            f"causes    {causes} (probabilities if it failed; several can act at once)",
            self.reenacted.effects_line(unit),
        ]
        return [
            f"state     {'probably ' * self.doubtful}{self.state}: {self.statement}",
            result_line(self.result, self.tolerance, self.tolerance_share, unit) + called,
            f"error     about {in_decimals(self.expected_error)} {unit} expected (mean distance of the points from "
            "their true places)",
            f"start     registrations from {AS_FAR} fail with probability {self.start:.2f}",
            *(self.guarantee.lines() if self.guarantee else [NO_GUARANTEE]),
            *(why if verbose or self.doubtful or self.state == FAILED else []),
            *self.reenacted.lines(unit),
        ]
