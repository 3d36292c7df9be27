"""Instances: objects in single depth frames with their poses, how they are read from datasets, and further starts."""

import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from gpca.errors import InputError
from gpca.frames import initial_pose
from gpca.frames.bop import Annotation, Frame, TooFewPoints, measured_points, without_background
from gpca.frames.dataset import CenteredModel, Dataset
from gpca.frames.shots import Sighting
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import FLAG, FLOAT, Container, array
from gpca.objects import canonical
from gpca.objects.bop import find_symmetries
from gpca.objects.canonical import DRAWN, ObjectClouds, unseen
from gpca.pairs.perturbation import misplacement
from gpca.process.progress import progress
from gpca.rigid import inverse, scale_translation, transform
from gpca.seeds import generator, seed_of

NO_COLOR = "none"
# Median distance of measured points from the model, in diameters. Of 223 annotated objects of five datasets the worst
# is at 0.034; turned at random, the worst is at 0.298. Objects that are farther away do not fit their poses.
FARTHEST = 0.3
JUDGED_POINTS = 200  # of each object, enough for a median
# Limit for the median object of a dataset: in diameters, or in meters where that is more, since sensor noise does not
# shrink with the object. Of five datasets the worst is at 0.56 of this limit; with all poses 30 mm off or every R the
# identity, the best is at 1.5.
FAR, FAR_M = 0.03, 0.004
REMEDY = (
    "check cam_R_m2c and cam_t_m2c (from model to camera, row by row, millimeters, y down and z forward), cam_K, "
    "depth_scale, masks, and that the models are those that the poses were made for"
)


@dataclass(frozen=True)
class Instances(Container):
    """I objects in frames. The object frame is that of the canonical cloud, centered on its bounding box."""

    dataset: np.ndarray = array("I", TEXT)
    scene: np.ndarray = array("I", WHOLE)
    image: np.ndarray = array("I", WHOLE)
    object_index: np.ndarray = array("I", WHOLE)  # in the objects npz beside this file
    symmetric: np.ndarray = array("I", FLAG)  # a rotation leaves its shape as it is
    T_camera_object_true: np.ndarray = array("I 4 4", FLOAT)  # meters
    T_camera_object_init: np.ndarray = array("I 4 4", FLOAT)
    init_from: np.ndarray = array("I", TEXT)  # an estimator, ``errors`` of estimators, or another form
    camera_3_3: np.ndarray = array("I 3 3", FLOAT)  # in pixels
    colour: np.ndarray = array("I", TEXT)  # path of the color image, or `NO_COLOR`
    fold: np.ndarray = array("I", WHOLE)  # that its scene is tested with, `DRAWN` or `TRAINING`
    points_m: np.ndarray = array("P 3", FLOAT, offsets="offsets", fewest=3)  # measured, in the camera's frame, float32
    pixels: np.ndarray = array("P 2", WHOLE, offsets="offsets", fewest=3)  # where each was seen, (u, v), int32
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
    def cluster(self) -> np.ndarray:
        """(I,) the scene, whose frames show the same objects in the same poses."""
        return np.array([f"{dataset} {scene}" for dataset, scene in zip(self.dataset, self.scene, strict=True)])

    def split(self, source: str, seed: int, test_share: float) -> dict[str, np.ndarray]:
        """Return the rows of ``train`` and ``test``, by whole scenes: frames of one scene reveal each other."""
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


