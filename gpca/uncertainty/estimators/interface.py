"""The interface of estimators: a registered pair in, the covariance of its pose out.

All lengths are in diameters of the object, and twists are (rotation, translation) on the left of the pose, in the
target's frame: T = exp(ξ) T̂.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from gpca.alignment.batched_icp import BatchedICP, BatchedPlaneICP
from gpca.alignment.icp import ICPSettings
from gpca.alignment.methods.interface import FEWEST, REACH, Outcome, Pair
from gpca.alignment.methods.registry import make_method, method_entry
from gpca.objects.bop import symmetric_turn
from gpca.pairs.distances import ObservedPair, describe_distances, describe_entropy
from gpca.pairs.judge import Judge
from gpca.rigid import exp, inverse, log, point_jacobians, rigid_motion, transform

SINGULAR = 1e-9  # ratio of eigenvalues below which a direction counts as open
FEWEST_RUNS = 7  # that give a 6×6 covariance its rank
POINT_TO_POINT, POINT_TO_PLANE = "point_to_point", "point_to_plane"
# What a covariance is that of: results from other starts, results of clouds measured again, both at once; poses that
# are likely given these very clouds; or errors, whatever they come from.
Modeled = Literal["starts", "data", "starts and data", "posterior", "error"]
Moved = Literal["model", "observed"]  # which cloud the source is


class FailedEstimate(Exception):
    """Raised inside an estimator that cannot give a covariance; the registry turns it into a failed estimate."""


@dataclass(frozen=True)
class Correspondences:
    """Source points (n, 3) at the pose, their nearest target points, and the normals of these (n, 3) or None."""

    source: np.ndarray
    target: np.ndarray
    normals: np.ndarray | None

    @cached_property
    def residuals(self) -> np.ndarray:
        """(n, 3) from the target's points to the source's."""
        return self.source - self.target

    @cached_property
    def jacobians(self) -> np.ndarray:
        """(n, 3, 6) of the source's points."""
        return point_jacobians(self.source)

    @property
    def variance(self) -> float:
        """Of a coordinate of a residual; the pose has taken six."""
        squares = np.square(self.residuals)
        return float(squares.sum() / max(squares.size - 6, 1))

    def plane_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Return distances from the target's planes (n,) and how they change under a twist (n, 6)."""
        if self.normals is None:
            raise FailedEstimate("the target has no normals")
        distances_n = np.einsum("ni,ni->n", self.normals, self.residuals)
        return distances_n, np.einsum("ni,nij->nj", self.normals, self.jacobians)


@dataclass(frozen=True)
class RegisteredPair:
    """A registration whose covariance is asked for."""

    pair: Pair  # with where the registration started, and a seed for what an estimator draws
    outcome: Outcome
    method: str  # its name in the registry of methods
    deviation_6: np.ndarray  # standard deviations of the initial pose's twist
    describe: Callable[[], np.ndarray] | None = None  # returns descriptors (F,), for estimators that have learned

    @property
    def T_target_source(self) -> np.ndarray:
        """The pose (4×4)."""
        return self.outcome.T_target_source

    def matches(self) -> Correspondences:
        """Return the correspondences at the pose; fewer than three are a failure."""
        moved_N_3 = transform(self.T_target_source, self.pair.source)
        distance_N, rows_N = self.pair.target_tree.query(moved_N_3)
        near_N = distance_N < REACH
        if near_N.sum() < FEWEST:
            raise FailedEstimate(f"fewer than {FEWEST} correspondences at the pose")
        rows_n, normals = rows_N[near_N], self.pair.target_normals
        return Correspondences(
            moved_N_3[near_N], self.pair.target[rows_n], None if normals is None else normals[rows_n]
        )

    def twists_from(self, xi_n_6: np.ndarray) -> np.ndarray:
        """Register from the starts exp(ξ) T_init and return the results' twists about the pose (m, 6).

        Too few runs with a correspondence are a failure, and a method that reads no initial pose.
        """
        if method_entry(self.method).is_global:
            raise FailedEstimate(f"'{self.method}' reads no initial pose, so that its results do not spread")
        pair, starts_n = self.pair, exp(xi_n_6) @ self.pair.T_target_source_init
        if self.method == POINT_TO_POINT:
            poses_n, fitness_n, _ = BatchedICP(pair.target, ICPSettings()).register(pair.source, starts_n)
        elif self.method == POINT_TO_PLANE:
            if pair.target_normals is None:
                raise FailedEstimate("the target has no normals")
            icp = BatchedPlaneICP(pair.target, pair.target_normals, ICPSettings())
            poses_n, fitness_n, _ = icp.register(pair.source, starts_n)
        else:
            outcomes = list(map(make_method(self.method), map(pair.started_at, starts_n)))
            poses_n = np.array([outcome.T_target_source for outcome in outcomes])
            fitness_n = np.array([outcome.fitness for outcome in outcomes])
        return self.twists_of(poses_n, fitness_n > 0)

    def twists_of(self, poses_n: np.ndarray, found_n: np.ndarray) -> np.ndarray:
        """Return those of the poses (n, 4, 4) that were found (n,) as twists about this one; too few are a failure."""
        if found_n.sum() < FEWEST_RUNS:
            raise FailedEstimate(f"fewer than {FEWEST_RUNS} runs found a correspondence")
        return log(poses_n[found_n] @ inverse(self.T_target_source))


