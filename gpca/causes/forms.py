"""Forms of the truth's generator: what hides surface, how noise spreads, what the model lacks (docs/appendix.md)."""

import numpy as np
from scipy.spatial import cKDTree

from gpca.causes.settings import FEWEST_POINTS, Form
from gpca.pairs.perturbation import within_half_space
from gpca.rigid import random_direction

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