def spread(points_m: np.ndarray, most: int) -> np.ndarray:
    """Return about this many of the points, evenly spread over their order."""
    return points_m[:: max(1, len(points_m) // most)]


def median_distance(tree: cKDTree, T_camera_object: np.ndarray, points_m: np.ndarray) -> float:
    """Return the median distance, in meters, of measured points (P, 3) from the object's cloud at its pose."""
    return float(np.median(tree.query(transform(inverse(T_camera_object), points_m))[0]))


def require_near(subject: str, distance_m: float, diameter_m: float) -> None:
    """Raise an InputError where half of an object's points were measured far from its pose."""
    if distance_m > FARTHEST * diameter_m:
        lie = f"lie {1e3 * distance_m:.0f} mm or more from the model in the annotated pose"
        fault = f"half of its measured points {lie}, {distance_m / diameter_m:.2g} diameters"
        raise InputError(subject, fault, REMEDY)


def require_fitting(subject: str, distances_m: Sequence[float], diameters_m: Sequence[float]) -> None:
    """Raise an InputError where the median object of a dataset is off; single bad masks do not matter."""
    limits_m = np.maximum(FAR * np.array(diameters_m), FAR_M)
    if len(distances_m) and np.median(distances_m / limits_m) > 1:
        share = 100 * np.median(np.array(distances_m) / diameters_m)
        off = f"{1e3 * np.median(distances_m):.1f} mm ({share:.1f} % of the diameter, at the median)"
        limit = f"above the limit of {100 * FAR:g} % or {1e3 * FAR_M:g} mm, whichever is more"
        raise InputError(subject, f"their points lie {off} from the models in the annotated poses, {limit}", REMEDY)


def read_instances(
    datasets: Mapping[str, tuple[Dataset, list[Frame], dict[int, CenteredModel]]],
    objects: ObjectClouds,
    settings: initial_pose.InitialPoseSettings,
) -> Instances:
    """Return each object with enough measured points, by dataset: the dataset, its frames, its models by id."""
    if settings.form == "results" and not any(of.results or of.errors for of, _, _ in datasets.values()):
        raise InputError(f"dataset {next(iter(datasets))}", "has no results file", "set results or choose another pose")
    left_out: list[str] = []
    seen: list[_Seen] = []
    for dataset, frames, models in datasets.values():
        index = {number: objects.row(model.surface.name) for number, model in models.items()}
        trees = {number: cKDTree(objects.points(i)) for number, i in index.items()}
        symmetric = {number: bool(models[number].listed_symmetries) for number in index}
        for number, i in index.items():
            if models[number].listed_symmetries is None:
                symmetric[number] = bool(find_symmetries(objects.points(i), objects.diameters_m[i]))
        off: list[tuple[float, float]] = []  # distance and diameter of each object
        for frame in progress(frames, f"frames of {dataset.name}"):
            depth_m = frame.depth_m()
            for n, annotation in enumerate(frame.annotations):
                number, T_camera_model = annotation.object_id, annotation.T_camera_model
                T_model_object, diameter_m = models[number].T_model_object, float(objects.diameters_m[index[number]])
                at = trees[number], T_camera_model @ T_model_object
                try:
                    points_m, pixels = measured_points(frame, annotation, depth_m)
                    some_m = spread(points_m, JUDGED_POINTS)
                    require_near(annotation.subject, median_distance(*at, some_m), diameter_m)
                    points_m, pixels = without_background(points_m, pixels, annotation, diameter_m)
                except TooFewPoints as fault:
                    left_out.append(str(fault))
                    continue
                row: dict[str, Any] = {"dataset": dataset.name, "scene": frame.scene, "image": frame.image}
                row |= {"camera_3_3": frame.camera_3_3, "colour": str(frame.color or NO_COLOR)}
                row |= {"fold": dataset.fold(frame.scene), "object_index": index[number]}
                row |= {"symmetric": symmetric[number], "T_camera_object_true": at[1]}
                row |= {"points_m": points_m.astype(np.float32), "pixels": pixels.astype(np.int32)}
                seen.append(_Seen(frame, n, T_model_object, diameter_m, row))
                some_m = spread(row["points_m"], JUDGED_POINTS)
                off.append((median_distance(*at, some_m), diameter_m))
        if off:
            subject = f"{seen[-1].annotation.subject}, and the others of dataset {dataset.name}"
            require_fitting(subject, *zip(*off, strict=True))
    if not seen:
        reasons = f"; the first skipped: {left_out[0]}" if left_out else ""
        raise InputError(", ".join(datasets), f"no object is left in any frame{reasons}", "check masks and depth")
    # Last, since errors are measured against poses that fit the measurements.
    poses = _poses_from_results(datasets, seen) if settings.form == "results" else _poses(seen, objects, settings)
    for reason in left_out:
        print(f"skipped: {reason}", file=sys.stderr)
    columns = {name: np.array([of.row[name] for of in seen]) for name in seen[0].row if name not in PARTS}
    columns |= {name: np.concatenate([of.row[name] for of in seen]) for name in PARTS}
    columns["offsets"] = np.cumsum([0, *(len(of.row["points_m"]) for of in seen)], dtype=np.int64)
    columns["init_from"], columns["T_camera_object_init"] = map(np.array, zip(*poses, strict=True))
    return Instances(axes=None, **columns)


PARTS = {"points_m", "pixels"}


class _Seen(NamedTuple):
    """An object in a frame: its number among the annotations, and what is known but for its initial pose."""

    frame: Frame
    n: int
    T_model_object: np.ndarray
    diameter_m: float
    row: dict[str, Any]

    @property
    def annotation(self) -> Annotation:
        return self.frame.annotations[self.n]

    def random_axes(self, use: str) -> tuple:
        return self.row["dataset"], *self.frame.place, self.n, use


def _poses(
    seen: list[_Seen], objects: ObjectClouds, settings: initial_pose.InitialPoseSettings
) -> list[tuple[str, np.ndarray]]:
    poses: list[tuple[str, np.ndarray]] = []
    registration: dict[tuple[str, int], initial_pose.GlobalRegistration] = {}
    for of in progress(seen, "initial poses"):
        axes, row = of.random_axes("initial pose"), of.row
        if settings.form == "true_pose":
            T_init = initial_pose.displace(row["T_camera_object_true"], of.diameter_m, settings, generator(*axes))
        else:
            key = row["dataset"], of.annotation.object_id
            if key not in registration:
                registration[key] = initial_pose.GlobalRegistration(objects, row["object_index"], settings)
            T_init = registration[key].register(row["points_m"], seed_of(*axes))
        poses.append((settings.form, T_init))
    return poses


def _poses_from_results(
    datasets: Mapping[str, tuple[Dataset, list[Frame], dict]], seen: list[_Seen]
) -> list[tuple[str, np.ndarray]]:
    """Return a random estimator that found each object, and its pose; else ``errors``, and the truth with an error."""
    objects = [(of.row["dataset"], of.annotation.object_id) for of in seen]
    errors = initial_pose.EstimatorErrors.read(
        {name: (dataset.errors, models) for name, (dataset, _, models) in datasets.items()},
        {key for key, of in zip(objects, seen, strict=True) if of.row["symmetric"]},
    )
    estimators = {name: dataset.estimators() for name, (dataset, _, _) in datasets.items()}
    estimates: list[tuple[str, np.ndarray] | None] = []
    for (name, number), of in zip(objects, seen, strict=True):
        alone = [each.object_id for each in of.frame.annotations].count(number) == 1
        random = generator(*of.random_axes("estimator"))
        shown = of.row | {"diameter_m": of.diameter_m}
        candidates = initial_pose.estimates_of(estimators[name], (*of.frame.place, number), alone, shown)
        estimates.append(candidates[int(random.integers(len(candidates)))] if candidates else None)
        if candidates:
            errors.add((name, number), inverse(of.annotation.T_camera_model) @ estimates[-1][1])  # type: ignore[index]
    poses = []
    for key, of, estimate in zip(objects, seen, estimates, strict=True):
        if estimate is None:
            T_error = errors.draw(key, generator(*of.random_axes("error")))
            estimate = "errors", of.annotation.T_camera_model @ T_error
        poses.append((estimate[0], estimate[1] @ of.T_model_object))
    return poses


# Starts: initial poses of the registrations of instances, by where the poses come from (docs/causes.md).
NATIVE, CARRIED, TRANSPLANTED, LADDER = KINDS = ("native", "carried", "transplanted", "ladder")
GLOBAL = "global_registration"  # runs on the very image, as estimators do


@dataclass(frozen=True)
class Starts(Container):
    """K starts by kind, then by instance; `init_from` is the estimator, ``errors`` of estimators, or the rung."""

    instance: np.ndarray = array("K", WHOLE)
    kind: np.ndarray = array("K", TEXT)
    init_from: np.ndarray = array("K", TEXT)
    T_camera_object_init: np.ndarray = array("K 4 4")


def all_starts(
    instances: Instances,
    objects: ObjectClouds,
    datasets: Mapping[str, Dataset],
    models: Mapping[str, Mapping[int, CenteredModel]],
    rungs: Sequence[tuple[float, float]],
) -> Starts:
    """Return every start of every instance, by kind; `rungs` are turns in degrees and shifts in diameters."""
    numbers = {
        (name, objects.row(model.surface.name)): (name, number)
        for name, by_id in models.items()
        for number, model in by_id.items()
    }
    object_I = [numbers[of] for of in zip(instances.dataset.tolist(), instances.object_index.tolist(), strict=True)]
    errors = initial_pose.EstimatorErrors.read(
        {name: (dataset.errors, models[name]) for name, dataset in datasets.items()},
        {key for key, symmetric in zip(object_I, instances.symmetric, strict=True) if symmetric},
    )
    estimators = {name: dataset.estimators() for name, dataset in datasets.items()}
    annotated = Counter(
        (name, *frame.place, annotation.object_id)
        for name, dataset in datasets.items()
        if estimators[name]
        for frame in dataset.frames()
        for annotation in frame.annotations
    )
    starts: list[tuple[int, str, str, np.ndarray]] = []
    for i, (name, number) in enumerate(object_I):
        place = (int(instances.scene[i]), int(instances.image[i]), number)
        seen = {
            "points_m": instances.cloud_m(i),
            "pixels": instances.pixels_of(i),
            "camera_3_3": instances.camera_3_3[i],
            "diameter_m": objects.diameters_m[instances.object_index[i]],
        }
        T_model_object = models[name][number].T_model_object
        kind = CARRIED if datasets[name].place(place[0]).estimates == canonical.CARRIED else NATIVE
        alone = annotated[name, *place] == 1
        for estimator, T_camera_model in initial_pose.estimates_of(estimators[name], place, alone, seen):
            starts.append((i, kind, estimator, T_camera_model @ T_model_object))
            T_camera_model_true = instances.T_camera_object_true[i] @ inverse(T_model_object)
            errors.add((name, number), inverse(T_camera_model_true) @ T_camera_model)
    without = sorted(set(range(len(instances))) - {start[0] for start in starts}) if errors.by_object else []
    for i in without:
        T_model_object = models[object_I[i][0]][object_I[i][1]].T_model_object
        T_error = errors.draw(object_I[i], generator(*_axes(instances, i), "error"))
        T_init = instances.T_camera_object_true[i] @ inverse(T_model_object) @ T_error @ T_model_object
        starts.append((i, TRANSPLANTED, "errors", T_init))
    by_features = np.flatnonzero(instances.init_from == GLOBAL)
    starts += [(int(i), NATIVE, GLOBAL, instances.T_camera_object_init[i]) for i in by_features]
    for rung, (turn_deg, shift) in enumerate(rungs):
        for i in range(len(instances)):
            T_error = misplacement(np.deg2rad(turn_deg), shift, generator(*_axes(instances, i), "rung", rung))
            diameter_m = float(objects.diameters_m[instances.object_index[i]])
            T_init = instances.T_camera_object_true[i] @ scale_translation(T_error, diameter_m)
            starts.append((i, LADDER, f"{turn_deg:g} deg, {shift:g} d", T_init))
    starts.sort(key=lambda start: (KINDS.index(start[1]), start[0]))
    instance_K, kind_K, from_K, T_K = (np.array([start[part] for start in starts]) for part in range(4))
    return Starts(instance_K.astype(int), kind_K.astype(str), from_K.astype(str), T_K.reshape(-1, 4, 4))


def _axes(instances: Instances, i: int) -> tuple:
    """Return the names of an instance's random numbers, independent of how many others there are."""
    u, v = instances.pixels_of(i)[0].tolist()  # several of one object may be in an image
    return str(instances.dataset[i]), int(instances.scene[i]), int(instances.image[i]), u, v
