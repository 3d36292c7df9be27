"""A registered pair of a depth frame, with the camera: what an observer knows of it, and would see at any pose."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gpca.alignment.rigid import inverse, scale_translation, transform
from gpca.causes.candidate import Candidate
from gpca.causes.frames import candidate_of_view, outline
from gpca.causes.settings import FEWEST_POINTS
from gpca.causes.subjects import Subject
from gpca.frames.camera import MeshScene
from gpca.frames.shots import MOST_PIXELS, CleanView, Sighting, clean_view, rendered_side
from gpca.pairs.distances import ObservedPair
from gpca.reenactment.surface import ModelSurface

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
