"""Re-enactments in depth frames: what an observer with the camera knows, hypotheses, and their counterfactuals."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from gpca.causes.candidate import Candidate
from gpca.causes.dataset import Causes
from gpca.causes.frames import candidate_of_view, outline, subjects_of
from gpca.causes.measuring import Subject
from gpca.causes.settings import FEWEST_POINTS, CauseSettings
from gpca.errors import InputError
from gpca.frames.instances import Instances, Starts
from gpca.frames.shots import MOST_PIXELS, CleanView, Sighting, clean_view, rendered_side
from gpca.objects.camera import MeshScene
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.distances import ObservedPair
from gpca.reenactment import hypotheses as search
from gpca.reenactment.dataset import Reenactments, reenact_all
from gpca.reenactment.enactment import Enactment, enact
from gpca.reenactment.hypotheses import Hypothesis
from gpca.reenactment.mixture import Anchor, Mixture
from gpca.reenactment.mixture_kernels import LARGEST_WIDTH
from gpca.reenactment.settings import ReenactmentSettings
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import inverse, scale_translation, transform
from gpca.seeds import generator

SURFACE_POINTS = 512  # of the whole object, in which the search looks for what was observed


class KnownObject:
    """What an observer knows of an object: its mesh, alone and in its own frame, points on it, and its symmetry."""

    def __init__(self, subject: Subject, mesh: MeshScene) -> None:
        self.subject, self.mesh, self.outline_m = subject, mesh, outline(subject)
        self.surface = ModelSurface(subject.surface[:SURFACE_POINTS])  # in diameters


@dataclass(frozen=True)
class FrameView:
    """A registered pair and the frame that it was observed in; poses `T` are those of hypotheses, in diameters."""

    pair: ObservedPair  # the model is the side that the camera would see at the initial pose
    known: KnownObject
    camera_3_3: np.ndarray
    pixels: np.ndarray  # as in :class:`gpca.frames.shots.Sighting`
    T_camera_start: np.ndarray  # 4×4, where the registration began, ``T_camera_object`` in meters

    @cached_property
    def before(self) -> np.ndarray:
        """(N, 3) what was observed, in the model's frame before the registration, diameters."""
        return transform(self.pair.T_init, self.pair.observed)

    @cached_property
    def sighting(self) -> Sighting:
        """The points that were registered, in the camera's frame, and all pixels of the object."""
        points_m = transform(self.T_camera_start, self.before * self.known.subject.diameter_m)
        return Sighting(points_m, self.pixels, self.camera_3_3)

    def T_camera_object(self, T: np.ndarray) -> np.ndarray:
        """Return the pose of the object in the camera's frame, meters, under a hypothesis."""
        return self.T_camera_start @ scale_translation(inverse(T), self.known.subject.diameter_m)

    def side(self, T: np.ndarray, most_pixels: int) -> tuple[np.ndarray, float]:
        """Return the points (V, 3), diameters, that the camera would see under a hypothesis, and the share measured."""
        T_camera_object, known = self.T_camera_object(T), self.known
        side_m, pixels = rendered_side(known.mesh, self.camera_3_3, T_camera_object, known.outline_m, most_pixels)
        seen = self.sighting.measured(pixels).mean() if len(side_m) else 0.0
        return side_m / self.known.subject.diameter_m, float(seen)

    def candidate(self, T: np.ndarray, random: np.random.Generator) -> Candidate:
        """Return the pair, were a hypothesis true; where no pixel shows the mesh, only its pose is wrong."""
        view = clean_view(self.sighting, self.T_camera_object(T), self.known.mesh, self.known.outline_m)
        if view is None:
            measured_m = transform(T, self.before) * self.known.subject.diameter_m
            view = CleanView(measured_m, measured_m, np.empty((0, 3)), 1.0)
        model, side = self.pair.model, self.side(T, MOST_PIXELS)[0]
        at_truth = side[random.permutation(len(side))[: len(model)]]
        if len(at_truth) < FEWEST_POINTS:
            at_truth = model
        rows = np.arange(len(self.before))
        return candidate_of_view(view, rows, model, at_truth, inverse(T), self.known.subject.diameter_m, random)


