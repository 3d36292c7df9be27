"""Coherent point drift (Myronenko & Song 2010) by the package pycpd, at the scale that is given."""

from importlib import import_module
from typing import Annotated, Any

import numpy as np

from gpca.alignment.methods.interface import CORRESPONDENCE_DISTANCE, FEWEST, MethodEntry, Outcome, Pair
from gpca.alignment.methods.local import failure_of_a_step
from gpca.rigid import rigid_motion, transform
from gpca.seeds import generator
from gpca.settings import Bounds, OpenShare


def align(
    pair: Pair,
    outliers: OpenShare = 0.1,
    max_iterations: int = 100,
    tolerance: float = 1e-3,
    points: Annotated[int, Bounds(minimum=FEWEST)] = 512,
    correspondence_distance: float = CORRESPONDENCE_DISTANCE,
) -> Outcome:
    """Drift at most `points` of the source onto the target; `tolerance` is the last change of the objective."""
    random = generator("registration", "drift", pair.seed)
    source, target = (cloud[np.sort(random.permutation(len(cloud))[:points])] for cloud in (pair.source, pair.target))
    drift = _at_scale_1(import_module("pycpd").RigidRegistration)(
        X=np.array(target, np.float64),
        Y=transform(pair.T_target_source_init, source),
        w=outliers,
        max_iterations=max_iterations,
        tolerance=tolerance,
    )
    poses = []
    for step in (drift.register, drift.iterate):  # one more, to see whether it has come to rest
        step()
        poses.append(rigid_motion(drift.R.T, np.ravel(drift.t)) @ pair.T_target_source_init)
    failure = failure_of_a_step(pair, poses[0], poses[1], max_iterations)
    return Outcome.at(pair, poses[0], correspondence_distance, failure)


def _at_scale_1(registration: Any) -> Any:
    """Return the package's class, which estimates a scale as well, with a scale of 1: rigid bodies do not shrink."""

    class Drift(registration):
        s: float

        def update_transform(self) -> None:
            super().update_transform()
            self.t += (self.s - 1) * (self.P1 @ self.Y / self.Np) @ self.R
            self.s = 1.0

        def update_variance(self) -> None:
            super().update_variance()
            # The package's own is that of the best scale, where Σ|x|² - tr(AR) is what is left.
            left = self.Pt1 @ np.square(self.X_hat).sum(axis=1) - 2 * np.trace(self.A @ self.R) + self.YPY
            self.sigma2 = max(left / (self.Np * self.D), self.tolerance / 10)

    return Drift


METHODS = {"cpd": MethodEntry("Coherent point drift", align, package="pycpd", points_only=True)}
