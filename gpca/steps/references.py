"""References: what further registrations of the same situation find, by what varies between them.

The method begins at other initial poses (``starts``), surfaces are sampled again with other noise and outliers
(``data``), or both (``all``); the object, where it is cut off, the severities and the pose error stay.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.alignment.methods.interface import CORRESPONDENCE_DISTANCE, MAX_ITERATIONS, Pair
from gpca.alignment.methods.registry import make_method
from gpca.causes.candidate import Candidate
from gpca.causes.settings import FEWEST_POINTS
from gpca.pairs.perturbation import within_half_space
from gpca.rigid import exp, transform
from gpca.seeds import generator
from gpca.uncertainty.estimates import Kind
from gpca.uncertainty.estimators.analytic import sample
from gpca.uncertainty.estimators.interface import POINT_TO_PLANE, POINT_TO_POINT, RegisteredPair

Clouds = Iterator[tuple[np.ndarray, np.ndarray]]  # (N, 3) of sources and (P, 3) of targets
SETTINGS = ICPSettings("point_to_point", CORRESPONDENCE_DISTANCE, MAX_ITERATIONS)  # to points and to planes
AT_ONCE = 50  # point-to-plane runs that go one step at a time together


@dataclass(frozen=True)
class Reference:
    """The results of one kind: twists (n, 6) about the pose; none where too few runs found any correspondence."""

    twists: np.ndarray = field(default_factory=lambda: np.empty((0, 6)))
    seconds: float = 0.0

    @cached_property
    def covariance_6_6(self) -> np.ndarray | None:
        """Σ about the mean of the results."""
        return np.cov(self.twists, rowvar=False) if len(self.twists) else None


@dataclass(frozen=True)
class Redraws:
    """Draws the clouds of a candidate again, with the same causes, severities and numbers of points."""

    candidate: Candidate
    surface: np.ndarray  # (N, 3) points of its object, of which model and observation take different ones
    T_target_observed: np.ndarray  # 4×4, from the candidate's frame
    points: int  # of source and of target, at most

    def clouds(self, *axes: object) -> Clouds:
        """Yield the model as the source and what is observed as the target, without end, drawn by the axes."""
        sampling, noise, outliers = (generator(*axes, name) for name in ("sampling", "noise", "outliers"))
        severity, n_model = self.candidate.severity, len(self.candidate.model)
        n_drawn = n_model + len(self.candidate.clean)
        while True:
            drawn = self.surface[sampling.choice(len(self.surface), n_drawn, replace=False)]
            model, clean = drawn[:n_model], drawn[n_model:]
            observed = clean + severity["noise"] * noise.normal(size=clean.shape)
            astray = outliers.random(len(clean)) < severity["outliers"]
            observed = np.where(astray[:, None], outliers.uniform(-0.5, 0.5, size=clean.shape), observed)
            if self.candidate.toward_hidden is not None:
                along = (clean * self.candidate.toward_hidden).sum(axis=1)
                observed = observed[within_half_space(along, severity["crop"], FEWEST_POINTS)]
            observed = observed[sampling.permutation(len(observed))[: self.points]]
            yield model[: self.points], transform(self.T_target_observed, observed)


def draw_twists(kind: Kind, registered: RegisteredPair, redraws: Redraws, repeats: int, *axes: object) -> np.ndarray:
    """Return the results of so many registrations as twists (n, 6) about the pose; FailedEstimate for too few."""
    if kind == "starts":
        return sample(registered, repeats, *axes)
    axes = (*axes, kind, registered.pair.seed)
    deviation_6 = registered.deviation_6 if kind == "all" else np.zeros(6)
    xi_n_6 = generator(*axes, "starts").normal(size=(repeats, 6)) * deviation_6
    starts_n = exp(xi_n_6) @ registered.pair.T_target_source_init
    return registered.twists_of(*_register_each(registered.method, redraws.clouds(*axes), starts_n))


def _register_each(method: str, clouds: Clouds, starts_n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poses of other clouds registered from each start (n, 4, 4), and which found a correspondence (n,)."""
    from gpca.alignment.batched_icp import BatchedICP, BatchedPlaneICP, register_each_to_planes
    from gpca.alignment.features import estimate_normals

    parts = []
    if method == POINT_TO_PLANE:
        for at in range(0, len(starts_n), AT_ONCE):
            starts_k = starts_n[at : at + AT_ONCE]
            pairs = list(islice(clouds, len(starts_k)))
            icps = [BatchedPlaneICP(target, estimate_normals(target), SETTINGS) for _, target in pairs]
            parts.append(register_each_to_planes(icps, [source for source, _ in pairs], starts_k)[:2])
    elif method == POINT_TO_POINT:
        for start, (source, target) in zip(starts_n, clouds, strict=False):  # the clouds are without end
            parts.append(BatchedICP(target, SETTINGS).register(source, start[None])[:2])
    else:
        register = make_method(method)
        for start, (source, target) in zip(starts_n, clouds, strict=False):
            outcome = register(Pair(source, target, start).with_normals())
            parts.append((outcome.T_target_source[None], np.array([outcome.fitness])))
    poses, fitness = zip(*parts, strict=True)
    return np.concatenate(poses), np.concatenate(fitness) > 0
