"""A registration that was put right, or why it was not, in words and numbers for a user."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from gpca.alignment.methods.interface import Outcome, Pair
from gpca.alignment.methods.registry import method_entry
from gpca.causes.policy import NOTHING
from gpca.causes.settings import OBSERVED
from gpca.guarantee.acceptance import WRONG
from gpca.model import page, repair
from gpca.model.clouds import FEWEST_MATCHES, Clouds, voids_of
from gpca.model.diagnosis import CHECK, TAKE, UNKNOWN, FittingPose, outside, result_line
from gpca.model.explanation import GIVEN, UNKNOWN_STATUS, ExplainedRegistration, PoseSpread, wrapped
from gpca.model.file import Model
from gpca.model.repair import GOOD, NOT_REPAIRED, REPAIRED, SEVERAL, Part, Proposals, Verdict
from gpca.model.result import level_at
from gpca.model.scene import Scene
from gpca.model.undetermined import Undetermined, undetermined_at
from gpca.numerals import in_decimals
from gpca.reenactment.dataset import described
from gpca.reenactment.enactment import Enactment
from gpca.reenactment.hypotheses import weights_of
from gpca.reenactment.registration import pose_posterior
from gpca.reenactment.scale import find_scale
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import transform
from gpca.seeds import generator, seed_of

STATUSES = {GOOD: 0, REPAIRED: 0, UNKNOWN: UNKNOWN_STATUS, NOT_REPAIRED: 4, SEVERAL: 5}  # exit codes of the command
ACTIONS = {GOOD: NOTHING, REPAIRED: TAKE}  # for the others, `CHECK`
TONES = {GOOD: "good", REPAIRED: "good", NOT_REPAIRED: "bad"}  # CSS classes; for the others, "doubt"
LOST = "the registration ended away from the target: poses were sought anywhere, and nothing is promised"
NOT_CALIBRATED = "none: the model was not calibrated on such repairs"
SURFACE = "surface"  # estimator of the spread: how the surface holds the points that were seen
ALONG = 0.95  # cosine of the angle to an axis within which that axis names a direction


def side_in_words(direction: Sequence[float]) -> str:
    """Describe where a part of the target lies, after `target`."""
    along = int(np.argmax(np.abs(direction)))
    if abs(direction[along]) >= ALONG:
        return f"on its {'+' if direction[along] > 0 else '-'}{'xyz'[along]} side"
    return f"toward ({', '.join(f'{part:.2f}' for part in direction)}) in its frame"


@dataclass(frozen=True)
class OtherPose(FittingPose):
    """A refined hypothesis of the true pose; its `error` is the expected one, as a judge has it."""

    off: float  # probability that it is off by more than the tolerance
    differs: Part | None = None  # the part of the target that tells it from the first of these poses; None of the first
    differs_by: float = 0.0  # mean distance over that part

    def line(self, number: int, unit: str) -> str:
        """One line of text."""
        probability = f"probability {self.probability:.2f}, wrong with {self.off:.2f} if judged alone"
        text = f"pose {number}    {probability}: {self.words(unit)}"
        if self.differs is None:
            return text
        part = f"{self.differs.share:.0%} of the target, {side_in_words(self.differs.direction)}"
        return f"{text}; differs from pose 1 by {in_decimals(self.differs_by)} {unit} on {part}"


@dataclass(frozen=True, kw_only=True)
class Repair(ExplainedRegistration):
    """What became of one registration; `T_target_source` is the registered pose, unless it was repaired."""

    verdict: str = UNKNOWN  # or ``good``, ``repaired``, ``not repaired``, ``several poses fit``
    action: str = CHECK
    reason: str = ""
    T_registered: np.ndarray  # (4, 4)
    tolerance: float  # in the unit of the points
    tolerance_share: float  # in diameters of the target
    registered_result: float | None = None  # probability that the registered pose is off by more than the tolerance,
    result: float | None = None  # and that `T_target_source` is; None if unknown
    failed_from: float | None = None  # probability from which a registered pose is called failed,
    good_below: float | None = None  # and below which another takes its place
    wrong: float | None = None  # at most this share of poses that are called repaired is wrong; None: no promise
    outliers: float | None = None  # share of the source at the likeliest pose; None of a good one, as the next
    missing: Part | None = None  # the part of the target that was not seen there; None if nearly all was
    free: Undetermined | None = None  # what the source leaves undetermined there, whose covariance is the `spread`
    poses: tuple[OtherPose, ...] = ()  # that the search found, refined; if several fit, these alone
    seconds: float = 0.0  # duration

    @classmethod
    def of(
        cls,
        model: Model,
        clouds: Clouds,
        outcome: Outcome,
        method: str | None,
        limit: float,
        unit: str,
        enactments: Sequence[Enactment] = (),
    ) -> Repair:
        """Put a registration right if it is off by more than the limit; enactments of its diagnosis save the search."""
        frame, T_init, T = clouds.frame, clouds.T_target_source_init, outcome.T_target_source
        diagnoser, tolerance, T_registered = model.diagnoser, limit / frame.diameter, frame.pose_outside(T) @ T_init
        voids = voids_of(clouds.source, clouds.target, 1.0, model.familiar)
        lost = round(outcome.fitness * len(clouds.source)) < FEWEST_MATCHES
        level = level_at(diagnoser.levels, tolerance)
        unusual, _ = model.familiar.warnings(clouds.source, clouds.target)
        repaired = cls(
            T_target_source=T_registered,
            T_registered=T_registered,
            fitness=outcome.fitness,
            inlier_rmse=outcome.inlier_rmse * frame.diameter,
            method=method or model.icp.method,
            reason="check " + ", ".join(voids.values()),
            unit=unit,
            tolerance=limit,
            tolerance_share=tolerance,
            wrong=None if voids or lost or level.repaired_below is None else WRONG,
            warnings=(*voids, *((LOST,) if lost else ()), *unusual),
            learned_from=model.learning,
            scene=Scene(clouds.source, clouds.target, T, frame, model.icp.correspondence_distance, tolerance),
        )
        if voids:
            return repaired
        pair = diagnoser.pair(clouds.source, clouds.target, T, method != GIVEN)
        surface, before = ModelSurface(pair.model), transform(pair.T_init, pair.observed)
        refine: repair.Refine = repair.unrefined
        drawn = len(pair.observed) / len(clouds.source), len(pair.model) / len(clouds.target)
        if min(drawn) < 1:
            refine = repair.by_mixture(clouds.target, surface.spacing * drawn[1] ** 0.5)
        if method not in (None, GIVEN) and not method_entry(method).is_global:
            refine = repair.by_method(clouds.target, surface, method, seed_of("repair", method))
        measure = repair.measured(before, pair.model, diagnoser.runs.icp, OBSERVED)
        if lost:
            hypotheses = pose_posterior(Pair(before, pair.model), diagnoser.reenactment, prior=False)
        elif enactments:
            searched = [enactment.hypothesis for enactment in enactments]
            hypotheses = np.array([hypothesis.T for hypothesis in searched]), weights_of(searched)
        else:
            hypotheses = repair.search(pair, diagnoser.reenactment, surface)
        proposals = repair.propose(clouds.source, surface, T, *hypotheses, refine, measure, up_to_symmetry=True)
        proposals.evidence.fitness_N[0], proposals.evidence.inlier_rmse_N[0] = pair.fitness_n[0], pair.inlier_rmse_n[0]
        described_F = None if method == GIVEN else described(pair, diagnoser.runs.icp)
        verdict = repair.decide(diagnoser.judge, level, proposals, tolerance, lost, described_F)
        errors_n = diagnoser.judge.error(proposals.evidence)
        poses = [outside(pose, frame, T_init) for pose in other_poses(proposals, verdict, errors_n, surface)]
        T_best = proposals.T_n[verdict.row or 1]
        scale = find_scale(before, [proposals.T_n[verdict.row], T_best], surface, generator("repair", "scale"))
        if scale is not None and scale.off and scale.error > tolerance:
            return replace(repaired, reason=scale.advice, wrong=None)
        if verdict.name != GOOD:
            outliers, missing = repair.unseen(clouds.source, surface, T_best)
            free = undetermined_at(transform(T_best, before), surface)
            spread = PoseSpread(free.covariance, frame.diameter, SURFACE, None)
            repaired = replace(repaired, outliers=outliers, missing=missing, free=free.outside(frame), spread=spread)
        if verdict.row:
            _, (fitness,), (rmse,) = clouds.icp.register(clouds.source, T_best[None], max_iterations=0)
            repaired = replace(repaired, fitness=float(fitness), inlier_rmse=float(rmse) * frame.diameter)
        return repaired.decided(verdict, poses, list(proposals.T_n), level.threshold, level.good_below)

    def decided(
        self, verdict: Verdict, poses: Sequence[OtherPose], T_n: Sequence, failed_from: float, good_below: float
    ) -> Self:
        """Add a verdict and its poses; `T_n` are the registered one and these in the target's frame."""
        T_target_source = poses[verdict.row - 1].T_target_source if verdict.row else self.T_registered
        poses = [poses[row - 1] for row in verdict.rows] or poses
        scene = self.scene and replace(
            self.scene,
            T_repaired=T_n[verdict.row] if verdict.row else None,
            T_others=tuple(T_n[row] for row in verdict.rows),
        )
        return replace(
            self,
            T_target_source=T_target_source,
            verdict=verdict.name,
            action=ACTIONS.get(verdict.name, CHECK),
            reason=reason_of(verdict, poses, self.unit),
            registered_result=float(verdict.probability_n[0]),
            result=float(verdict.probability_n[verdict.row]),
            failed_from=failed_from,
            good_below=good_below,
            poses=tuple(poses),
            scene=scene,
        )

    @property
    def status(self) -> int:
        """The exit code of the command: 0 if `T_target_source` is a pose to use."""
        return STATUSES[self.verdict]

    def lines(self, verbose: bool = False) -> list[str]:
        """Lines of text; `verbose` also lists the poses where one is settled."""
        lines = [f"repair    {self.verdict}: {self.reason}"]
        if self.result is None:
            return lines
        before = f"; before, {self.registered_result:.2f}" if self.verdict == REPAIRED else ""
        lines.append(result_line(self.result, self.tolerance, self.tolerance_share, self.unit) + before)
        if self.verdict == REPAIRED:
            wrong = self.wrong and f"at most {self.wrong:.0%} of repaired poses are wrong"
            kept = f"{wrong}, on objects like those of calibration" if wrong else NOT_CALIBRATED
            lines.append(f"guarantee {kept}")
        if self.outliers is not None:
            lines.append(f"observed  {self.outliers:.0%} outliers")
            if self.missing is not None:
                lines[-1] += f"; {self.missing.share:.0%} of the target unseen, {side_in_words(self.missing.direction)}"
        if self.spread is not None:
            lines.append(self.spread.line(self.unit, "given these points"))
            lines += self.free.lines(self.unit) if self.free else []
        if self.status or verbose:
            lines += [pose.line(number, self.unit) for number, pose in enumerate(self.poses, 1)]
        return lines

    def text(self, verbose: bool = False) -> str:
        """Return a report for a reader, of few lines."""
        lines = [*(f"warning   {line}" for line in self.warnings), *self.lines(verbose), ""]
        head = f"T_target_source, in {self.unit}" + (", as registered" if self.status else "")
        return "\n".join([*wrapped(lines), head, *self.pose_rows(self.T_target_source), ""])

    def html(self, names: Mapping[str, str] | None = None) -> str:
        """Return a page that needs no other file, with the registered pose and the repaired one side by side."""
        head = f'<h1 class="{TONES.get(self.verdict, "doubt")}">{page.sentence(self.verdict)}</h1>'
        inputs = {"training": self.learned_from} | dict(names or {})
        head += page.warnings(self.warnings)
        details = page.details(self.as_dict(), inputs, self.pose_rows(self.T_target_source))
        body = [page.listed("Repair", self.lines()), details]
        return page.assembled("Registration repaired", head, body, self.scene, self.unit)


def other_poses(proposals: Proposals, verdict: Verdict, error_n: np.ndarray, surface: ModelSurface) -> list[OtherPose]:
    poses, first = [], verdict.rows[0] if verdict.rows else 1
    for row in range(1, len(proposals.T_n)):
        T, off = proposals.T_n[row], float(verdict.probability_n[row])
        differs, by = (None, 0.0) if row == first else repair.difference(surface, proposals.T_n[first], T)
        numbers = float(proposals.weight_n[row]), float(error_n[row])
        poses.append(OtherPose.of(T, *numbers, proposals.T_n[0], surface, off=off, differs=differs, differs_by=by))
    return poses


def reason_of(verdict: Verdict, poses: Sequence[OtherPose], unit: str) -> str:
    if verdict.name == GOOD:
        return "the registered pose is not called failed, so it stays"
    if verdict.name == SEVERAL:
        return f"one of {len(poses)} poses is right, and the points do not tell which"
    if verdict.name == NOT_REPAIRED:
        return "the registered pose is called failed, and no other is called good"
    return poses[verdict.row - 1].words(unit)
