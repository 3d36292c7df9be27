"""Situations: an object in a scene of the virtual camera whose registration is disturbed by one known cause."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull

from gpca.errors import InputError
from gpca.frames.initial_pose import GlobalRegistration, InitialPoseSettings
from gpca.frames.rgbd_scene import Placed, SceneSettings, center, lay_table, rest, stable_poses
from gpca.frames.shots import Shot, median_depth
from gpca.objects.bop import find_symmetries
from gpca.objects.camera import TABLE_M, Camera, DepthNoise, MeshScene, direction, look_at, table
from gpca.objects.canonical import sample_objects
from gpca.objects.surface import Surface
from gpca.pairs.perturbation import Hidden, Severities, misplace
from gpca.rigid import inverse, scale_translation, transform
from gpca.seeds import generator, seed_of
from gpca.settings import NotNegative, require_ascending

COARSE = 4  # images are thinned by this factor where only shares of pixels count
LEAST_VISIBLE = 0.7  # share of an object that must be visible before anything is put in front of it
REDRAWS = 40  # of a situation without room for its cause
OCCLUDERS = 6  # tried in front of an object
OCCLUDER_TURN_DEG = 20.0  # largest angle of the occluder off the line to the camera


@dataclass(frozen=True)
class SituationSettings:
    """Settings of situations: the scenes, and how strongly causes disturb a registration."""

    scenes: SceneSettings = field(default_factory=SceneSettings)  # their camera sees the region about the object
    noise_scale: tuple[NotNegative, NotNegative] = (3.0, 8.0)  # factor on the scenes' noise, for the cause noise
    hidden: tuple[Hidden, Hidden] = (0.5, 0.9)  # share of the visible part behind an occluder, for the cause overlap
    severities: Severities = field(default_factory=Severities)  # of the error of the estimated pose, for the cause pose

    def __post_init__(self) -> None:
        require_ascending("recovery.", self, "noise_scale", "hidden")


class Shelf:
    """The objects that tables are laid with: surfaces, stable poses, canonical clouds of so many points, symmetries."""

    def __init__(
        self, surfaces: Sequence[Surface], source: str, points: int = 4096, estimator: InitialPoseSettings | None = None
    ) -> None:
        self.surfaces = [center(surface) for surface in surfaces]
        self.resting = [stable_poses(surface) for surface in self.surfaces]
        self._hulls_m = [surface.vertices_m[ConvexHull(surface.vertices_m).vertices] for surface in self.surfaces]
        self.objects = sample_objects(self.surfaces, source, points)
        sizes = enumerate(self.objects.diameters_m)
        self.symmetric = [bool(find_symmetries(self.objects.points(i), diameter_m)) for i, diameter_m in sizes]
        self._settings = estimator or InitialPoseSettings()
        self._estimators: dict[int, GlobalRegistration] = {}

    def outline(self, object_: Placed):
        """Return the convex outline of an object on the table, as a polygon in meters."""
        from shapely import MultiPoint

        return MultiPoint(transform(object_.T_world_object, self._hulls_m[object_.model])[:, :2]).convex_hull

    def estimator(self, model: int) -> GlobalRegistration:
        """Return the pose estimator of an object."""
        if model not in self._estimators:
            self._estimators[model] = GlobalRegistration(self.objects, model, self._settings)
        return self._estimators[model]


@dataclass(frozen=True, eq=False)
class Situation:
    """The truth of one case; a robot gets only the model and what :meth:`shoot` and :meth:`estimate` return."""

    shelf: Shelf
    standing: tuple[Placed, ...]  # the objects on the table, the one in question first
    T_world_camera: np.ndarray  # the first viewpoint
    T_object_estimated: np.ndarray  # error of every estimated pose, for the cause pose
    camera: Camera
    noise: DepthNoise
    cause: str  # of a failure; empty for none
    table: int  # its number among the tables of its part
    axes: tuple  # names of its random numbers

    @property
    def model(self) -> int:
        """The number of the object on the shelf."""
        return self.standing[0].model

    @property
    def T_world_object(self) -> np.ndarray:
        """The true pose."""
        return self.standing[0].T_world_object

    @property
    def diameter_m(self) -> float:
        """The object's diameter."""
        return float(self.shelf.objects.diameters_m[self.model])

    @cached_property
    def meshes(self) -> MeshScene:
        """The scene, ready to be looked at; mesh 0 is the object."""
        placed = [(p.T_world_object, self.shelf.surfaces[p.model]) for p in self.standing]
        return MeshScene([*((transform(T, surface.vertices_m), surface.triangles) for T, surface in placed), table()])

    def shoot(self, T_world_camera: np.ndarray, frames: int, *axes: object) -> Shot:
        """Measure from a viewpoint: the median depth of several frames, whose noise is named by the axes."""
        view = self.meshes.look(self.camera, T_world_camera)
        depth_n_H_W = [self.noise.measure(view, generator(*self.axes, "shot", *axes, n)) for n in range(frames)]
        depth_m = median_depth(np.array(depth_n_H_W)) if frames > 1 else depth_n_H_W[0]
        return Shot(self.camera, T_world_camera, depth_m, view.mesh == 0)

    def estimate(self, shot: Shot, points_m: np.ndarray, *axes: object) -> np.ndarray:
        """Return the estimated ``T_world_object`` from points (P, 3) in the world, moved to them where it is far."""
        in_camera_m = transform(inverse(shot.T_world_camera), points_m)
        seed = seed_of(*self.axes, "estimate", *axes)
        T_camera_object = self.shelf.estimator(self.model).register(in_camera_m, seed)
        if np.linalg.norm(T_camera_object[:3, 3] - in_camera_m.mean(axis=0)) > self.diameter_m:
            T_camera_object[:3, 3] = in_camera_m.mean(axis=0)
        return shot.T_world_camera @ T_camera_object @ self.T_object_estimated

    def visible(self) -> np.ndarray:
        """Return the pixels, of a thinned image, that show the object from the first viewpoint."""
        return self.meshes.look(coarse(self.camera), self.T_world_camera).mesh == 0


