"""Re-enactments in depth frames: what an observer with the camera knows, hypotheses, and their counterfactuals.

As for whole objects (:mod:`gpca.reenactment.hypotheses`), but a camera sees one side of an object: the mixture is
around the points that would be seen at a pose, and what hides the others is not a half-space but whatever stands in
front. At a wrong pose another side would be seen, or much of it where nothing was measured.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.rigid import inverse, scale_translation, transform
from gpca.causes.candidate import Candidate
from gpca.causes.dataset import Causes
from gpca.causes.frames import candidate_of_view, outline, subjects_of
from gpca.causes.measuring import Subject
from gpca.causes.settings import FEWEST_POINTS, CauseSettings
from gpca.errors import InputError
from gpca.frames.instances import Instances
from gpca.frames.shots import MOST_PIXELS, CleanView, Sighting, clean_view, rendered_side
from gpca.frames.starts import Starts
from gpca.objects.camera import MeshScene
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.distances import ObservedPair
from gpca.reenactment.dataset import Reenactments, reenact_all
from gpca.reenactment.enactment import Enactment, register, start_twists
from gpca.reenactment.hypotheses import (
    FITTED,
    INDEPENDENT,
    LEAST_COVERED,
    SAME,
    Hypothesis,
    anchor_of,
    log_prior,
    most_probable,
    not_negligible,
    search_ends,
)
from gpca.reenactment.mixture import LARGEST_WIDTH, Anchor, Mixture
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.seeds import generator

SURFACE_POINTS = 512  # of the whole object, in which the search looks for what was observed


class KnownObject:
    """What an observer knows of an object: its mesh, alone and in its own frame, points on it, and its symmetry."""

    def __init__(self, subject: Subject, mesh: MeshScene) -> None:
        self.subject, self.mesh = subject, mesh
        self.outline_m = outline(subject)

    @cached_property
    def surface(self) -> ModelSurface:
        """Points of the whole surface, in diameters."""
        return ModelSurface(self.subject.surface[:SURFACE_POINTS])


@dataclass(frozen=True)
class FrameView:
    """A registered pair and the frame that it was observed in.

    Poses `T` are hypotheses: they take what was observed, where the registration began, to the model, in diameters; the
    identity is the initial pose.

    Attributes:
        pair: both clouds; the model is the side that the camera would see at the initial pose.
        known: the object.
        camera_3_3, pixels: as in :class:`gpca.frames.shots.Sighting`.
        T_camera_start: 4×4, where the registration began, ``T_camera_object`` in meters.
    """

    pair: ObservedPair
    known: KnownObject
    camera_3_3: np.ndarray
    pixels: np.ndarray
    T_camera_start: np.ndarray

    @cached_property
    def before(self) -> np.ndarray:
        """(N, 3) what was observed, in the model's frame before the registration, diameters."""
        return transform(self.pair.T_init, self.pair.observed)

    @property
    def T_found_n(self) -> np.ndarray:
        """(n, 4, 4) the poses that the registrations ended at."""
        return self.pair.T_runs @ inverse(self.pair.T_init)

    @cached_property
    def sighting(self) -> Sighting:
        """The points that were registered, in the camera's frame, and all pixels of the object."""
        points_m = transform(self.T_camera_start, self.before * self._diameter_m)
        return Sighting(points_m, self.pixels, self.camera_3_3)

    def T_camera_object(self, T: np.ndarray) -> np.ndarray:
        """Return the pose of the object in the camera's frame, meters, under a hypothesis."""
        return self.T_camera_start @ scale_translation(inverse(T), self._diameter_m)

    def side(self, T: np.ndarray, most_pixels: int) -> tuple[np.ndarray, float]:
        """Return the points (V, 3), in diameters, that the camera would see under a hypothesis, and which share of them
        lies at pixels that were measured."""
        T_camera_object, known = self.T_camera_object(T), self.known
        side = rendered_side(known.mesh, self.camera_3_3, T_camera_object, known.outline_m, most_pixels)
        seen = self.sighting.measured(side.pixels).mean() if len(side) else 0.0
        return side.points_m / self._diameter_m, float(seen)

    def candidate(self, T: np.ndarray, random: np.random.Generator) -> Candidate:
        """Return the pair as a candidate of the truth's, as if a hypothesis were true.

        Where none of its pixels shows the mesh then, nothing can be taken away but the pose error.
        """
        view = clean_view(self.sighting, self.T_camera_object(T), self.known.mesh, self.known.outline_m)
        if view is None:
            measured_m = transform(T, self.before) * self._diameter_m
            view = CleanView(measured_m, measured_m, np.empty((0, 3)), 1.0)
        model, side = self.pair.model, self.side(T, MOST_PIXELS)[0]
        at_truth = side[random.permutation(len(side))[: len(model)]]
        if len(at_truth) < FEWEST_POINTS:
            at_truth = model
        rows = np.arange(len(self.before))
        return candidate_of_view(view, rows, model, at_truth, inverse(T), self._diameter_m, random)

    @property
    def _diameter_m(self) -> float:
        return self.known.subject.diameter_m


