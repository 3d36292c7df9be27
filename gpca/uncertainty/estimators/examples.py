"""Examples for estimators that learn: descriptors of a registration, results of a few starts, the true twist."""

from collections.abc import Callable
from typing import Literal

import numpy as np

from gpca.alignment.methods.interface import Outcome, Pair
from gpca.objects.bop import symmetric_turn
from gpca.pairs.distances import ObservedPair, describe_distances, describe_entropy
from gpca.pairs.judge import Judge
from gpca.rigid import inverse, log, rigid_motion, transform
from gpca.uncertainty.estimators.interface import Example, FailedEstimate, RegisteredPair, intrinsic_frame

Moved = Literal["model", "observed"]  # which cloud the source is


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
    """Return the twist (6,) of the true pose about that of the registration, the symmetric one that is nearest.

    Symmetries are turns of the model: before the pose where the model moves, after it where it is the target.
    """
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
    """Return a training registration with the results of a few others, as `draw` gives their twists (n, 6) about it.

    Where too few of the `runs` have any result, the twists are zeros, as if all were at the pose.
    """
    try:
        twists_n_6 = draw()
    except FailedEstimate:
        twists_n_6 = np.zeros((runs, 6))
    described = describe(registered.pair, registered.outcome, moved)
    truth_6 = true_twist(registered, T_true, judge, moved)
    return Example(described, twists_n_6, truth_6, intrinsic_frame(registered.pair.target))
