"""One registration of a user's own, with a trained model: align it, and tell whether it is right and, if not, why.

Two clouds are treated here as the workflow treats its samples, by the same functions: the target's canonical
frame, ICP, the mean embedding of random draws, posterior draws.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
import torch

from gpca.alignment.canonical_frame import CanonicalFrame
from gpca.alignment.icp import clipped_cost
from gpca.alignment.methods.interface import Outcome, Pair
from gpca.alignment.methods.registry import make_method
from gpca.alignment.rigid import inverse, transform
from gpca.attribution.scores import entropy
from gpca.causes.settings import Limits
from gpca.causes.truth import NOMINAL
from gpca.encoders.training import best_device
from gpca.errors import InputError
from gpca.model.advice import CHECK
from gpca.model.clouds import OR_SCANS, Clouds
from gpca.model.diagnoser import QUICK_HYPOTHESES, QUICK_POINTS
from gpca.model.diagnosis import Diagnosis
from gpca.model.explanation import Explanation, PoseSpread
from gpca.model.familiarity import Void, voids_of
from gpca.model.file import Model
from gpca.model.location import model_path
from gpca.model.pose_spread import NAMES, estimated_spread, spread_estimator, spread_of_icp
from gpca.model.scene import Scene
from gpca.objects.surface import as_points
from gpca.recovery.policy import NOTHING, Decision, RecoveryPolicy
from gpca.seeds import generator, seed_of
from gpca.uncertainty.settings import MONTE_CARLO, UncertaintySettings

NOTHING_REENACTED = "the model is from an older version and re-enacts nothing; make another, or take the package's"
FAST = f"fast: at most {QUICK_POINTS} points and {QUICK_HYPOTHESES} poses were re-enacted, and nothing is promised"
GOOD_FITNESS = 0.9  # from which on an initial pose is not doubted
INVERSE_COST = 0.5  # of that from the initial pose; where the inverse of this ends with less, it was probably meant


class Explainer:
    """Explains registrations with a trained model.

    Args:
        model: by default the one that :func:`gpca.model.location.model_path` finds.
        policy: what turns scores into an action; by default the model's own.
        device: where the encoder runs; by default a GPU where torch finds one.
    """

    def __init__(
        self, model: Model | None = None, policy: RecoveryPolicy | None = None, device: str | None = None
    ) -> None:
        self.model = Model.load(model_path()) if model is None else model
        self.policy = self.model.policy if policy is None else policy
        self._device = best_device() if device is None else torch.device(device)
        self.model.encoder.to(self._device)

    @classmethod
    def load(cls, path: str | Path | None = None) -> Explainer:
        """Return the explainer of a model file, or of the one that :func:`gpca.model.location.model_path` finds."""
        return cls(Model.load(model_path(path)))

    def explain(
        self,
        source_points: np.ndarray,
        target_points: np.ndarray,
        T_target_source_init: np.ndarray | None = None,
        unit: str = "m",
        frame: CanonicalFrame | None = None,
        uncertainty: UncertaintySettings | None = None,
        diagnose: bool = True,
        method: str | None = None,
        estimator: str = MONTE_CARLO,
        fast: bool = False,
    ) -> Explanation:
        """Register the source to the target, and say why that is uncertain. The same clouds give the same numbers.

        Args:
            source_points, target_points: (N, 3) what was observed, and the reference that it is aligned to: arrays, or
                clouds of Open3D.
            T_target_source_init: (4, 4) where ICP starts; the identity by default.
            unit: that of points and pose: ``m``, ``cm`` or ``mm``.
            frame: the target's, where it is known already; by default it is measured on its points.
            uncertainty: how the starts spread over which the pose's uncertainty is measured; by default it is not.
            diagnose: whether the registration is diagnosed, if the model can do it: GP-CA alone takes a fifth of the
                time, cannot say that nothing is wrong, and then decides about the action.
            method: the registration method (docs/registration.md) that aligns the clouds, with its default settings; by
                default the model's own ICP, on whose results the classifier was trained.
            estimator: of the uncertainty, where it is measured (docs/estimators.md): one that needs no training
                registrations. Where it cannot tell, a note says why.
            fast: whether a quick re-enactment is enough: half the time; it errs more often and promises nothing.

        Raises:
            InputError: too few points, NaN, a unit that cannot be right, source and target of unlike sizes, an initial
                pose that is no rigid transform, an unknown method or one whose package is missing, an unknown estimator
                or one that learns.
        """
        register = None if method is None else make_method(method)
        estimate = None if uncertainty is None else spread_estimator(estimator, uncertainty)
        started = perf_counter()
        seconds: dict[str, float] = {}
        notes: list[str] = []
        with _timed(seconds, "preparation"):
            inputs = (source_points, target_points, T_target_source_init, unit, frame)
            clouds = Clouds.prepared(*inputs, self.model.cloud_points, self.model.icp, notes)
        with _timed(seconds, "icp"):
            at_pose = self._aligned(clouds, register, method, notes)
        voids = voids_of(clouds.source, clouds.target, at_pose.fitness, self.model.familiar)
        diagnosis, enact = None, None
        if diagnose and (diagnoser := self.model.diagnoser) is not None:
            diagnoser = diagnoser.quick() if fast else diagnoser
            with _timed(seconds, "diagnosis"):
                diagnosis = diagnoser.diagnose(clouds.source, clouds.target, at_pose.T_target_source)
            outside = diagnosis.outside(clouds.frame, clouds.T_target_source_init)
            diagnosis = replace(outside, void=bool(voids))
            if diagnosis.reenacted is None:
                notes.append(NOTHING_REENACTED)
            else:
                enact = partial(diagnoser.enacted_again, clouds.source, clouds.target, at_pose.T_target_source)
            if fast and enact is not None:
                notes.append(FAST)
        with _timed(seconds, "embedding"):
            h_1_d = self.embed(transform(at_pose.T_target_source, clouds.source))
        with _timed(seconds, "attribution"):
            (scores_C,), (variances_C,), (bald,) = self.model.gpc.attribute(h_1_d)
        numbers = [*scores_C, *((diagnosis.failure, *diagnosis.causes.values()) if diagnosis else ())]
        if not np.isfinite(h_1_d).all() or not np.isfinite(numbers).all():
            raise InputError("model", "gives non-finite numbers for these clouds", "use another one")
        with _timed(seconds, "familiarity"):
            warnings = [*map(str, voids), *self._warnings(clouds, diagnosis)]
            if T_target_source_init is not None and register is None:
                warnings += self._inverted(clouds, at_pose)
        spread = None
        if uncertainty is not None and estimate is not None:
            with _timed(seconds, "uncertainty"):
                spread = self._spread(clouds, at_pose, method, estimator, estimate, uncertainty, notes)
        decision = self._decision(scores_C, float(bald), diagnosis, voids)
        return Explanation(
            T_target_source=clouds.frame.pose_outside(at_pose.T_target_source) @ clouds.T_target_source_init,
            fitness=at_pose.fitness,
            inlier_rmse=at_pose.inlier_rmse * clouds.frame.diameter,
            diagnosis=diagnosis,
            method=method or self.model.icp.method,
            scores=dict(zip(self.model.concepts, scores_C.tolist(), strict=True)),
            variances=dict(zip(self.model.concepts, variances_C.tolist(), strict=True)),
            bald=float(bald),
            entropy=float(entropy(scores_C)),
            concept=self.model.concepts[scores_C.argmax()],
            action=decision.action,
            reason=decision.reason,
            spread=spread,
            unit=unit,
            seconds=seconds | {"total": perf_counter() - started},
            notes=tuple(notes),
            warnings=tuple(warnings),
            learned_from=self.model.learning,
            scene=Scene(
                *(clouds.source, clouds.target, at_pose.T_target_source, clouds.frame),
                *(self.model.icp.correspondence_distance, Limits().failed, enact),
            ),
        )

    def explain_many(
        self,
        pairs: Iterable[tuple[np.ndarray, np.ndarray] | tuple[np.ndarray, np.ndarray, np.ndarray | None]],
        unit: str = "m",
        uncertainty: UncertaintySettings | None = None,
        diagnose: bool = True,
        method: str | None = None,
        estimator: str = MONTE_CARLO,
        fast: bool = False,
    ) -> Iterator[Explanation]:
        """Yield the explanation of each pair in turn, as :meth:`explain` gives it.

        The frame of a target that is the same array as that of the pair before is measured once. Many explanations are
        kept without the clouds that a page needs.

        Args:
            pairs: source, target, and the pose where ICP starts if it is not the identity.
            unit, uncertainty, diagnose, method, estimator, fast: as for :meth:`explain`.

        Raises:
            InputError: as :meth:`explain`, when the pair's turn comes; the line names the number of the pair, from 0.
        """
        options = uncertainty, diagnose, method, estimator, fast
        known, frame = None, None
        for number, (source_points, target_points, *init) in enumerate(pairs):
            try:
                if frame is None or target_points is not known:
                    points = as_points(target_points, "target")
                    known, frame = target_points, CanonicalFrame.of(points, unit, say=OR_SCANS)
                T_init = init[0] if init else None
                explanation = self.explain(source_points, target_points, T_init, unit, frame, *options)
                yield replace(explanation, scene=None)
            except InputError as fault:
                raise InputError(f"pair {number}", str(fault)) from fault

    @torch.inference_mode()
    def embed(self, aligned: np.ndarray) -> np.ndarray:
        """Return the embedding (1, d) of an aligned source cloud (N, 3) in the canonical frame.

        The mean over as many draws as in the training; of exactly as many points as the encoder sees, all draws are
        the same.
        """
        settings = self.model.encoder_settings
        draws = 1 if len(aligned) == settings.draw_points else settings.draws
        n = settings.draw_points
        repeated = len(aligned) < n
        rows_D_N = [
            generator("explanation", "draw", draw).choice(len(aligned), n, replace=repeated, shuffle=False)
            for draw in range(draws)
        ]
        clouds_D_N_3 = torch.from_numpy(aligned.astype(np.float32)[np.array(rows_D_N)])
        return self.model.encoder(clouds_D_N_3.to(self._device)).mean(dim=0, keepdim=True).cpu().numpy()

    def _aligned(
        self,
        clouds: Clouds,
        register: Callable[[Pair], Outcome] | None,
        method: str | None,
        notes: list[str],
    ) -> Outcome:
        """Register by the model's own ICP, or by the method that was asked for; a note says where that failed."""
        if register is None:
            poses_1, fitness_1, rmse_1 = clouds.icp.register(clouds.source, np.eye(4)[None])
            return Outcome(poses_1[0], float(fitness_1[0]), float(rmse_1[0]))
        outcome = register(Pair(clouds.source, clouds.target, seed=seed_of("explanation", method)).with_normals())
        notes += [] if outcome.converged else [f"{method} failed: {outcome.failure}"]
        return Outcome(outcome.T_target_source, float(outcome.fitness), float(outcome.inlier_rmse))

    def _spread(
        self,
        clouds: Clouds,
        at_pose: Outcome,
        method: str | None,
        estimator: str,
        estimate: Callable,
        settings: UncertaintySettings,
        notes: list[str],
    ) -> PoseSpread | None:
        """Return how uncertain the pose is; a note says why an estimator cannot tell."""
        diameter = clouds.frame.diameter
        if method is None and estimator == MONTE_CARLO:
            return spread_of_icp(clouds.icp, clouds.source, at_pose.T_target_source, settings, diameter)
        name = method or NAMES[self.model.icp.method]
        of_pair = (clouds.source, clouds.target, at_pose, name, settings, diameter)
        spread, fault = estimated_spread(estimate, estimator, *of_pair)
        notes += [fault] if fault else []
        return spread

    def _decision(self, scores_C: np.ndarray, bald: float, diagnosis: Diagnosis | None, voids: list[Void]) -> Decision:
        """Return the decision: by the diagnosis where there is one, otherwise by the scores alone."""
        if voids:
            return Decision(CHECK, "", ", ".join(void.check for void in voids))
        if diagnosis is None:
            return self.policy.decide(scores_C, bald, concepts=self.model.concepts)
        if diagnosis.state == NOMINAL:
            return Decision(NOTHING, "", "nothing is wrong")
        return self.policy.decide(np.array([*diagnosis.causes.values()]), diagnosis.bald, concepts=(*diagnosis.causes,))

    def _warnings(self, clouds: Clouds, diagnosis: Diagnosis | None) -> list[str]:
        """Return the reasons to doubt the scores, in words."""
        warnings = list(self.model.familiar.warnings(clouds.source, clouds.target)) if self.model.familiar else []
        if diagnosis is not None and diagnosis.unlikeness > 1:
            warnings.append(
                f"the pair is {diagnosis.unlikeness:.1f} times as far from the registrations that the diagnosis was "
                "trained on as 99 % of these are from one another"
            )
        return warnings

    def _inverted(self, clouds: Clouds, at_pose: Outcome) -> list[str]:
        """Return a warning where ICP ends far better from the inverse of the initial pose."""
        if at_pose.fitness >= GOOD_FITNESS:
            return []
        from_inverse = clouds.frame.coordinates(transform(inverse(clouds.T_target_source_init), clouds.seen))
        distance = self.model.icp.correspondence_distance
        _, fitness_1, rmse_1 = clouds.icp.register(from_inverse, np.eye(4)[None])
        costs_2 = clipped_cost(np.append(at_pose.fitness, fitness_1), np.append(at_pose.inlier_rmse, rmse_1), distance)
        if costs_2[1] < INVERSE_COST * costs_2[0]:
            return ["the inverse of the initial pose fits far better: is it T_source_target?"]
        return []


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    started = perf_counter()
    yield
    seconds[stage] = perf_counter() - started
