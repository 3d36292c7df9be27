"""Starts: initial poses of the registrations of instances, by where the poses come from (docs/causes.md)."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gpca.frames.dataset import CenteredModel, Dataset
from gpca.frames.initial_pose import EstimatorErrors, estimates_of
from gpca.frames.instances import Instances
from gpca.io.arrays import TEXT, WHOLE
from gpca.io.container import Container, array
from gpca.objects import canonical
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import misplacement
from gpca.rigid import inverse, scale_translation
from gpca.seeds import generator

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
    errors = EstimatorErrors.read(
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
        for estimator, T_camera_model in estimates_of(estimators[name], place, annotated[name, *place] == 1, seen):
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