@dataclass(frozen=True)
class CovarianceEstimate:
    """The result of an estimator: Σ (6, 6) in radians and diameters, or the reason why there is none."""

    covariance_6_6: np.ndarray | None
    failure: str = ""


@dataclass(frozen=True)
class Example:
    """A registration to learn from."""

    descriptors: np.ndarray  # (F,)
    twists: np.ndarray  # (n, 6) results of several starts, as :meth:`RegisteredPair.twists_from` gives them
    true_twist: np.ndarray  # (6,) of the true pose about that of the registration
    T_target_intrinsic: np.ndarray  # :func:`intrinsic_frame` of the pair


Estimator = Callable[[RegisteredPair], np.ndarray]


@dataclass(frozen=True)
class EstimatorEntry:
    """An estimator in the registry: it has the one or the other function."""

    title: str
    models: Modeled  # what the covariance is that of, by which it is judged
    estimate: Callable[..., np.ndarray] | None = None  # of a registered pair and settings, or raises FailedEstimate
    learn: Callable[..., Estimator] | None = None  # of examples and settings, returns such a function


def inverse_hessian(hessian_6_6: np.ndarray) -> np.ndarray:
    """Return H⁻¹; a singular Hessian, or that of no minimum, is a failure."""
    values_6 = np.linalg.eigvalsh(hessian_6_6)
    if not np.isfinite(values_6).all() or values_6[-1] <= 0:
        raise FailedEstimate("the Hessian is singular: nothing holds the pose")
    if (least := values_6[0] / values_6[-1]) < -SINGULAR:
        raise FailedEstimate("the Hessian is not positive: the pose is no minimum")
    if least < SINGULAR:
        open_directions = int((values_6 < SINGULAR * values_6[-1]).sum())
        raise FailedEstimate(f"the Hessian is singular: {open_directions} of 6 directions are open")
    return np.linalg.inv(hessian_6_6)


def intrinsic_frame(points_N_3: np.ndarray) -> np.ndarray:
    """Return T_target_intrinsic (4×4): a cloud's centroid and principal axes, the longest first."""
    center_3 = points_N_3.mean(axis=0)
    offset_N_3 = points_N_3 - center_3
    axes_3_3 = np.linalg.eigh(np.einsum("ni,nj->ij", offset_N_3, offset_N_3))[1][:, ::-1]
    along_N_3 = np.einsum("ni,ij->nj", offset_N_3, axes_3_3)
    axes_3_3 = axes_3_3 * np.where((along_N_3**3).sum(axis=0) < 0, -1.0, 1.0)
    axes_3_3[:, 2] = np.cross(axes_3_3[:, 0], axes_3_3[:, 1])
    return rigid_motion(axes_3_3, center_3)


def describe(pair: Pair, outcome: Outcome, moved: Moved) -> np.ndarray:
    """Return descriptors (F,) that need no further registration: distances, local planes, entropy."""
    if moved == "model":
        observed, model = transform(inverse(outcome.T_target_source), pair.target), pair.source
    else:
        observed, model = transform(outcome.T_target_source, pair.source), pair.target
    shown = ObservedPair(
        observed=observed,
        model=model,
        T_init=np.eye(4),
        T_runs=np.eye(4)[None],
        fitness_n=np.array([outcome.fitness]),
        inlier_rmse_n=np.array([outcome.inlier_rmse]),
        axes=(),
    )
    return np.concatenate([*describe_distances(shown), describe_entropy(shown)])


def true_twist(registered: RegisteredPair, T_true: np.ndarray, judge: Judge, moved: Moved) -> np.ndarray:
    """Return the twist (6,) of the true pose about that of the registration, the symmetric one that is nearest."""
    T_found = registered.T_target_source
    if moved == "model":
        turn = rigid_motion(symmetric_turn(T_found[:3, :3].T @ T_true[:3, :3], judge.symmetries))
        return log((T_true @ turn @ inverse(T_found))[None])[0]
    turn = rigid_motion(symmetric_turn(T_true[:3, :3] @ T_found[:3, :3].T, judge.symmetries))
    return log((turn @ T_true @ inverse(T_found))[None])[0]


def example(
    registered: RegisteredPair,
    T_true: np.ndarray,
    judge: Judge,
    moved: Moved,
    draw: Callable[[], np.ndarray],
    runs: int,
) -> Example:
    """Return a training registration with the twists (n, 6) of a few others about it, as `draw` gives them."""
    try:
        twists_n_6 = draw()
    except FailedEstimate:  # too few of the runs have any result
        twists_n_6 = np.zeros((runs, 6))
    described = describe(registered.pair, registered.outcome, moved)
    truth_6 = true_twist(registered, T_true, judge, moved)
    return Example(described, twists_n_6, truth_6, intrinsic_frame(registered.pair.target))
