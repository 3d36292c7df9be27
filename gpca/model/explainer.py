"""Explains a user's registration with a trained model, by the compiled ICP (docs/protocol.md#two-loops-of-icp)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from gpca.alignment.icp import clipped_cost
from gpca.alignment.methods.interface import Outcome, Pair
from gpca.alignment.methods.registry import make_method, method_entry
from gpca.causes.policy import NOTHING, QUEUE, Decision
from gpca.causes.truth import NOMINAL
from gpca.classifier.scores import entropy
from gpca.errors import InputError
from gpca.model.clouds import Clouds, voids_of
from gpca.model.diagnoser import QUICK_HYPOTHESES, QUICK_POINTS
from gpca.model.diagnosis import AS_FAR, CHECK, REFINE, RERUN, RESCALE, TAKE, Diagnosis, outside
from gpca.model.explanation import GIVEN, Explanation, Motion, PoseSpread
from gpca.model.file import Model
from gpca.model.location import model_path
from gpca.model.repair import REPAIRED
from gpca.model.repaired import Repair
from gpca.model.result import DEFAULT, Tolerance
from gpca.model.scene import Scene
from gpca.objects.canonical import CanonicalFrame, thin
from gpca.objects.surface import as_points
from gpca.rigid import inverse, transform
from gpca.seeds import generator, seed_of
from gpca.uncertainty.estimators.interface import RegisteredPair
from gpca.uncertainty.estimators.registry import make_estimator
from gpca.uncertainty.settings import MONTE_CARLO, UncertaintySettings
from gpca.uncertainty.spread import run_from_starts

FAST = f"fast: at most {QUICK_POINTS} points and {QUICK_HYPOTHESES} poses were re-enacted, and nothing is promised"
GOOD_FITNESS = 0.9  # fitness from which an initial pose is not doubted
INVERSE_COST = 0.5  # an inverse initial pose that ends with a smaller share of the cost was probably meant


class Explainer:
    """Explains registrations with a model, by default the one found; without a `device` of torch, without torch."""

    def __init__(self, model: Model | None = None, device: str | None = None) -> None:
        self.model = Model.load(model_path()) if model is None else model
        self._device = device

    @classmethod
    def load(cls, path: str | Path | None = None) -> Explainer:
        """Load a model file, by default the one found by :func:`gpca.model.location.model_path`."""
        return cls(Model.load(model_path(path)))

    def explain(
        self,
        source_points: np.ndarray,
        target_points: np.ndarray,
        T_target_source_init: np.ndarray | None = None,
        unit: str = "m",
        frame: CanonicalFrame | None = None,
        uncertainty: UncertaintySettings | None = None,
        method: str | None = None,
        estimator: str = MONTE_CARLO,
        fast: bool = False,
        register: bool = True,
        tolerance: Tolerance | str = DEFAULT,
        source_unit: str | None = None,
        repair: bool = False,
    ) -> Explanation:
        """Register a cloud (N, 3) to another, explain the result and, with `repair`, put it right (:meth:`repair`).

        Clouds may be Open3D's. They, poses and results are in the `unit`; `frame` is the target's canonical one, if
        known. Methods and estimators are those of docs/registration.md; without `uncertainty`, the spread of starts,
        the uncertainty of the pose is not estimated. A `tolerance` is a length, an angle or a share of the diameter,
        such as ``5mm``. `fast` re-enacts fewer points and poses, without a guarantee. The same clouds give the same
        numbers.
        """
        began, seconds, notes = perf_counter(), dict[str, float](), list[str]()
        inputs = (source_points, target_points, T_target_source_init, unit, frame)
        clouds, limit, outcome = self._registered(inputs, source_unit, tolerance, method, register, notes, seconds)
        T_found, started = outcome.T_target_source, register and T_target_source_init is not None
        voids = voids_of(clouds.source, clouds.target, outcome.fitness, self.model.familiar)
        diagnoser = (self.model.diagnoser.quick() if fast else self.model.diagnoser).by_method(method)
        with _timed(seconds, "diagnosis"):
            aligned = clouds.source, clouds.target, T_found
            diagnosis, enactments = diagnoser.diagnose(*aligned, register, limit / clouds.frame.diameter)
        diagnosis = replace(outside(diagnosis, clouds.frame, clouds.T_target_source_init), void=bool(voids))
        if diagnosis.void or diagnosis.wrong_scale:  # of which calibration knew nothing
            diagnosis = replace(diagnosis, guarantee=None)
        notes += [FAST] if fast else []
        with _timed(seconds, "embedding"):
            h_1_d = self.embed(transform(T_found, clouds.source))
        with _timed(seconds, "attribution"):
            (scores_C,), (variances_C,), (bald,) = self.model.gpc.attribute(h_1_d)
        numbers = [*scores_C, diagnosis.result, diagnosis.start, *diagnosis.causes.values()]
        if not np.isfinite(h_1_d).all() or not np.isfinite(numbers).all():
            raise InputError("model", "gives non-finite numbers for these clouds", "use another one")
        with _timed(seconds, "familiarity"):
            unusual, unusual_to_gpca = self.model.familiar.warnings(clouds.source, clouds.target)
            warnings = [*voids, *unusual]
            if voids and (scale := diagnosis.reenacted.scale) and scale.off:
                warnings.append(scale.words)
            if diagnosis.unlikeness > 1:
                far = f"{diagnosis.unlikeness:.1f} times as far from the registrations that the diagnosis was trained"
                warnings.append(f"the pair is {far} on as 99 % of these are from one another")
            if started and method is None and self._fits_inverted(clouds, outcome):
                warnings.append("the inverse of the initial pose fits far better: is it T_source_target?")
        moved = Motion.of(T_found, clouds.source, clouds.frame.diameter) if started else None
        spread = None
        if uncertainty is not None:
            with _timed(seconds, "uncertainty"):
                spread = self._spread(clouds, outcome, method, estimator, uncertainty, notes)
        repaired = None
        if repair:
            with _timed(seconds, "repair"):
                by, searched = method if register else GIVEN, () if fast else enactments
                repaired = Repair.of(self.model, clouds, outcome, by, limit, unit, searched)
        if repaired is not None and repaired.verdict == REPAIRED and not diagnosis.wrong_scale:
            before = f"the result with {repaired.registered_result:.2f}"
            decision = Decision(TAKE, "", f"it is wrong with probability {repaired.result:.2f}, {before}")
        elif voids:
            checks = ", ".join(voids.values())
            decision = Decision(CHECK, "", f"the numbers mean nothing until these are checked: {checks}")
        elif diagnosis.state == NOMINAL:
            decision = Decision(NOTHING, "", diagnosis.remark)
        else:
            decision = self._decided(diagnosis, register)
        return Explanation(
            T_target_source=clouds.frame.pose_outside(T_found) @ clouds.T_target_source_init,
            fitness=outcome.fitness,
            inlier_rmse=outcome.inlier_rmse * clouds.frame.diameter,
            diagnosis=diagnosis,
            method=(method or self.model.icp.method) if register else GIVEN,
            moved=moved,
            scores=dict(zip(self.model.gpc.classes, scores_C.tolist(), strict=True)),
            variances=dict(zip(self.model.gpc.classes, variances_C.tolist(), strict=True)),
            bald=float(bald),
            entropy=float(entropy(scores_C)),
            concept=self.model.gpc.classes[scores_C.argmax()],
            action=decision.action,
            reason=decision.reason,
            spread=spread,
            repaired=repaired and replace(repaired, scene=None),
            unit=unit,
            seconds=seconds | {"total": perf_counter() - began},
            notes=tuple(notes),
            warnings=tuple(warnings),
            gpca_warnings=tuple(unusual_to_gpca),
            learned_from=self.model.learning,
            scene=Scene(
                *(clouds.source, clouds.target, T_found, clouds.frame),
                *(self.model.icp.correspondence_distance, limit / clouds.frame.diameter),
                *(enactments, self.model.diagnoser.truth),
                T_repaired=repaired.scene.T_repaired if repaired and repaired.scene else None,
            ),
        )

    def repair(
        self,
        source_points: np.ndarray,
        target_points: np.ndarray,
        T_target_source_init: np.ndarray | None = None,
        unit: str = "m",
        frame: CanonicalFrame | None = None,
        method: str | None = None,
        register: bool = True,
        tolerance: Tolerance | str = DEFAULT,
        source_unit: str | None = None,
    ) -> Repair:
        """Register and, if the result is wrong, put it right (docs/repair.md); arguments as of :meth:`explain`."""
        started = perf_counter()
        notes: list[str] = []
        inputs = (source_points, target_points, T_target_source_init, unit, frame)
        clouds, limit, outcome = self._registered(inputs, source_unit, tolerance, method, register, notes, {})
        repaired = Repair.of(self.model, clouds, outcome, method if register else GIVEN, limit, unit)
        return replace(repaired, notes=tuple(notes), seconds=perf_counter() - started)

    def judge(
        self, source_points: np.ndarray, target_points: np.ndarray, T_target_source: np.ndarray, **options: Any
    ) -> Explanation:
        """Explain a given pose (4, 4) without registering: is it right? `options` are those of :meth:`explain`."""
        return self.explain(source_points, target_points, T_target_source, **options, register=False)

    def calibrated(
        self, explanations: Sequence[Explanation], labels: Sequence[str], groups: Sequence[str] | None = None
    ) -> Explainer:
        """Return an explainer whose limits are set on explanations of labeled registrations (docs/guarantee.md)."""
        from gpca.model.calibration import LabeledRegistrations

        labeled = LabeledRegistrations.of([explanation.diagnosis for explanation in explanations], labels, groups)
        model = replace(self.model, diagnoser=labeled.set_in(self.model.diagnoser))
        return Explainer(model, self._device)

    def explain_many(
        self,
        pairs: Iterable[tuple[np.ndarray, np.ndarray] | tuple[np.ndarray, np.ndarray, np.ndarray | None]],
        **options: Any,
    ) -> Iterator[Explanation]:
        """Yield the explanation of each pair of source, target and perhaps initial pose, without the data of a page."""
        last_target, frame = None, None
        for number, (source_points, target_points, *init) in enumerate(pairs):
            try:
                if frame is None or target_points is not last_target:
                    last_target = target_points
                    frame = CanonicalFrame.of(as_points(target_points, "target"), None)
                T_init = init[0] if init else None
                yield replace(self.explain(source_points, target_points, T_init, frame=frame, **options), scene=None)
            except InputError as fault:
                raise InputError(f"pair {number}", str(fault)) from fault

    def embed(self, aligned: np.ndarray) -> np.ndarray:
        """Return the mean embedding (1, d) of random draws of an aligned source cloud (N, 3) in the canonical frame."""
        count, n = len(aligned), self.model.encoder.settings.draw_points
        draws = [generator("explanation", "draw", draw) for draw in range(self.model.encoder.settings.draws)]
        few = draws[:1] if count == n else draws
        rows_D_N = np.array([random.choice(count, n, replace=count < n, shuffle=False) for random in few])
        h_D_d = self.model.encoder(aligned.astype(np.float32)[rows_D_N], self._device)
        return h_D_d.mean(axis=0, keepdims=True)

    def _decided(self, diagnosis: Diagnosis, registered: bool) -> Decision:
        """Decide about a wrong result: a better pose comes before the policy, unless a bad start is to be queued."""
        if (scale := diagnosis.reenacted.scale) and diagnosis.wrong_scale:
            return Decision(RESCALE, "", scale.advice)
        causes, bad_start = diagnosis.causes, diagnosis.start >= diagnosis.start_threshold
        decision = self.model.policy.decide(np.array([*causes.values()]), diagnosis.bald, concepts=(*causes,))
        if bad_start and decision.action == QUEUE:
            return decision
        if better := diagnosis.reenacted.better:
            return Decision(RERUN, "", f"pose 1 fits with probability {better.probability:.2f}")
        if not registered and not bad_start:
            return Decision(REFINE, "", f"registrations from {AS_FAR} fail with probability {diagnosis.start:.2f}")
        return decision

    def _registered(
        self,
        inputs: tuple[Any, Any, np.ndarray | None, str, CanonicalFrame | None],
        source_unit: str | None,
        tolerance: Tolerance | str,
        method: str | None,
        register: bool,
        notes: list[str],
        seconds: dict[str, float],
    ) -> tuple[Clouds, float, Outcome]:
        """Return the prepared clouds, how far the pose may be off, in the unit of the points, and the registration."""
        with _timed(seconds, "preparation"):
            clouds = Clouds.prepared(*inputs, self.model.cloud_points, self.model.icp, notes, source_unit)
            allowed = tolerance if isinstance(tolerance, Tolerance) else Tolerance.parse(tolerance)
            limit = allowed.length(clouds.target, clouds.frame.diameter, inputs[3])
        with _timed(seconds, "icp"):
            return clouds, limit, self._aligned(clouds, method, register, notes)

    def _aligned(self, clouds: Clouds, method: str | None, register: bool, notes: list[str]) -> Outcome:
        if method is None or not register:  # without a registration, the initial pose is measured
            [T], [fitness], [rmse] = clouds.icp.register(clouds.source, np.eye(4)[None], None if register else 0)
            return Outcome(T, float(fitness), float(rmse))
        pair = Pair(clouds.source, clouds.target, seed=seed_of("explanation", method))
        outcome = make_method(method)(pair if method_entry(method).points_only else pair.with_normals())
        notes += [] if outcome.converged else [f"{method} failed: {outcome.failure}"]
        return Outcome(outcome.T_target_source, float(outcome.fitness), float(outcome.inlier_rmse))

    def _spread(
        self,
        clouds: Clouds,
        outcome: Outcome,
        method: str | None,
        estimator: str,
        settings: UncertaintySettings,
        notes: list[str],
    ) -> PoseSpread | None:
        source, diameter = thin(clouds.source, settings.icp_points, "spread"), clouds.frame.diameter
        starts = settings.starts if estimator == MONTE_CARLO else None
        if method is None and starts:
            xi_n_6 = generator("explanation", "starts").normal(size=(settings.starts, 6)) * settings.deviation_6()
            runs = run_from_starts(clouds.icp, source, np.eye(4), xi_n_6)
            return PoseSpread(runs.covariance(outcome.T_target_source), diameter, estimator, starts)
        target = thin(clouds.target, settings.icp_points, "spread", "target")
        pair = Pair(source, target, seed=seed_of("explanation", "estimate")).with_normals()
        equal = "gicp" if self.model.icp.method == "generalized" else self.model.icp.method  # the method that equals it
        estimate = make_estimator(estimator, {"starts": starts} if starts else {})
        estimated = estimate(RegisteredPair(pair, outcome, method or equal, settings.deviation_6()))
        if estimated.covariance_6_6 is None:
            notes.append(f"{estimator} gives no covariance: {estimated.failure}")
            return None
        return PoseSpread(estimated.covariance_6_6, diameter, estimator, starts)

    def _fits_inverted(self, clouds: Clouds, outcome: Outcome) -> bool:
        if outcome.fitness >= GOOD_FITNESS:
            return False
        from_inverse = clouds.frame.coordinates(transform(inverse(clouds.T_target_source_init), clouds.seen))
        distance = self.model.icp.correspondence_distance
        _, fitness_1, rmse_1 = clouds.icp.register(from_inverse, np.eye(4)[None])
        costs_2 = clipped_cost(np.append(outcome.fitness, fitness_1), np.append(outcome.inlier_rmse, rmse_1), distance)
        return bool(costs_2[1] < INVERSE_COST * costs_2[0])


def judge(
    source_points: np.ndarray, target_points: np.ndarray, T_target_source: np.ndarray, **options: Any
) -> Explanation:
    """Judge a pose by the default model, see :meth:`Explainer.judge`; for many pairs, load an explainer once."""
    return Explainer.load().judge(source_points, target_points, T_target_source, **options)


def repair(source_points: np.ndarray, target_points: np.ndarray, *options: Any, **named: Any) -> Repair:
    """Put a registration right by the default model, see :meth:`Explainer.repair`; for many pairs, load one once."""
    return Explainer.load().repair(source_points, target_points, *options, **named)


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    started = perf_counter()
    yield
    seconds[stage] = perf_counter() - started