COARSE, FINE = 1200, 3000  # pixels at which a side is looked at, about
ITERATIONS, ROUNDS = 12, 2  # of the mixture; of all points, in rounds with the side of the pose that the last one found
OUT_OF_REACH = 12.0  # nats below the best that are not made up for by more points
MISSING = 4.0  # nats that a hypothesis loses whose side was not measured at all
IMPOSSIBLE = -1e6  # nats, of a pose at which nothing would be seen


def find_frame_hypotheses(
    view: FrameView, settings: ReenactmentSettings, random: np.random.Generator
) -> list[Hypothesis]:
    before, surface = view.before, view.known.surface
    few = before[np.sort(random.permutation(len(before))[: search.FITTED])]
    ends_n = search.search_ends(before, surface, view.pair.T_runs @ inverse(view.pair.T_init), random)

    def fit(T: np.ndarray, observed: np.ndarray, pixels: int, rounds: int, anchor: Anchor | None) -> Hypothesis:
        """Return the pose that explains the observed points best, near another; each round looks at the side anew."""
        nothing = np.zeros(len(observed))
        for _ in range(rounds):
            side, share = view.side(T, pixels)
            if len(side) < FEWEST_POINTS:
                return Hypothesis(T, nothing, 0.0, LARGEST_WIDTH, 0.0, IMPOSSIBLE, nothing)
            spacing = float(np.median(cKDTree(side).query(side, 2)[0][:, 1]))
            fits = Mixture(side, spacing / 2).fit(observed, T[None], ITERATIONS, anchor=anchor)
            T = fits.T_n[0]
        likelihood, outliers = float(fits.log_likelihood_n[0]), float(fits.outliers_n[0])
        # What was measured of the side is the denser, the less of it was.
        density = (1 - outliers) * np.log(max(share, search.LEAST_COVERED))
        log_posterior = min(len(observed), search.INDEPENDENT) * (likelihood - density) + search.log_prior(T, settings)
        log_posterior -= MISSING * (1 - share)
        width = float(fits.width_n[0])
        return Hypothesis(T, fits.inlier_n_N[0], likelihood, width, share, float(log_posterior), fits.lone_n_N[0])

    def best(T_n: np.ndarray, observed: np.ndarray, pixels: int, rounds: int, apart: float) -> list[Hypothesis]:
        begun = [*((T, None) for T in T_n), (np.eye(4), search.anchor_of(len(observed), settings))]
        fitted = [fit(T, observed, pixels, rounds, anchor) for T, anchor in begun]
        return search.most_probable(fitted, surface, settings.hypotheses, apart)

    first = search.not_negligible(best(ends_n, few, COARSE, 1, search.SAME), OUT_OF_REACH)
    T_n = np.stack([hypothesis.T for hypothesis in first])
    return search.not_negligible(best(T_n, before, FINE, ROUNDS, search.SAME / 2))


def reenact_frames(
    causes: Causes,
    starts: Starts,
    instances: Instances,
    objects: ObjectClouds,
    meshes: Mapping[int, MeshScene],
    settings: ReenactmentSettings,
    truth: CauseSettings,
) -> Reenactments:
    """Return the re-enactments of every row that :func:`gpca.causes.frames.measure_frames` made of these starts."""
    object_S = instances.object_index[starts.instance] if len(starts) == len(causes) else np.array([])
    if not np.array_equal(object_S, causes.registrations.object_index):
        fault = "are of other registrations than the causes"
        raise InputError("starts of frames", fault, "regenerate both from the same config")
    subjects = subjects_of(instances, starts.instance, objects)
    known = {subject.index: KnownObject(subject, meshes[subject.index]) for subject in subjects}

    def world(pair: ObservedPair, row: int) -> list[Enactment]:
        i = int(starts.instance[row])
        seen, T_start = known[int(instances.object_index[i])], starts.T_camera_object_init[row]
        view = FrameView(pair, seen, instances.camera_3_3[i], instances.pixels_of(i), T_start)
        random = generator(*pair.axes, "hypotheses")
        enactments = []
        for hypothesis in find_frame_hypotheses(view, settings, random):
            candidate = view.candidate(hypothesis.T, random)
            candidate.severity["outliers"] = float((hypothesis.inlier_N <= 0.5).mean())
            # As in the truth of frames, a run without any correspondence stays where it started.
            enactments.append(enact(hypothesis, candidate, seen.subject.errors, pair.axes, truth, misses=True))
        return enactments

    return reenact_all(causes, *(causes.registrations.axes or ("", None)), settings, truth, world)[0]
