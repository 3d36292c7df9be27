"""Measures a candidate: its counterfactuals, the truth that follows from them, and the explainer's view of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gpca.alignment.rigid import inverse, scale_translation, transform
from gpca.causes.counterfactuals import Counterfactuals, Registrar
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.causes.shapley import SUBSETS
from gpca.causes.subjects import Subject
from gpca.causes.truth import Truth, capped, joined
from gpca.io.files import Axes
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import as_registrations
from gpca.seeds import generator


@dataclass(frozen=True)
class Measuring:
    """How candidates are measured.

    Attributes:
        uncertainty_limit: of a nominal registration, nats.
    """

    settings: CauseSettings
    uncertainty_limit: float

    def counterfactuals(self, registrar: Registrar, subject: Subject, axes: tuple, starts: str) -> Counterfactuals:
        """Return the counterfactuals from starts that axes and name draw."""
        return Counterfactuals(registrar, subject.errors, self._twists(axes, starts), self.settings)

    def truth(self, measured: Counterfactuals, subsets: Sequence[int] = range(len(SUBSETS))) -> Truth:
        """Return the truth of one candidate, with these in the places of all eight subsets."""
        limits = self.settings.limits
        return Truth(
            np.array([[measured.error(subset) for subset in subsets]]),
            np.array([[measured.uncertainty(subset) for subset in subsets]]),
            nominal_limit=limits.nominal,
            failed_limit=limits.failed,
            cause_limit=limits.cause,
            uncertainty_limit=self.uncertainty_limit,
        )

    def observed(self, registrar: Registrar, subject: Subject, axes: tuple) -> dict[str, Any]:
        """Return the explainer's view of a candidate, and the perturbations applied to it."""
        candidate = registrar.candidate
        xi_n_6 = self._twists(axes, "observed starts")
        xi_n_6[0] = 0
        causes = tuple(np.flatnonzero(candidate.applied).tolist())
        runs = registrar.run(causes, xi_n_6)
        # The source is what was observed, in the frame of the initial pose.
        T_true = inverse(candidate.start(causes))
        poses_n_m = [scale_translation(T @ T_true, subject.diameter_m) for T in runs.T_target_source_n]
        return {
            "object_index": subject.index,
            "object_name": subject.name,
            "diameter_m": subject.diameter_m,
            "cluster": subject.family,
            "fold": subject.fold,
            "cloud": transform(runs.T_target_source_n[0], candidate.observed(causes)).astype(np.float32),
            "target": candidate.reference(causes).astype(np.float32),
            "T_target_source_true": scale_translation(T_true, subject.diameter_m),
            "T_target_source_init": np.eye(4),
            "T_target_source_icp": poses_n_m[0],
            "fitness": runs.fitness_n[0],
            "inlier_rmse": runs.inlier_rmse_n[0],
            "icp_seconds": runs.icp_seconds,
            **{f"severity_{name}": value for name, value in candidate.severity.items()},
            "applied": candidate.applied,
            "symmetric": subject.symmetric,
            "T_target_source_runs": np.stack(poses_n_m),
            "fitness_runs": runs.fitness_n,
            "inlier_rmse_runs": runs.inlier_rmse_n,
            "error_shown": capped(subject.errors(inverse(runs.T_target_source_n[0])[None]))[0],
        }

    def _twists(self, axes: tuple, starts: str) -> np.ndarray:
        shape = (self.settings.starts, 6)
        return generator(*axes, starts).normal(size=shape) * self.settings.deviation_6()


def as_causes(records: list[dict[str, Any]], axes: Axes) -> tuple[Causes, np.ndarray]:
    """Return rows as registrations with their truth, and the seconds (S,) that ICP took for each.

    Args:
        records: what :meth:`Measuring.observed` returned, with ``sample``, ``split``, ``candidate``, ``truth`` and, of
            test samples, the truth ``again``.
        axes: the source and the seed that they are of.
    """
    truth = joined([record["truth"] for record in records])
    concept_S = np.array(CONCEPTS)[truth.phi.argmax(axis=1)]
    registrations, icp_seconds_S = as_registrations(
        [record | {"concept": concept} for record, concept in zip(records, concept_S, strict=True)], axes
    )
    columns: dict[str, Any] = {name: np.array([record[name] for record in records]) for name in Causes.array_fields()}
    tested = [record["again"] for record in records if "again" in record]
    again = joined(tested) if tested else truth.subset(np.array([], int))
    return Causes(registrations=registrations, **columns, truth=truth, truth_again=again), icp_seconds_S
