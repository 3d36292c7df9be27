"""Explanations of one registration, of objects by a trained model or of scans without one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from html import escape
from pathlib import Path
from textwrap import wrap
from typing import Any, ClassVar

import numpy as np

from gpca.alignment.pose_error import displacements
from gpca.causes.truth import FAILED, NOMINAL
from gpca.io.files import whole_file, write_text
from gpca.model import page
from gpca.model.diagnosis import ADVICE, AGAIN, CHECK, RERUN, TAKE, UNKNOWN, Diagnosis, FittingPose, Reenacted, plain
from gpca.model.scene import Scene
from gpca.numerals import in_decimals
from gpca.rigid import as_rows, log

NOT_SURE = "not sure"
UNKNOWN_STATUS = 3  # exit code of the command if an explanation means nothing; 1 is a failed check, 2 a bad input
WIDTH = 100  # of text, characters
GIVEN = "given"  # method of a pose that was not registered but judged
LEARNED = (
    "the probability of a failure was fitted to scans of development scenes (docs/real_world.md); the model, which "
    "learned from objects, is not used"
)
HEADS = {  # CSS class and title of a state
    NOMINAL: ("good", "Nothing speaks against this registration"),
    FAILED: ("bad", "This registration has probably failed"),
    NOT_SURE: ("doubt", "This registration may have failed"),
}
PAPER = "GP-CA as in the paper (sees the aligned source alone; names a concept even where nothing is wrong)"
SCANS_WITHOUT = {"noise": "smoothed points", "pose": "right start", "overlap": "common parts alone"}


def wrapped(lines: Iterable[str]) -> list[str]:
    """Break long lines of text between words; what follows stands under the text, not under its label."""
    whole: dict[str, Any] = {"break_long_words": False, "break_on_hyphens": False, "subsequent_indent": 10 * " "}
    return [part for line in lines for part in wrap(line, WIDTH, **whole) or [""]]


@dataclass(frozen=True)
class Motion:
    """How far a registration moved the source from its initial pose."""

    rotation_deg: float
    distance: float  # root mean square over the points, in the unit of the points

    @classmethod
    def of(cls, T_found: np.ndarray, source: np.ndarray, unit: float) -> Motion:
        """Measure a pose relative to the initial one, for a cloud (N, 3) whose unit has this length."""
        distance = unit * float(displacements(T_found[None], source)[0])
        return cls(math.degrees(float(np.linalg.norm(log(T_found[None])[0, :3]))), distance)


@dataclass(frozen=True)
class PoseSpread:
    """Uncertainty of the pose."""

    covariance_6_6: np.ndarray  # Σ of twists on the left of the pose, in radians and diameters
    diameter: float  # the target's, in the unit of the points
    estimator: str  # name of the estimator
    starts: int | None  # number of starts of Monte-Carlo; None for other estimators

    @property
    def rotation_deg(self) -> float:
        """Root mean square angle."""
        return math.degrees(math.sqrt(np.trace(self.covariance_6_6[:3, :3])))

    @property
    def translation(self) -> float:
        """Root mean square length, in the unit of the points."""
        return self.diameter * math.sqrt(np.trace(self.covariance_6_6[3:, 3:]))

    def line(self, unit: str, by: str = "") -> str:
        """One line of text, with what it was estimated by."""
        by = by or (f"over {self.starts} starts" if self.starts else f"by {self.estimator}")
        rotation, shift = in_decimals(self.rotation_deg), in_decimals(self.translation)
        return f"spread    pose uncertainty (RMS) {rotation}° and {shift} {unit}, {by}"

    def as_dict(self) -> dict[str, object]:
        """Values for JSON."""
        numbers = {name: getattr(self, name) for name in ("rotation_deg", "translation", "estimator", "starts")}
        return numbers | {"covariance": self.covariance_6_6.tolist()}


@dataclass(frozen=True, kw_only=True)
class ExplainedRegistration:
    """What is reported of any registration: its result, what to do next, and how it is shown."""

    html: ClassVar[Callable[..., str]]
    lines: ClassVar[Callable[..., list[str]]]  # what was found, as text; all of it if verbose
    text: ClassVar[Callable[..., str]]  # the same, as a report for a reader

    T_target_source: np.ndarray  # (4, 4) the resulting pose, in the unit of the points
    fitness: float
    inlier_rmse: float
    method: str  # name of the registration method, or kind of the model's ICP; `GIVEN` if none was used
    action: str  # what to do next: a branch of the policy (:mod:`gpca.causes.policy`), or `CHECK`
    reason: str  # reason for this action
    unit: str  # unit of all lengths
    spread: PoseSpread | None = None  # uncertainty of the pose by an estimator, if requested and available
    moved: Motion | None = None  # from the initial pose, if one was given and registered from
    notes: tuple[str, ...] = ()  # changes made to the clouds, such as points that were left out
    warnings: tuple[str, ...] = ()  # reasons to doubt the explanation
    gpca_warnings: tuple[str, ...] = ()  # reasons to doubt GP-CA as in the paper, which is shown beside it
    learned_from: str = ""  # training data
    scene: Scene | None = field(default=None, repr=False, compare=False)  # data of the 3-D view

    @property
    def status(self) -> int:
        """The exit code of the command."""
        return 0

    @property
    def advice(self) -> str:
        """What to do next, in words."""
        return ADVICE.get(self.action, self.action)

    def action_lines(self) -> list[str]:
        """Lines of text on what to do next, and why."""
        return [f"action    {self.advice}", f"reason    {self.reason}"]

    def as_dict(self) -> dict[str, object]:
        """Values for JSON."""
        values = asdict(replace(self, scene=None), dict_factory=plain)
        del values["scene"]
        return values | {"spread": self.spread and self.spread.as_dict()}

    @property
    def fitting_pose(self) -> np.ndarray:
        """T_target_source (4, 4) of the pose that fits best: the result, unless another pose is more probable."""
        poses = self._poses()
        return self.T_target_source if not poses or poses[0].registered else poses[0].T_target_source

    def _poses(self) -> Sequence[FittingPose]:  # of a re-enactment, most probable first
        return ()

    def save_pose(self, path: str | Path) -> None:
        """Write :attr:`fitting_pose` to its last digit: as npy if the name ends so, otherwise as text, row by row."""
        with whole_file(path) as partial:
            if partial.suffix.lower() == ".npy":
                np.save(partial, self.fitting_pose)
            else:
                np.savetxt(partial, self.fitting_pose, fmt="%.17g")

    def save_html(self, path: str | Path, names: Mapping[str, str] | None = None) -> None:
        """Write :meth:`html` to a file."""
        write_text(path, self.html(names))

    def _repr_html_(self) -> str:
        return page.framed(self.html())

    def pose_rows(self, T_target_source: np.ndarray) -> list[str]:
        """Return a pose (4, 4) as text, row by row, so that it moves the points as the pose itself does."""
        if self.scene is None:
            return as_rows(T_target_source, np.inf)
        frame, shift_3 = self.scene.frame, T_target_source[:3, 3]
        farthest = sum(map(np.linalg.norm, (frame.center_3, shift_3))) + frame.diameter
        return as_rows(T_target_source, float(farthest / frame.diameter))

    def _report(self, body: Sequence[str], fit: str, *end: str) -> str:
        lines = [*(f"warning   {line}" for line in self.warnings), *body, "", f"method    {self.method}: {fit}"]
        if self.spread is not None:
            lines.append(self.spread.line(self.unit))
        if self.moved:
            distance = page.length(self.moved.distance, self.unit)
            lines.append(f"moved     {self.moved.rotation_deg:.3g}° and {distance} from the initial pose")
        pose = ["", f"T_target_source, in {self.unit}", *self.pose_rows(self.T_target_source)]
        if self.fitting_pose is not self.T_target_source:
            name = "the repaired pose" if self.action == TAKE else "pose 1"
            pose += ["", f"{name} as T_target_source, which --save-pose writes", *self.pose_rows(self.fitting_pose)]
        return "\n".join([*wrapped(lines), *pose, *wrapped(end), ""])


@dataclass(frozen=True, kw_only=True)
class Explanation(ExplainedRegistration):
    """One registration of an object, explained by a trained model."""

    diagnosis: Diagnosis  # state and causes, learned from measured causes
    repaired: ExplainedRegistration | None = None  # a :class:`gpca.model.repaired.Repair`, if requested
    scores: dict[str, float]
    variances: dict[str, float]
    bald: float
    entropy: float
    concept: str  # concept with the largest score (Eq. 6).
    seconds: dict[str, float]  # duration of each stage, and ``total``

    @property
    def advice(self) -> str:
        """What to do next, in words; a repair that failed is not advised again."""
        return AGAIN if self.action == RERUN and self.repaired else super().advice

    def _poses(self) -> Sequence[FittingPose]:
        return () if self.unknown else self.diagnosis.reenacted.poses

    @property
    def fitting_pose(self) -> np.ndarray:
        """T_target_source (4, 4) of the repaired pose; without one, as for any registration."""
        repaired = self.repaired is not None and self.repaired.action == TAKE
        return self.repaired.T_target_source if self.repaired and repaired else super().fitting_pose

    @property
    def unknown(self) -> bool:
        """Whether neither diagnosis nor scores mean anything for this pair."""
        return self.action == CHECK

    @property
    def status(self) -> int:
        """The exit code of the command."""
        return UNKNOWN_STATUS if self.unknown else 0

    def as_dict(self) -> dict[str, object]:
        """Values for JSON."""
        parts = {"diagnosis": self.diagnosis.as_dict(), "repaired": self.repaired and self.repaired.as_dict()}
        return super().as_dict() | parts

    def html(self, names: Mapping[str, str] | None = None) -> str:
        """Return a page that needs no other file: both clouds in 3-D, causes, poses, counterfactuals."""
        scene, explained, inputs = self.scene, self.as_dict(), {"training": self.learned_from} | dict(names or {})
        body = [page.action(explained, self.advice)]
        body += [page.listed("Repair", self.repaired.lines())] if self.repaired else []
        if scene and self.unknown:
            scene = replace(scene, enactments=())  # hypotheses mean nothing where scores mean nothing
        elif not self.unknown:
            body += [page.promise(self.diagnosis.guarantee), page.causes(self.diagnosis, self.unit)]
            if scene:
                body.append(page.poses(self.diagnosis.reenacted, self.unit, observation=True))
        body += [
            page.counterfactuals(scene, self.unit) if scene else "",
            "" if self.unknown else page.as_in_the_paper(explained),
            page.details(explained, inputs, self.pose_rows(self.T_target_source)),
        ]
        head = page.headline(explained) + page.warnings(self.warnings)
        return page.assembled("Registration explained", head, body, scene, self.unit)

    def lines(self, verbose: bool = False) -> list[str]:
        """Return what was found, as text."""
        state = [f"state     {UNKNOWN}"] if self.unknown else self.diagnosis.lines(self.unit, verbose)
        repaired = ["", *self.repaired.lines(verbose)] if self.repaired else []
        if verbose and not self.unknown:
            repaired += [
                "",
                PAPER,
                *(f"warning   {line}" for line in self.gpca_warnings),
                f"{'':10}{'score':>8}{'variance':>10}",
                *(f"{name:10}{self.scores[name]:8.3f}{self.variances[name]:10.4f}" for name in self.scores),
                f"entropy {self.entropy:.3f} nats, BALD {self.bald:.3f} nats",
            ]
        return [*state, *self.action_lines(), *repaired]

    def text(self, verbose: bool = False) -> str:
        """Return a report for a reader; `verbose` adds causes of a good result, scores of GP-CA and durations."""
        fit = f"fitness {self.fitness:.3f}, inlier RMSE {page.length(self.inlier_rmse, self.unit)}"
        stages = ", ".join(f"{stage} {1e3 * seconds:.0f}" for stage, seconds in self.seconds.items())
        return self._report(self.lines(verbose), fit, *(["", f"ms        {stages}"] if verbose else []))


@dataclass(frozen=True)
class Evidence:
    """What speaks for a failure of a result between scans."""

    elsewhere: float  # probability of an error above the limit, over the poses that may be true
    apart: float  # root mean square distance between partners at the result, voxels
    overlap: float  # share of the source with a partner


@dataclass(frozen=True, kw_only=True)
class ScanExplanation(ExplainedRegistration):
    """One registration of two partial scans of a scene, explained without a model."""

    voxel: float  # edge length of the voxels
    state: str  # ``nominal``, ``failed`` or ``not sure``
    failure: float  # probability of a failure (:func:`gpca.model.scan_explainer.failure_of`)
    evidence: Evidence  # what it was computed from
    limit: float  # error above which a registration counts as failed: root mean square over the common surface
    overlap: tuple[float, float]
    causes: tuple[str, ...]  # those that add a third of the limit to the error, the largest first; none if nominal
    reenacted: Reenacted  # hypotheses of the true pose, and the effect of each cause
    seconds: float  # duration
    learned_from: str = LEARNED  # training data: none

    def _poses(self) -> Sequence[FittingPose]:
        return self.reenacted.poses

    def lines(self, verbose: bool = False) -> list[str]:
        """Return what was found, as text."""
        limit = page.length(self.limit, self.unit)
        why = [f"causes    {self._named()}", self.reenacted.effects_line(self.unit)]
        return [
            f"state     {self.state}" + (f", but {caveat}" if (caveat := self.reenacted.caveat) else ""),
            f"result    probability {self.failure:.2f} of an error above {limit} (RMS over the common surface)",
            f"overlap   {self._overlap()}",
            *(why if verbose or self.state != NOMINAL else []),
            *self.reenacted.fit_lines(self.unit),
            *self.reenacted.pose_lines(self.unit),
            *self.action_lines(),
        ]

    def text(self, verbose: bool = False) -> str:
        """Return a report for a reader; `verbose` adds causes and effects of a good result."""
        rmse, voxel = (page.length(value, self.unit) for value in (self.inlier_rmse, self.voxel))
        return self._report(self.lines(verbose), f"fitness {self.fitness:.3f}, inlier RMSE {rmse}, voxels of {voxel}")

    def html(self, names: Mapping[str, str] | None = None) -> str:
        """Return a page that needs no other file, as :meth:`Explanation.html` does."""
        tone, title = HEADS[self.state]
        limit = page.length(self.limit, self.unit)
        doubt = f"Probability of an error above {limit}: {self.failure:.2f}. Here {self.learned_from}."
        scene, explained = self.scene, self.as_dict()
        inputs = {"training": self.learned_from, "voxels": page.length(self.voxel, self.unit)} | dict(names or {})
        body = [
            page.action(explained, self.advice),
            page.section("Overlap", f"<p>{escape(self._overlap())}.</p>"),
            page.section("Causes", f"<p>{escape(self._named())}.</p>") if self.causes else "",
            page.poses(self.reenacted, self.unit),
            page.counterfactuals(scene, self.unit, SCANS_WITHOUT, "errors from this one start") if scene else "",
            page.details(explained, inputs, self.pose_rows(self.T_target_source)),
        ]
        if caveat := self.reenacted.caveat:
            doubt = f"{caveat[0].upper()}{caveat[1:]}. {doubt}"
        head = f'<h1 class="{tone}">{title}</h1><p>{escape(doubt)}</p>{page.warnings(self.warnings)}'
        return page.assembled("Scans explained", head, body, scene, self.unit)

    def _named(self) -> str:
        return " and ".join(self.causes) or "none is named"

    def _overlap(self) -> str:
        source, target = self.overlap
        return f"{source:.0%} of the source lies on the target, {target:.0%} of the target on the source"
