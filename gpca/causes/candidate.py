"""Candidates, pairs with any subset of the causes, and their counterfactual registrations, in the model's frame."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from time import perf_counter
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.batched_icp import icp_to
from gpca.alignment.icp import ICPSettings
from gpca.causes.dataset import Causes
from gpca.causes.settings import FEWEST_POINTS, OBSERVED, CauseSettings, Form
from gpca.causes.truth import NONE, SUBSETS, capped
from gpca.errors import InputError
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import CONCEPTS, NOISE, OVERLAP, POSE, displacement, within_half_space
from gpca.rigid import exp, inverses, random_direction, transform
from gpca.seeds import generator
from gpca.uncertainty.settings import UncertaintySettings
from gpca.uncertainty.spread import Runs, divergence

REPRODUCED = 1e-3  # diameters; points that are drawn again lie no farther from those of a file, which are rounded
CAUSE_OF = {"noise": NOISE, "outliers": NOISE, "rotation_rad": POSE, "translation": POSE, "crop": OVERLAP}
# Forms of the truth's generator: what hides surface, how noise spreads, what the model lacks (docs/appendix.md).
VIEWED_FROM = 3.0  # the distance of a sensor that sees one side
FLIPPED = 100.0  # times the largest distance from it: the radius of the sphere that points are flipped at
PATCHES, CLUSTERS, WAVES = 3, 3, 12
CLUSTER = 0.03  # standard deviation of a cluster of outliers, per axis
TABLE = 0.6  # radius of the part of a table that is observed


class DrawnForm:
    """A form with what it draws, by a generator of its own: samples of two forms are otherwise alike."""

    def __init__(self, form: Form, random: np.random.Generator) -> None:
        self.form, self.random = form, random
        self.factor = (1 + form.scale) ** float(random.choice([-1, 1]))  # times as large the model is as the object
        self.toward = random_direction(random)  # along which the model ends and depth is measured
        self.down = random_direction(random)  # to the table

    def model_and_observed(
        self, surface: np.ndarray, order: np.ndarray, n_model: int, n_observed: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return different points (n, 3) of a surface (N, 3) for both, the rows in this order."""
        rows = np.concatenate([order[:n_model], order[n_model + n_observed :]])
        if self.form.lacking:
            along_N = surface @ self.toward
            rows = rows[along_N[rows] <= np.quantile(along_N, 1 - self.form.lacking)]
        return self.factor * surface[rows[:n_model]], surface[order[n_model : n_model + n_observed]]

    def left(self, points: np.ndarray, toward_hidden: np.ndarray, share: float) -> np.ndarray:
        """Return the rows, in order, of points (N, 3) that are left where a share of them is hidden."""
        if self.form.occlusion == "visibility":
            return visible_rows(points, toward_hidden)
        along_N = points @ toward_hidden
        if self.form.occlusion == "patches":
            along_N = -cKDTree(points[self.random.permutation(len(points))[:PATCHES]]).query(points)[0]
        return within_half_space(along_N, share, FEWEST_POINTS)

    def noisy(self, points: np.ndarray, noise: float, jitter: np.ndarray) -> np.ndarray:
        """Return points (N, 3) with noise of a standard deviation per axis; the jitter (N, 3) is standard normal."""
        if self.form.noise == "quantized":
            step, along_N = np.sqrt(12) * noise, points @ self.toward
            return points + (np.round(along_N / step) * step - along_N)[:, None] * self.toward
        if self.form.noise == "warped":
            jitter = (jitter + smooth_field(points, self.random)) / np.sqrt(2)
        return points + noise * jitter

    def outliers(self, anywhere: np.ndarray) -> np.ndarray:
        """Return where outliers (N, 3), drawn anywhere in a cube, are."""
        if self.form.outliers == "anywhere":
            return anywhere
        cluster_N = self.random.integers(CLUSTERS, size=len(anywhere))
        centers = self.random.uniform(-0.5, 0.5, size=(CLUSTERS, 3))
        return centers[cluster_N] + CLUSTER * self.random.normal(size=anywhere.shape)

    def beside(self, points: int) -> int:
        """Return how many points of a table are observed beside so many of the object."""
        return round(points * self.form.clutter / (1 - self.form.clutter))

    def table(self, surface: np.ndarray, count: int) -> np.ndarray:
        """Return points (count, 3) of a table that a surface (N, 3) stands on."""
        across = np.linalg.svd(self.down[None])[2][1:]
        radius, turn = TABLE * np.sqrt(self.random.random(count)), self.random.uniform(0, 2 * np.pi, count)
        on_plane = (radius * np.array([np.cos(turn), np.sin(turn)])).T @ across
        return (surface @ self.down).max() * self.down + on_plane


