"""One registration of a user's own, with a trained model: align, say whether it is right, and why it is not.

What the workflow does with its samples is done here to two clouds, from the same functions: the target's canonical
frame, ICP, the mean embedding of random draws, posterior draws.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
import torch

from gpca.alignment.batched_icp import BatchedICP
from gpca.alignment.canonical_frame import CanonicalFrame, require_cloud_points, thin
from gpca.alignment.icp import clipped_cost
from gpca.alignment.rigid import inverse, require_rigid, transform
from gpca.attribution.scores import entropy
from gpca.causes.truth import NOMINAL
from gpca.encoders.training import best_device
from gpca.errors import InputError
from gpca.model.explanation import Explanation, PoseSpread
from gpca.model.file import Model, model_path
from gpca.objects.canonical import estimate_normals
from gpca.recovery.policy import NOTHING, Decision, RecoveryPolicy
from gpca.seeds import generator
from gpca.uncertainty.settings import UncertaintySettings
from gpca.uncertainty.spread import run_from_starts

GOOD_FITNESS = 0.9  # from which on an initial pose is not doubted
INVERSE_COST = 0.5  # of that from the initial pose; where the inverse of this ends with less, it was probably meant
LARGEST_RATIO = 8.0  # the extents of source and target may differ so much; in the wrong unit they differ by 10 or more


class Explainer:
    """Explains registrations with a trained model.

    Args:
        model: by default the one that :func:`gpca.model.file.model_path` finds.
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
        """Return the explainer of a model file, or of the one that :func:`gpca.model.file.model_path` finds."""
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
    ) -> Explanation:
        """Register the source to the target, and say why that is uncertain. The same clouds give the same numbers.

        Args:
            source_points, target_points: (N, 3) what was observed, and the reference that it is aligned to.
            T_target_source_init: (4, 4) where ICP starts; the identity by default.
            unit: that of points and pose: ``m``, ``cm`` or ``mm``.
            frame: the target's, where it is known already; by default it is measured on its points.
            uncertainty: how the spread of the pose is measured; by default it is not.
            diagnose: whether the registration is diagnosed, if the model can do it: GP-CA alone takes a fifth of the
                time, cannot say that nothing is wrong, and then decides about the action.

        Raises:
            InputError: too few points, NaN, a unit that cannot be right, source and target of unlike sizes, or an
                initial pose that is no rigid transform.
        """
        started = perf_counter()
        seconds: dict[str, float] = {}
        notes: list[str] = []
        with _timed(seconds, "preparation"):
            source, target = (np.asarray(points, np.float64) for points in (source_points, target_points))
            T_init = np.eye(4) if T_target_source_init is None else np.array(T_target_source_init, np.float64)
            require_rigid(T_init, "initial pose")
            require_cloud_points(source, "source")
            frame = frame or CanonicalFrame.of(target, unit)
            target = frame.coordinates(self._thinned(target, "target", notes))
            seen = self._thinned(source, "source", notes)
            source = frame.coordinates(transform(T_init, seen))
            _require_like_sizes(source, target)
            icp = self._icp(target)
        with _timed(seconds, "icp"):
            T_icp_1, fitness_1, rmse_1 = icp.register(source, np.eye(4)[None])
            T_icp, fitness, rmse = T_icp_1[0], fitness_1[0], rmse_1[0]
        found = None
        if diagnose and self.model.diagnoser is not None:
            with _timed(seconds, "diagnosis"):
                found = self.model.diagnoser.diagnose(source, target, T_icp)
            found = replace(found, expected_error=found.expected_error * frame.diameter)
        with _timed(seconds, "embedding"):
            h_1_d = self.embed(transform(T_icp, source))
        with _timed(seconds, "attribution"):
            (scores_C,), (variances_C,), (bald,) = self.model.gpc.attribute(h_1_d)
        told = [*scores_C, *((found.failure, *found.causes.values()) if found else ())]
        if not np.isfinite(h_1_d).all() or not np.isfinite(told).all():
            raise InputError("model", "it gives no finite numbers for these clouds", "make another one")
        with _timed(seconds, "familiarity"):
            warnings = list(self.model.familiar.warnings(source, target)) if self.model.familiar else []
            if found is not None and found.unlikeness > 1:
                warnings.append(
                    f"the pair is {found.unlikeness:.1f} times as far from the registrations that the diagnosis was "
                    "learnt from as 99 % of these are from one another"
                )
            if fitness == 0:
                warnings.append("no source point is near the target at the initial pose, so the scores mean nothing")
            if fitness < GOOD_FITNESS and T_target_source_init is not None:
                from_inverse = frame.coordinates(transform(inverse(T_init), seen))
                if self._cost(*icp.register(from_inverse, np.eye(4)[None])[1:]) < INVERSE_COST * self._cost(
                    fitness_1, rmse_1
                ):
                    warnings.append("the inverse of the initial pose fits far better: is it T_source_target?")
        spread = None
        if uncertainty is not None:
            with _timed(seconds, "uncertainty"):
                spread = _spread(icp, source, T_icp, uncertainty, frame.diameter)
        if found is None:
            decision = self.policy.decide(scores_C, float(bald), concepts=self.model.concepts)
        elif found.state == NOMINAL:
            decision = Decision(NOTHING, "", "nothing is wrong")
        else:
            decision = self.policy.decide(np.array([*found.causes.values()]), found.bald, concepts=(*found.causes,))
        return Explanation(
            T_target_source=frame.pose_outside(T_icp) @ T_init,
            fitness=float(fitness),
            inlier_rmse=float(rmse) * frame.diameter,
            diagnosis=found,
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
        )

    def explain_many(
        self,
        pairs: Iterable[tuple[np.ndarray, np.ndarray] | tuple[np.ndarray, np.ndarray, np.ndarray | None]],
        unit: str = "m",
        uncertainty: UncertaintySettings | None = None,
        diagnose: bool = True,
    ) -> Iterator[Explanation]:
        """Yield the explanation of each pair in turn, as :meth:`explain` gives it.

        The frame of a target that is the same array as that of the pair before is measured once.

        Args:
            pairs: source, target, and the pose where ICP starts if it is not the identity.
            unit, uncertainty, diagnose: as for :meth:`explain`.

        Raises:
            InputError: as :meth:`explain`, when the pair's turn comes; the line names the number of the pair, from 0.
        """
        known, frame = None, None
        for number, (source_points, target_points, *init) in enumerate(pairs):
            try:
                if frame is None or target_points is not known:
                    known, frame = target_points, CanonicalFrame.of(np.asarray(target_points, np.float64), unit)
                T_init = init[0] if init else None
                yield self.explain(source_points, target_points, T_init, unit, frame, uncertainty, diagnose)
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

    def _thinned(self, points: np.ndarray, role: str, notes: list[str]) -> np.ndarray:
        kept = thin(points, self.model.cloud_points, role)
        if len(kept) < len(points):
            notes.append(f"{role}: {len(kept)} of {len(points)} points, drawn at random")
        return kept

    def _cost(self, fitness_1: np.ndarray, rmse_1: np.ndarray) -> float:
        """Return the mean squared distance of a registration, cut off at the correspondence distance."""
        return float(clipped_cost(fitness_1, rmse_1, self.model.icp.correspondence_distance)[0])

    def _icp(self, target: np.ndarray) -> BatchedICP:
        settings = self.model.icp
        return BatchedICP(target, settings, None if settings.method == "point_to_point" else estimate_normals(target))


def _require_like_sizes(source: np.ndarray, target: np.ndarray) -> None:
    extents = [float(np.linalg.norm(np.ptp(cloud, axis=0))) for cloud in (source, target)]
    ratio = extents[0] / extents[1]
    if not 1 / LARGEST_RATIO <= ratio <= LARGEST_RATIO:
        raise InputError("source", f"is {ratio:.3g} times as large as the target", "give both in the same unit")


def _spread(
    icp: BatchedICP, source: np.ndarray, T_icp: np.ndarray, settings: UncertaintySettings, diameter: float
) -> PoseSpread:
    xi_n_6 = generator("explanation", "starts").normal(size=(settings.starts, 6)) * settings.deviation_6()
    runs = run_from_starts(icp, thin(source, settings.icp_points, "spread"), np.eye(4), xi_n_6)
    return PoseSpread(runs.covariance(T_icp), settings.starts, diameter)


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    started = perf_counter()
    yield
    seconds[stage] = perf_counter() - started