def coarse(camera: Camera) -> Camera:
    return Camera(camera.width // COARSE, camera.height // COARSE, camera.focal_px / COARSE)


class Situations:
    """Draws situations on the tables of one part of a run, e.g. ``("recovery", 0, "train")``; parts share no tables."""

    def __init__(self, shelf: Shelf, settings: SituationSettings, part: tuple) -> None:
        self._shelf, self._settings, self._part = shelf, settings, part
        self._alone: dict[int, MeshScene] = {}
        self._tables: dict[int, list[Placed]] = {}

    def draw(self, cause: str, *axes: object) -> tuple[Situation, Situation]:
        """Return a situation with the cause, and the same one without it; InputError where there is no room for it."""
        for redraw in range(REDRAWS):
            axes_now = (*self._part, *axes, redraw)
            random = generator(*axes_now)
            clean = self._clean(random, axes_now)
            if clean and (disturbed := self._disturbed(clean, cause, random)):
                return disturbed, clean
        raise InputError(f"recovery: situation {axes}", f"has no room for cause '{cause}'", "widen recovery.hidden")

    def misplaced(self, clean: Situation, number: int, random: np.random.Generator | None = None) -> Situation:
        """Return a variant of a situation without a cause, with its own pose error."""
        random = random or generator(*clean.axes, "misplaced", number)
        T_error = misplace(np.zeros((1, 3)), self._settings.severities, random).T_target_source_true
        return replace(clean, T_object_estimated=scale_translation(T_error, clean.diameter_m), cause="pose")

    def _clean(self, random: np.random.Generator, axes: tuple) -> Situation | None:
        scenes = self._settings.scenes
        number = int(random.integers(scenes.count))
        if number not in self._tables:
            source = "/".join(map(str, self._part))
            self._tables[number] = lay_table(self._shelf.surfaces, scenes, source, number, self._shelf.resting)
        standing = list(self._tables[number])
        standing.insert(0, standing.pop(int(random.integers(len(standing)))))
        toward = direction(random.uniform(0, 2 * np.pi), np.deg2rad(random.uniform(*scenes.elevation_deg)))
        center_m = standing[0].T_world_object[:3, 3]
        T_world_camera = look_at(center_m + random.uniform(*scenes.distance_m) * toward, center_m)
        drawn = (np.eye(4), scenes.camera, scenes.noise, "", number, axes)
        situation = Situation(self._shelf, tuple(standing), T_world_camera, *drawn)
        whole = self._silhouette(situation, situation.standing[0]).sum()
        return situation if whole and situation.visible().sum() >= LEAST_VISIBLE * whole else None

    def _silhouette(self, situation: Situation, object_: Placed) -> np.ndarray:
        if object_.model not in self._alone:
            surface = self._shelf.surfaces[object_.model]
            self._alone[object_.model] = MeshScene([(surface.vertices_m, surface.triangles)])
        T_object_camera = inverse(object_.T_world_object) @ situation.T_world_camera
        return self._alone[object_.model].silhouette(coarse(situation.camera), T_object_camera)

    def _disturbed(self, clean: Situation, cause: str, random: np.random.Generator) -> Situation | None:
        settings = self._settings
        if cause == "noise":
            scale = settings.scenes.noise.scale * random.uniform(*settings.noise_scale)
            return replace(clean, noise=replace(clean.noise, scale=scale), cause=cause)
        if cause == "pose":
            return self.misplaced(clean, 0, random)
        if cause != "overlap":
            raise InputError(f"cause '{cause}'", "unknown", "choose one of noise, pose, overlap")
        visible = clean.visible()
        outlines = [self._shelf.outline(object_) for object_ in clean.standing]
        low, high = settings.hidden
        for _ in range(OCCLUDERS):
            occluder = self._in_front(clean, outlines, random)
            if occluder and low <= (self._silhouette(clean, occluder) & visible).sum() / visible.sum() <= high:
                return replace(clean, standing=(*clean.standing, occluder), cause=cause)
        return None

    def _in_front(self, clean: Situation, outlines: list, random: np.random.Generator) -> Placed | None:
        """Stand another object on the table, toward the camera and as near to the object as there is room."""
        from shapely.affinity import translate

        taken = {object_.model for object_ in clean.standing}
        if not (free := sorted(set(range(len(self._shelf.surfaces))) - taken)):
            return None
        model = int(random.choice(free))
        T_world_object = rest(*self._shelf.resting[model], random)
        mine = self._shelf.outline(Placed(model, T_world_object))
        target_m = clean.T_world_object[:2, 3]
        turn = np.deg2rad(random.uniform(-OCCLUDER_TURN_DEG, OCCLUDER_TURN_DEG))
        along = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        way = along @ (clean.T_world_camera[:2, 3] - target_m)
        for share in np.arange(0.05, 0.6, 0.02):
            at = target_m + share * way
            if all(translate(mine, *at).distance(o) >= self._settings.scenes.gap_m for o in outlines):
                T_world_object[:2, 3] += at
                return Placed(model, T_world_object) if np.abs(at).max() < TABLE_M / 2 else None
        return None
