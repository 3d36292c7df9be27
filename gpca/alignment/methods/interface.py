"""The interface of registration methods: a pair of clouds in, an outcome out; all lengths are in object diameters."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.features import NEIGHBORS, estimate_normals
from gpca.alignment.icp import require_cloud
from gpca.errors import InputError
from gpca.rigid import require_rigid, transform

REACH = 0.10  # of correspondences, in diameters, as in the protocol's ICP
ITERATIONS = 50
FEWEST = 3  # correspondences that determine a rigid motion


class FailedRegistration(Exception):
    """Raised inside a method that cannot go on; the registry turns it into a failed outcome."""


@dataclass(frozen=True)
class Pair:
    """Two clouds to be aligned; an InputError rejects normals of another shape, NaN, and poses that are not rigid."""

    source: np.ndarray  # (N, 3), at least three points
    target: np.ndarray  # (P, 3)
    T_target_source_init: np.ndarray = field(default_factory=lambda: np.eye(4))  # global methods ignore it
    source_normals: np.ndarray | None = None  # unit vectors in the frame of their cloud (:meth:`with_normals`)
    target_normals: np.ndarray | None = None
    seed: int = 0  # of a method's random numbers

    def __post_init__(self) -> None:
        for name in ("source", "target"):
            points, normals = getattr(self, name), getattr(self, f"{name}_normals")
            if points.ndim != 2 or points.shape[1] != 3:
                raise InputError(f"{name} cloud", f"has shape {points.shape}", "give an (N, 3) array")
            require_cloud(f"{name} cloud", points)
            if normals is not None and (normals.shape != points.shape or not np.isfinite(normals).all()):
                fault = f"have shape {normals.shape} for points of shape {points.shape}, or contain NaN"
                raise InputError(f"{name} normals", fault, "give one finite vector per point")
        require_rigid(self.T_target_source_init, "initial pose")

    def started_at(self, T_target_source: np.ndarray) -> Self:
        """Return the pair with another initial pose."""
        return replace(self, T_target_source_init=T_target_source)

    def with_normals(self, neighbors: int = NEIGHBORS) -> Self:
        """Return the pair with normals of both clouds, estimated if missing."""
        missing = [name for name in ("source", "target") if getattr(self, f"{name}_normals") is None]
        normals: dict[str, Any] = {
            f"{name}_normals": estimate_normals(getattr(self, name), neighbors) for name in missing
        }
        return replace(self, **normals)

    def normals(self, name: str) -> np.ndarray:
        """Return the normals of the "source" or the "target"; without them, the registration fails."""
        normals: np.ndarray | None = getattr(self, f"{name}_normals")
        if normals is None:
            raise FailedRegistration(f"the {name} has no normals")
        return normals

    @cached_property
    def target_tree(self) -> cKDTree:
        """The target's points, sorted for nearest neighbors."""
        return cKDTree(self.target)


@dataclass(frozen=True)
class Outcome:
    """The result of a registration method."""

    T_target_source: np.ndarray  # the pose (4×4); the initial one if there is no other
    fitness: float  # share of source points with a target point within the correspondence distance at the pose
    inlier_rmse: float  # over those points; 0 without any
    failure: str = ""  # why the registration failed; empty if it did not

    @property
    def converged(self) -> bool:
        """Whether the method found a pose and did not fail."""
        return not self.failure

    @classmethod
    def at(cls, pair: Pair, T_target_source: np.ndarray, distance: float, failure: str = "") -> Self:
        """Measure a pose as Open3D does, whatever the method minimized; without correspondences, it fails."""
        distance_N, _ = pair.target_tree.query(transform(T_target_source, pair.source), distance_upper_bound=distance)
        inlier_N = distance_N < distance
        if not inlier_N.any():
            raise FailedRegistration(f"no source point has a target point within {distance:g} diameters")
        rmse = float(np.sqrt(np.square(distance_N[inlier_N]).mean()))
        return cls(T_target_source, float(inlier_N.mean()), rmse, failure)


@dataclass(frozen=True)
class MethodEntry:
    """A method in the registry."""

    title: str
    align: Callable[..., Outcome]  # ``align(pair, **settings)`` returns an outcome or raises FailedRegistration
    is_global: bool = False  # whether it needs no initial pose
    package: str = ""  # a required module that the suite does not install, if any
    points_only: bool = False  # whether it needs neither normals nor Open3D