COARSE, FINE = 1200, 3000  # pixels at which a side is looked at, about
ITERATIONS, ROUNDS = 12, 2  # of the mixture; of all points, in rounds with the side of the pose that the last one found
OUT_OF_REACH = 12.0  # nats below the best that are not made up for by more points
MISSING = 4.0  # nats that a hypothesis loses whose side was not measured at all
IMPOSSIBLE = -1e6  # nats, of a pose at which nothing would be seen


def find_frame_hypotheses(
    view: FrameView, settings: ReenactmentSettings, random: np.random.Generator
) -> list[Hypothesis]:
    """Return the probable hypotheses, the best first."""
    before, surface = view.before, view.known.surface
    few = before[np.sort(random.permutation(len(before))[:FITTED])]
    ends_n = search_ends(before, surface, view.T_found_n, random)

    def fits(T_n: np.ndarray, observed: np.ndarray, pixels: int, rounds: int) -> list[Hypothesis]:
        anchor = anchor_of(len(observed), settings)
        free = [_fit(view, T, observed, pixels, rounds, settings) for T in T_n]
        return [*free, _fit(view, np.eye(4), observed, pixels, rounds, settings, anchor)]

    first = most_probable(fits(ends_n, few, COARSE, 1), surface, settings.hypotheses, SAME)
    first = not_negligible(first, OUT_OF_REACH)
    T_n = np.stack([hypothesis.T for hypothesis in first])
    found = fits(T_n, before, FINE, ROUNDS)
    return not_negligible(most_probable(found, surface, settings.hypotheses, SAME / 2))


def _fit(
    view: FrameView,
    T: np.ndarray,
    observed: np.ndarray,
    pixels: int,
    rounds: int,
    settings: ReenactmentSettings,
    anchor: Anchor | None = None,
) -> Hypothesis:
    """Return the pose that explains the observed points best, near another; each round looks at the side anew."""
    for _ in range(rounds):
        side, share = view.side(T, pixels)
        if len(side) < FEWEST_POINTS:
            return Hypothesis(T, np.zeros(len(observed)), 0.0, LARGEST_WIDTH, 0.0, IMPOSSIBLE)
        fits = Mixture(side, _spacing(side) / 2).fit(observed, T[None], ITERATIONS, anchor=anchor)
        T = fits.T_n[0]
    likelihood, outliers = float(fits.log_likelihood_n[0]), float(fits.outliers_n[0])
    # What was measured of the side is the denser, the less of it was.
    density = (1 - outliers) * np.log(max(share, LEAST_COVERED))
    log_posterior = min(len(observed), INDEPENDENT) * (likelihood - density) + log_prior(T, settings)
    log_posterior -= MISSING * (1 - share)
    return Hypothesis(T, fits.inlier_n_N[0], likelihood, float(fits.width_n[0]), share, float(log_posterior))


def _spacing(points: np.ndarray) -> float:
    """Return the median distance of points (V, 3) from the nearest other."""
    return float(np.median(cKDTree(points).query(points, 2)[0][:, 1]))


def reenact_frames(
    causes: Causes,
    starts: Starts,
    instances: Instances,
    objects: ObjectClouds,
    meshes: Mapping[int, MeshScene],
    settings: ReenactmentSettings,
    truth: CauseSettings,
) -> Reenactments:
    """Return the re-enactments of every row.

    Of the instances it reads pixels, camera and what the dataset says of symmetries; of the causes, both clouds, the
    initial pose and what registrations found.

    Args:
        causes: as :func:`gpca.causes.frames.measure_frames` returns them.
        starts: of these rows, in the same order.
        meshes: as for that function.
        truth: how counterfactuals are registered, and the limits of the states.

    Raises:
        InputError: the starts are of other rows.
    """
    registrations = causes.registrations
    of_object = instances.object_index[starts.instance] if len(starts) == len(causes) else np.array([])
    if not np.array_equal(of_object, registrations.object_index):
        fault = "are of other registrations than the causes"
        raise InputError("starts of frames", fault, "regenerate both from the same config")
    known = {
        subject.index: KnownObject(subject, meshes[subject.index])
        for subject in subjects_of(instances, starts.instance, objects)
    }

    def world(pair: ObservedPair, row: int) -> list[Enactment]:
        i = int(starts.instance[row])
        own, T_start = known[int(instances.object_index[i])], starts.T_camera_object_init[row]
        view = FrameView(pair, own, instances.camera_3_3[i], instances.pixels_of(i), T_start)
        return reenact_frame(view, settings, truth)

    return reenact_all(causes, *(registrations.axes or ("", None)), settings, truth, world)[0]


def reenact_frame(view: FrameView, settings: ReenactmentSettings, truth: CauseSettings) -> list[Enactment]:
    """Find hypotheses of the true pose in a depth frame and enact each, the most probable first.

    As in the truth of frames, a run without any correspondence stays where it started.
    """
    random = generator(*view.pair.axes, "hypotheses")
    hypotheses = find_frame_hypotheses(view, settings, random)
    xi_n_6 = start_twists(view.pair.axes, truth)
    enactments = []
    for hypothesis in hypotheses:
        candidate = view.candidate(hypothesis.T, random)
        outliers = float((hypothesis.inlier_N <= 0.5).mean())
        candidate = replace(candidate, severity=candidate.severity | {"outliers": outliers})
        errors = view.known.subject.errors
        enactments.append(register(hypothesis, candidate, errors, xi_n_6, truth, misses=True))
    return enactments