def visible_rows(points: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """Return the rows, in order, of points (N, 3) that are not hidden from a side (the hull of the flipped points)."""
    from scipy.spatial import ConvexHull

    rays = points + VIEWED_FROM * toward
    lengths = np.linalg.norm(rays, axis=1, keepdims=True)
    flipped = rays + 2 * (FLIPPED * lengths.max() - lengths) * rays / lengths
    hull = ConvexHull(np.concatenate([flipped, np.zeros((1, 3))])).vertices
    return np.sort(hull[hull < len(points)])


def what_remains(points: np.ndarray, lacking: float, random: np.random.Generator) -> np.ndarray:
    """Return rows, in random order, of points (N, 3) in random order that a partial model has."""
    toward = random_direction(random)
    if random.random() < 0.5:
        return random.permutation(visible_rows(points, -toward))
    return random.permutation(within_half_space(points @ toward, lacking, FEWEST_POINTS))


def smooth_field(points: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Return a smooth field (N, 3) of unit variance at points (N, 3), without what moves them as a rigid body does."""
    frequency, phase = random.normal(size=(3, WAVES)), random.uniform(0, 2 * np.pi, WAVES)
    field = np.cos(2 * np.pi * points @ frequency + phase) @ random.normal(size=(WAVES, 3))
    turns = np.stack([np.cross(axis, points) for axis in np.eye(3)], axis=2)  # (N, 3, 3), the last is the motion
    motions = np.concatenate([turns, np.broadcast_to(np.eye(3), turns.shape)], axis=2).reshape(-1, 6)
    field = field - (motions @ np.linalg.lstsq(motions, field.ravel(), rcond=None)[0]).reshape(field.shape)
    return field / np.sqrt(np.square(field).mean())


def draw_applied(settings: CauseSettings, random: np.random.Generator) -> np.ndarray:
    return random.random(len(CONCEPTS)) < settings.present


@dataclass(frozen=True)
class Candidate:
    """A pair and all causes that may be applied to it; poses take what was observed to a wrong place in the model."""

    applied: np.ndarray  # (3,) which of noise, pose and overlap are
    model: np.ndarray  # (P, 3)
    clean: np.ndarray  # (Q, 3) other points of the surface with a sensor's least noise,
    noisy: np.ndarray  # and with jitter and outliers
    seen: np.ndarray  # rows of them that a small gap leaves,
    kept: np.ndarray  # and those that an occlusion leaves
    T_near: np.ndarray  # where a good start is,
    T_init: np.ndarray  # and where a pose error starts
    severity: dict[str, float]  # small where not applied
    model_at_truth: np.ndarray | None = None  # (P, 3) where there is no pose error, if that changes the model's points
    whole_model: np.ndarray | None = None  # (P, 3) without missing surface, if that changes the model's points
    toward_hidden: np.ndarray | None = None  # (3,) unit vector along which a half-space has cut the surface off
    form: DrawnForm | None = None  # of what was drawn
    beside: int = 0  # observed points that lie on another thing, the last ones

    @property
    def present(self) -> tuple[int, ...]:
        """The numbers of the causes that are applied."""
        return tuple(np.flatnonzero(self.applied).tolist())

    def observed(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the cloud with these of the applied causes."""
        points = self.noisy if NOISE in causes else self.clean
        return points[self.kept if OVERLAP in causes else self.seen]

    def reference(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return the model's points with these of the applied causes."""
        if self.whole_model is not None and OVERLAP not in causes:
            return self.whole_model
        return self.model if POSE in causes or self.model_at_truth is None else self.model_at_truth

    def changing_reference(self, causes: tuple[int, ...]) -> tuple[int, ...]:
        """Return those of the causes that change :meth:`reference`: where they are the same, so are its points."""
        changing = {POSE: self.model_at_truth, OVERLAP: self.whole_model}
        return tuple(cause for cause in causes if changing.get(cause) is not None)

    def icp(self, target: np.ndarray, causes: tuple[int, ...], settings: ICPSettings) -> Any:
        """Return the ICP to a target with these of the applied causes, such as that of :func:`icp_to`."""
        return icp_to(target, settings)

    def start(self, causes: tuple[int, ...]) -> np.ndarray:
        """Return where a registration with these of the applied causes starts."""
        return self.T_init if POSE in causes else self.T_near


def draw_candidate(
    surface: np.ndarray, applied: np.ndarray, settings: CauseSettings, random: np.random.Generator
) -> Candidate:
    """Draw the points, of the object's (N, 3), and the severities of a candidate.

    What is not applied is small, along the same axes; the number of points tells nothing about missing surface.
    """
    fewest, most = settings.points
    form = DrawnForm(settings.form, random.spawn(1)[0])
    counts = np.exp(random.uniform(np.log(fewest), np.log(most), size=2)).round().astype(int)
    strong, small = (
        {part.name: random.uniform(*getattr(ranges, part.name)) for part in fields(ranges)}
        for ranges in (settings.severities, settings.small.ranges())
    )
    for level in (strong, small):
        level["rotation_rad"] = float(np.deg2rad(level.pop("rotation_deg")))
    severity = {name: (strong if applied[cause] else small)[name] for name, cause in CAUSE_OF.items()}
    n_model, n_seen = np.minimum(counts, len(surface) // 2)
    n_observed = min(round(n_seen / (1 - severity["crop"])), len(surface) - n_model)
    order = random.permutation(len(surface))
    model, points = form.model_and_observed(surface, order, n_model, n_observed)
    jitter = random.normal(size=points.shape)
    anywhere = random.uniform(-0.5, 0.5, size=points.shape)
    is_outlier = random.random(len(points)) < strong["outliers"]
    toward_hidden = random_direction(random)
    axis, direction = random_direction(random), random_direction(random)
    seen = within_half_space(points @ toward_hidden, small["crop"], FEWEST_POINTS)
    kept = form.left(points, toward_hidden, strong["crop"])
    if applied[OVERLAP] and settings.form.occlusion == "visibility":
        severity["crop"] = 1 - len(kept) / len(points)
    T_near, T_init = (
        displacement(level["rotation_rad"] * axis, level["translation"] * direction) for level in (small, strong)
    )
    whole_model = None  # overlap may be that the model lacks surface, with or without that some is hidden
    if settings.partial and random.random() < settings.partial and applied[OVERLAP]:
        others = surface[np.concatenate([order[n_model + n_observed :], order[:n_model]])]
        left = others[what_remains(others, random.uniform(*settings.lacking), random)]
        whole_model, model = model, left[:n_model]
        if random.random() < 0.5:
            kept, severity["crop"] = seen, small["crop"]
    noisy = np.where(is_outlier[:, None], form.outliers(anywhere), form.noisy(points, strong["noise"], jitter))
    table = form.table(surface, form.beside(n_seen))
    on_table, rows = form.random.normal(size=table.shape), len(points) + np.arange(len(table))
    return Candidate(
        applied=applied,
        model=model,
        whole_model=whole_model,
        clean=np.concatenate([points + small["noise"] * jitter, table + small["noise"] * on_table]),
        noisy=np.concatenate([noisy, table + strong["noise"] * on_table]),
        seen=np.concatenate([seen, rows]),
        kept=np.concatenate([kept, rows]),
        T_near=T_near,
        T_init=T_init,
        severity=severity,
        toward_hidden=toward_hidden,
        form=form,
        beside=len(table),
    )


def redrawn(candidate: Candidate, surface: np.ndarray, random: np.random.Generator) -> Candidate:
    """Return a candidate without causes once more: as many other points, with the same severities and start."""
    form, count = candidate.form, len(candidate.clean) - candidate.beside
    assert form is not None
    model, points = form.model_and_observed(surface, random.permutation(len(surface)), len(candidate.model), count)
    whole = np.concatenate([points, form.table(surface, candidate.beside)])
    clean = whole + candidate.severity["noise"] * random.normal(size=whole.shape)
    seen = within_half_space(points @ candidate.toward_hidden, candidate.severity["crop"], FEWEST_POINTS)
    return replace(candidate, model=model, clean=clean, seen=np.concatenate([seen, np.arange(count, len(whole))]))


class Unmeasurable(Exception):
    """A candidate has no truth; the text says why."""


@dataclass
class Registrar:
    """Registers one candidate from any starts; `misses`: all runs may stay where they started, else that is refused."""

    candidate: Candidate
    settings: CauseSettings
    misses: bool = False
    _targets: dict[tuple[int, ...], Any] = field(default_factory=dict)  # by the causes that change them

    def run(self, causes: tuple[int, ...], xi_n_6: np.ndarray) -> Runs:
        """Register with these causes, the observed to the model, from exp(ξ) T_init; may raise Unmeasurable."""
        starts_n = exp(xi_n_6) @ self.candidate.start(causes)
        observed, model = self.candidate.observed(causes), self.candidate.reference(causes)
        started = perf_counter()
        if self.settings.moved == OBSERVED:
            moving, target, alike = observed, model, self.candidate.changing_reference(causes)
        else:  # a pose error changes no cloud
            moving, target, alike = model, observed, tuple(cause for cause in causes if cause != POSE)
            starts_n = inverses(starts_n)
        if alike not in self._targets:
            self._targets[alike] = self.candidate.icp(target, alike, self.settings.icp)
        poses_n, fitness_n, rmse_n = self._targets[alike].register(moving, starts_n)
        if self.settings.moved != OBSERVED:
            poses_n = inverses(poses_n)
        seconds = perf_counter() - started
        if not np.isfinite(poses_n).all():
            raise Unmeasurable("not finite")
        if not (fitness_n.any() or self.misses):
            raise Unmeasurable("no correspondences")
        rmse_n = np.where(fitness_n > 0, rmse_n, self.settings.icp.correspondence_distance)
        return Runs(poses_n, fitness_n, rmse_n, len(poses_n), seconds)


@dataclass
class Counterfactuals:
    """The errors and uncertainties of one candidate, measured when first asked for, which may raise Unmeasurable."""

    registrar: Registrar
    errors: Callable[[np.ndarray], np.ndarray]  # of poses (n, 4, 4) of the object's points, in diameters
    xi_n_6: np.ndarray  # the starts, the same for every subset
    settings: UncertaintySettings
    _measured: dict[tuple[int, ...], tuple[float, np.ndarray]] = field(default_factory=dict)

    def error(self, subset: int) -> float:
        """Return v, the mean error over the starts, in diameters."""
        return self._measure(subset)[0]

    def uncertainty(self, subset: int) -> float:
        """Return u against the clean pair, nats."""
        return float(divergence(self.covariance(NONE), self.covariance(subset), self.settings.floor))

    def covariance(self, subset: int) -> np.ndarray:
        """Return Σ (6, 6) of the poses."""
        return self._measure(subset)[1]

    def _measure(self, subset: int) -> tuple[float, np.ndarray]:
        # What was not applied is not there to be removed: those subsets are the same registration.
        causes = tuple(cause for cause in SUBSETS[subset] if self.registrar.candidate.applied[cause])
        if causes not in self._measured:
            runs = self.registrar.run(causes, self.xi_n_6)
            # An error is that of the model's pose in what was observed.
            errors_n = capped(self.errors(inverses(runs.T_target_source_n)))
            if not np.isfinite(errors_n).all():
                raise Unmeasurable("not finite")
            self._measured[causes] = float(errors_n.mean()), runs.covariance(np.eye(4))
        return self._measured[causes]


def drawn_again(
    objects: ObjectClouds, causes: Causes, row: int, source: str, seed: int, settings: CauseSettings
) -> tuple[Candidate, np.ndarray]:
    """Return the candidate that a sample is and its object's points (N, 3), diameters; InputError for others."""
    registrations = causes.registrations
    index = int(registrations.object_index[row])
    surface = objects.points(index).astype(np.float64) / float(objects.diameters_m[index])
    random = generator(source, seed, "causes", str(registrations.split[row]), int(causes.candidate[row]))
    candidate = draw_candidate(surface, draw_applied(settings, random), settings, random)
    present = candidate.present
    drawn, shown = transform(candidate.start(present), candidate.observed(present)), registrations.source(row)
    if drawn.shape != shown.shape or np.abs(drawn - shown).max() > REPRODUCED:
        subject = f"sample {registrations.sample[row]} of {source}, seed {seed}"
        raise InputError(subject, "is not reproduced by these settings", "regenerate the causes from a single config")
    return candidate, surface


def replay(
    objects: ObjectClouds, causes: Causes, row: int, source: str, seed: int, settings: CauseSettings
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Return a sample's model and, under each subset of its causes, the cloud where ICP put it from the start."""
    candidate, _ = drawn_again(objects, causes, row, source, seed, settings)
    registrar, observed = Registrar(candidate, settings), []
    for subset in SUBSETS:
        applied = tuple(cause for cause in subset if candidate.applied[cause])
        T_found = registrar.run(applied, np.zeros((1, 6))).T_target_source_n[0]
        observed.append(transform(T_found, candidate.observed(applied)))
    return candidate.model, observed
