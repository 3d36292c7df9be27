"""Instances: objects in single depth frames with their true and initial poses, and how they are read from datasets."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from gpca.alignment.rigid import inverse, transform
from gpca.errors import InputError
from gpca.frames.bop import Annotation, Frame, TooFewPoints, measured_points, without_background
from gpca.frames.dataset import CenteredModel, Dataset
from gpca.frames.initial_pose import (
    EstimatorErrors,
    GlobalRegistration,
    InitialPoseSettings,
    displace,
    error_of,
    estimates_of,
    read_pose_errors,
)
from gpca.frames.plausibility import (
    FARTHEST,
    JUDGED_POINTS,
    Observation,
    median_distance,
    require_plausible,
    require_shared_form,
    spread,
)
from gpca.frames.shots import Sighting
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import FLAG, FLOAT, Container, array
from gpca.objects.bop import find_symmetries
from gpca.objects.canonical import DRAWN, ObjectClouds, unseen
from gpca.process.progress import progress
from gpca.seeds import generator, seed_of

NO_COLOR = "none"


@dataclass(frozen=True)
class Instances(Container):
    """I objects in frames. The object frame is that of the canonical cloud, centered on its bounding box.

    Attributes:
        object_index: of the objects npz beside this file.
        symmetric: a rotation exists that changes nothing about the object's shape.
        init_from: where the initial pose is from: an estimator, ``errors`` of estimators, or another form.
        camera_3_3: K in pixels.
        colour: path of the color image; `NO_COLOR` where there is none.
        fold: that the scene is tested with, `DRAWN` or `TRAINING` (:mod:`gpca.objects.canonical`).
        points_m: float32, measured points in the camera's frame, of one instance after another.
        pixels: int32, where each was seen, (u, v).
    """

    dataset: np.ndarray = array("I", TEXT)
    scene: np.ndarray = array("I", WHOLE)
    image: np.ndarray = array("I", WHOLE)
    object_index: np.ndarray = array("I", WHOLE)
    symmetric: np.ndarray = array("I", FLAG)
    T_camera_object_true: np.ndarray = array("I 4 4", FLOAT)
    T_camera_object_init: np.ndarray = array("I 4 4", FLOAT)
    init_from: np.ndarray = array("I", TEXT)
    camera_3_3: np.ndarray = array("I 3 3", FLOAT)
    colour: np.ndarray = array("I", TEXT)
    fold: np.ndarray = array("I", WHOLE)
    points_m: np.ndarray = array("P 3", FLOAT, offsets="offsets", fewest=3)
    pixels: np.ndarray = array("P 2", WHOLE, offsets="offsets", fewest=3)
    offsets: np.ndarray = array("I+1", WHOLE)

    def cloud_m(self, i: int) -> np.ndarray:
        """Return the measured points (P, 3) of instance i."""
        return self.part("points_m", i)

    def pixels_of(self, i: int) -> np.ndarray:
        """Return the pixels (P, 2) of instance i."""
        return self.part("pixels", i)

    def sighting(self, i: int) -> Sighting:
        """Return what was measured of instance i."""
        return Sighting(self.cloud_m(i).astype(np.float64), self.pixels_of(i), self.camera_3_3[i])

    @property
    def is_colored(self) -> np.ndarray:
        """(I,) the frame has a color image."""
        return self.colour != NO_COLOR

    @property
    def cluster(self) -> np.ndarray:
        """(I,) the scene, whose frames show the same objects in the same poses."""
        return np.array([f"{dataset} {scene}" for dataset, scene in zip(self.dataset, self.scene, strict=True)])

    def split(self, source: str, seed: int, test_share: float) -> dict[str, np.ndarray]:
        """Return the rows of ``train`` and ``test``, by whole scenes: frames of one scene reveal each other.

        The seed's fold is tested. Of scenes without a fold, a share of the rows is tested, by an order drawn with the
        seed: at least one scene, never all. InputError where all frames are of one scene.
        """
        by_fold = unseen(self.fold, seed)
        is_test = np.zeros(len(self), bool) if by_fold is None else by_fold
        is_drawn = self.fold == DRAWN
        _, scene_n = np.unique(self.cluster[is_drawn], return_inverse=True)
        scenes = generator(source, seed, "split").permutation(len(np.unique(scene_n)))
        sizes_G = np.bincount(scene_n, minlength=len(scenes))[scenes]
        n_test = 1 + int(np.sum(np.cumsum(sizes_G)[:-1] < test_share * len(scene_n)))
        is_test[is_drawn] = np.isin(scene_n, scenes[: min(n_test, len(scenes) - 1)])
        if is_test.all() or not is_test.any():
            raise InputError(f"instances of {source}", "all are from one scene", "give frames from at least two scenes")
        return {"train": np.flatnonzero(~is_test), "test": np.flatnonzero(is_test)}


def points_on_model(instances: Instances, objects: ObjectClouds, most_points: int | None = None) -> np.ndarray:
    """Return the median distance (I,) in meters from each instance's points to its model under the true pose.

    With `most_points`, about this many points of each instance are used, for speed.
    """
    trees = {index: cKDTree(objects.points(index)) for index in np.unique(instances.object_index)}
    medians_m = []
    for i, index in enumerate(instances.object_index):
        points_m = spread(instances.cloud_m(i), most_points or len(instances.points_m))
        medians_m.append(median_distance(trees[index], transform(inverse(instances.T_camera_object_true[i]), points_m)))
    return np.array(medians_m)


def require_of_objects(instances: Instances, objects: ObjectClouds, subject: object) -> None:
    """Raise an InputError that names `subject` unless the instances show these objects at their true poses."""
    remedy = "regenerate both files in one call"
    if instances.object_index.min() < 0 or instances.object_index.max() >= len(objects):
        raise InputError(subject, "shows objects that the object file does not contain", remedy)
    medians_m = points_on_model(instances, objects, JUDGED_POINTS)
    distances = medians_m / objects.diameters_m[instances.object_index]
    if distances.max() > FARTHEST:
        i = int(distances.argmax())
        name = objects.names[instances.object_index[i]]
        raise InputError(subject, f"instance {i} was measured {distances[i]:.2g} diameters from '{name}'", remedy)


def read_instances(
    datasets: Mapping[str, tuple[Dataset, list[Frame], dict[int, CenteredModel]]],
    objects: ObjectClouds,
    settings: InitialPoseSettings,
) -> Instances:
    """Return every object of the frames with enough measured points, with its true and its initial pose.

    Objects with too few points are left out and named on stderr. InputError for faulty files, an object that was
    measured away from its pose, or nothing left.

    Args:
        datasets: name -> dataset, its frames, the models of their objects.
        objects: the canonical clouds of all these models, by their surfaces' names.
    """
    if settings.form == "results" and not any(of.results or of.errors for of, _, _ in datasets.values()):
        raise InputError(f"dataset {next(iter(datasets))}", "has no results file", "set results or choose another pose")
    left_out: list[str] = []
    seen: list[tuple[_Objects, Frame, int, dict]] = []
    for dataset, frames, models in datasets.values():
        catalog = _Objects(dataset, objects, models, settings)
        first = len(seen)
        for frame in progress(frames, f"frames of {dataset.name}"):
            shown = {"dataset": dataset.name, "scene": frame.scene, "image": frame.image}
            shown |= {"camera_3_3": frame.camera_3_3, "colour": str(frame.color or NO_COLOR)}
            shown["fold"] = dataset.fold(frame.scene)
            seen += [(catalog, frame, n, shown | row) for n, row in catalog.in_frame(frame, left_out)]
        observations = [catalog.observation(frame.annotations[n], row["points_m"]) for _, frame, n, row in seen[first:]]
        require_shared_form(dataset.name, observations)
    if not seen:
        reasons = f"; the first skipped: {left_out[0]}" if left_out else ""
        raise InputError(", ".join(datasets), f"no object is left in any frame{reasons}", "check masks and depth")
    if settings.form == "results":  # last, since errors are measured against poses that fit the measurements
        poses = _poses_from_results(datasets, seen)
    else:
        poses = [
            (settings.form, catalog.initial_pose(frame, n, row))
            for catalog, frame, n, row in progress(seen, "initial poses")
        ]
    for fault in left_out:
        print(f"skipped: {fault}", file=sys.stderr)
    rows = [
        row | {"T_camera_object_init": T_init, "init_from": init_from}
        for (*_, row), (init_from, T_init) in zip(seen, poses, strict=True)
    ]
    parts = ("points_m", "pixels")
    columns: dict[str, Any] = {name: np.array([row[name] for row in rows]) for name in rows[0] if name not in parts}
    columns |= {name: np.concatenate([row[name] for row in rows]) for name in parts}
    offsets = np.cumsum([0, *(len(row["points_m"]) for row in rows)], dtype=np.int64)
    return Instances(**columns, offsets=offsets)


def _poses_from_results(
    datasets: Mapping[str, tuple[Dataset, list[Frame], dict]], seen: list[tuple[_Objects, Frame, int, dict]]
) -> list[tuple[str, np.ndarray]]:
    """Return a random estimator that found each object, and its pose; else ``errors``, and the truth with an error."""
    estimators = {name: dataset.estimators() for name, (dataset, _, _) in datasets.items()}
    errors = EstimatorErrors(
        {(catalog.name, number) for catalog, *_ in seen for number, symmetric in catalog.symmetric.items() if symmetric}
    )
    for name, (dataset, _, models) in datasets.items():
        for number, T_error in read_pose_errors(dataset.errors, models) if dataset.errors else ():
            errors.add((name, number), T_error)
    estimates: list[tuple[str, np.ndarray] | None] = []
    for catalog, frame, n, row in seen:
        annotation = frame.annotations[n]
        number = annotation.object_id
        alone = [each.object_id for each in frame.annotations].count(number) == 1
        random = generator(catalog.name, *frame.place, n, "estimator")
        shown = row | {"diameter_m": catalog.diameter_m(number)}
        candidates = estimates_of(estimators[catalog.name], (*frame.place, number), alone, shown)
        chosen = candidates[int(random.integers(len(candidates)))] if candidates else None
        estimates.append(chosen)
        if chosen:
            errors.add((catalog.name, number), error_of(annotation.T_camera_model, chosen[1]))
    poses = []
    for (catalog, frame, n, _), chosen in zip(seen, estimates, strict=True):
        annotation = frame.annotations[n]
        T_model_object = catalog.models[annotation.object_id].T_model_object
        if chosen is None:
            random = generator(catalog.name, *frame.place, n, "error")
            T_error = errors.draw((catalog.name, annotation.object_id), random)
            chosen = ("errors", annotation.T_camera_model @ T_error)
        poses.append((chosen[0], chosen[1] @ T_model_object))
    return poses


class _Objects:
    """The objects of one dataset, ready to be found in frames."""

    def __init__(
        self, dataset: Dataset, objects: ObjectClouds, models: dict[int, CenteredModel], settings: InitialPoseSettings
    ):
        self.name, self.models = dataset.name, models
        self._objects, self._settings = objects, settings
        self._index = {number: objects.names.index(model.surface.name) for number, model in models.items()}
        self._trees = {number: cKDTree(objects.points(index)) for number, index in self._index.items()}
        self._registration: dict[int, GlobalRegistration] = {}
        self.symmetric = {}
        for number, i in self._index.items():
            symmetries = models[number].listed_symmetries
            if symmetries is None:
                symmetries = find_symmetries(objects.points(i), objects.diameters_m[i])
            self.symmetric[number] = bool(symmetries)

    def in_frame(self, frame: Frame, left_out: list[str]) -> list[tuple[int, dict]]:
        """Return the objects that were measured, by their number among the annotations."""
        depth_m = frame.depth_m()
        rows = []
        for n, annotation in enumerate(frame.annotations):
            number = annotation.object_id
            try:
                points_m, pixels = measured_points(frame, annotation, depth_m)
                require_plausible(self.observation(annotation, points_m))
                points_m, pixels = without_background(points_m, pixels, annotation, self.diameter_m(number))
            except TooFewPoints as fault:
                left_out.append(str(fault))
                continue
            T_true = annotation.T_camera_model @ self.models[number].T_model_object
            seen: dict[str, Any] = {"object_index": self._index[number], "symmetric": self.symmetric[number]}
            seen |= {"T_camera_object_true": T_true, "points_m": points_m.astype(np.float32)}
            rows.append((n, {**seen, "pixels": pixels.astype(np.int32)}))
        return rows

    def observation(self, annotation: Annotation, points_m: np.ndarray) -> Observation:
        number, T_camera_model = annotation.object_id, annotation.T_camera_model
        T_model_object, tree = self.models[number].T_model_object, self._trees[number]
        return Observation(annotation.subject, T_camera_model, T_model_object, tree, self.diameter_m(number), points_m)

    def initial_pose(self, frame: Frame, n: int, row: dict) -> np.ndarray:
        """Return ``T_camera_object`` that ICP starts from where no estimator is asked."""
        number = frame.annotations[n].object_id
        axes = (self.name, frame.scene, frame.image, n, "initial pose")
        if self._settings.form == "true_pose":
            return displace(row["T_camera_object_true"], self.diameter_m(number), self._settings, generator(*axes))
        if number not in self._registration:
            cloud = self._objects.clouds[self._index[number]]
            self._registration[number] = GlobalRegistration(*cloud, self.diameter_m(number), self._settings)
        return self._registration[number].register(row["points_m"], seed_of(*axes))

    def diameter_m(self, number: int) -> float:
        return float(self._objects.diameters_m[self._index[number]])
