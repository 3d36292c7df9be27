"""From frames of BOP datasets to instances: models centered, masks back-projected, initial poses found."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from gpca.errors import InputError
from gpca.frames.bop import Frame, TooFewPoints, measured_points, without_background
from gpca.frames.dataset import Dataset
from gpca.frames.estimates import (
    EstimatorErrors,
    error_of,
    estimates_of,
    read_pose_errors,
)
from gpca.frames.initial_pose import GlobalRegistration, InitialPoseSettings, displace
from gpca.frames.instances import NO_COLOR, Instances
from gpca.frames.plausibility import Observation, require_plausible, require_shared_form
from gpca.objects import bop
from gpca.objects.bop import find_symmetries, read_symmetries
from gpca.objects.canonical import ObjectClouds, bounding_center
from gpca.objects.surface import Surface
from gpca.process.progress import progress
from gpca.seeds import generator, seed_of


@dataclass(frozen=True)
class CenteredModel:
    """An object of a dataset, its surface moved so that the bounding box is centered, and by how much."""

    surface: Surface
    T_model_object: np.ndarray
    listed_symmetries: dict | None


def read_models(dataset: Dataset, frames: Iterable[Frame]) -> dict[int, CenteredModel]:
    """Return the models of the objects that the frames show, by id.

    Raises:
        InputError: an object id without a model, and what :func:`gpca.objects.bop.surfaces` refuses.
    """
    ids = sorted({annotation.object_id for frame in frames for annotation in frame.annotations})
    if not ids:
        raise InputError(
            dataset.name, "its scene_gt.json files list no object in any frame", "check split, or fetch it again"
        )
    return models_of_ids(dataset, ids)


def models_of_ids(dataset: Dataset, ids: Iterable[int] | None = None) -> dict[int, CenteredModel]:
    """Return the models of these objects of a dataset by id, of all that it lists where none are named.

    Raises:
        InputError: as :func:`read_models`.
    """
    folder = dataset.models_folder()
    info = bop.read_models_info(folder / "models_info.json")
    ids = sorted(info if ids is None else ids)
    if unknown := [number for number in ids if not (folder / f"obj_{number:06d}.ply").is_file()]:
        raise InputError(f"{dataset.name}: object {unknown[0]}", f"has no model in {folder}", "fetch the models again")
    models = {}
    for number, surface in zip(ids, bop.surfaces(folder, dataset.unit, ids), strict=True):
        T_model_object = np.eye(4)
        T_model_object[:3, 3] = bounding_center(surface)
        name = f"{dataset.name} {info[number].get('name', surface.name)}"
        centered = Surface(name, surface.vertices_m - T_model_object[:3, 3], surface.faces)
        models[number] = CenteredModel(centered, T_model_object, read_symmetries(info, number))
    return models


def with_shared_models(models_of: Mapping[str, dict[int, CenteredModel]]) -> dict[str, dict[int, CenteredModel]]:
    """Return the models of all datasets, where one that an earlier dataset has too bears the name that it has there.

    LINEMOD-Occlusion shows objects of LINEMOD: an object that training saw in one is not unseen in the other.
    """
    first: dict[bytes, str] = {}
    shared: dict[str, dict[int, CenteredModel]] = {}
    for name, models in models_of.items():
        shared[name] = {}
        for number, model in models.items():
            known = first.setdefault(shape_of(model), model.surface.name)
            shared[name][number] = replace(model, surface=replace(model.surface, name=known))
    return shared


def distinct_surfaces(models_of: Mapping[str, dict[int, CenteredModel]]) -> list[Surface]:
    """Return the surfaces of all datasets' models, those that datasets share once."""
    models = [model for of_dataset in models_of.values() for model in of_dataset.values()]
    return list({(model.surface.name, shape_of(model)): model.surface for model in models}.values())


def shape_of(model: CenteredModel) -> bytes:
    """Return what tells whether two models are the same."""
    return np.asarray(model.surface.vertices_m).tobytes()


def read_instances(
    datasets: Mapping[str, tuple[Dataset, list[Frame], dict[int, CenteredModel]]],
    objects: ObjectClouds,
    settings: InitialPoseSettings,
) -> Instances:
    """Return every object of the frames of which enough was measured, with its true and its initial pose.

    An object with too few points is left out and named on stderr.

    Args:
        datasets: name -> dataset, its frames, the models of their objects.
        objects: the canonical clouds of all these models, by their surfaces' names.
        settings: how initial poses are found.

    Raises:
        InputError: the files are faulty, an object was measured elsewhere than its pose says, or nothing is left.
    """
    if settings.form == "results" and not any(of.results or of.errors for of, _, _ in datasets.values()):
        raise InputError(f"dataset {next(iter(datasets))}", "has no results file", "set results or choose another pose")
    left_out: list[str] = []
    seen: list[tuple[_Objects, Frame, int, dict]] = []
    for dataset, frames, models in datasets.values():
        catalog = _Objects(dataset, objects, models, settings)
        of_dataset: list[tuple[_Objects, Frame, int, dict]] = []
        for frame in progress(frames, f"frames of {dataset.name}"):
            shown = {"dataset": dataset.name, "scene": frame.scene, "image": frame.image}
            shown |= {"camera_3_3": frame.camera_3_3, "colour": str(frame.color or NO_COLOR)}
            shown["fold"] = dataset.fold(frame.scene)
            of_dataset += [(catalog, frame, n, shown | row) for n, row in catalog.in_frame(frame, left_out)]
        observations = [catalog.observation(frame, n, row["points_m"]) for _, frame, n, row in of_dataset]
        require_shared_form(dataset.name, observations)
        seen += of_dataset
    if not seen:
        reasons = f"; the first skipped: {left_out[0]}" if left_out else ""
        raise InputError(", ".join(datasets), f"no object is left in any frame{reasons}", "check masks and depth")
    # Results last: they are measured against poses that fit what was seen.
    find = _from_results(datasets, seen) if settings.form == "results" else None
    rows = []
    for own, frame, n, row in progress(seen, "initial poses"):
        init_from, T_init = find(own, frame, n, row) if find else (settings.form, own.initial_pose(frame, n, row))
        rows.append(row | {"T_camera_object_init": T_init, "init_from": init_from})
    for fault in left_out:
        print(f"skipped: {fault}", file=sys.stderr)
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0] if name not in ("points_m", "pixels")}
    ragged = {name: np.concatenate([row[name] for row in rows]) for name in ("points_m", "pixels")}
    offsets = np.cumsum([0, *(len(row["points_m"]) for row in rows)], dtype=np.int64)
    return Instances(**columns, **ragged, offsets=offsets)


def _from_results(datasets: Mapping[str, tuple[Dataset, list[Frame], dict]], seen: list) -> Any:
    """Return a function to initial poses: an estimator's if one found the object, else the truth with an error."""
    estimators = {name: dataset.estimators() for name, (dataset, _, _) in datasets.items()}
    estimates: dict[int, tuple[str, np.ndarray]] = {}
    symmetric = {(catalog.name, number) for catalog, _, _, _ in seen for number in catalog.symmetric_ids()}
    errors = EstimatorErrors(symmetric)
    for name, (dataset, _, models) in datasets.items():
        for number, T_error in read_pose_errors(dataset.errors, models) if dataset.errors else ():
            errors.add((name, number), T_error)
    for place, (catalog, frame, n, row) in enumerate(seen):
        annotation = frame.annotations[n]
        number = annotation.object_id
        alone = Counter(of.object_id for of in frame.annotations)[number] == 1
        random = generator(catalog.name, *frame.place, n, "estimator")
        shown = row | {"diameter_m": catalog.diameter_m(number)}
        if candidates := estimates_of(estimators[catalog.name], (*frame.place, number), alone, shown):
            chosen = candidates[int(random.integers(len(candidates)))]
            estimates[place] = chosen
            errors.add((catalog.name, number), error_of(annotation.T_camera_model, chosen[1]))
    places = {(catalog.name, *frame.place, n): place for place, (catalog, frame, n, _) in enumerate(seen)}

    def find(catalog: _Objects, frame: Frame, n: int, row: dict) -> tuple[str, np.ndarray]:
        number = frame.annotations[n].object_id
        axes = (catalog.name, *frame.place, n)
        if chosen := estimates.get(places[axes]):
            return chosen[0], chosen[1] @ catalog.T_model_object(number)
        T_error = errors.draw((catalog.name, number), generator(*axes, "error"))
        return "errors", frame.annotations[n].T_camera_model @ T_error @ catalog.T_model_object(number)

    return find


class _Objects:
    """The objects of one dataset, ready to be found in frames."""

    def __init__(
        self, dataset: Dataset, objects: ObjectClouds, models: dict[int, CenteredModel], settings: InitialPoseSettings
    ):
        self.name = dataset.name
        self._objects = objects
        self._models = models
        self._settings = settings
        self._index = {number: objects.names.index(model.surface.name) for number, model in models.items()}
        self._symmetric = {number: self._is_symmetric(number) for number in models}
        self._trees = {number: cKDTree(objects.points(index)) for number, index in self._index.items()}
        self._registration: dict[int, GlobalRegistration] = {}

    def in_frame(self, frame: Frame, left_out: list[str]) -> list[tuple[int, dict]]:
        """Return the objects that were measured, by their place among the annotations."""
        depth_m = frame.depth_m()
        rows = []
        for n, annotation in enumerate(frame.annotations):
            number = annotation.object_id
            try:
                points_m, pixels = measured_points(frame, annotation, depth_m)
                require_plausible(self.observation(frame, n, points_m))
                points_m, pixels = without_background(points_m, pixels, annotation, self.diameter_m(number))
            except TooFewPoints as fault:
                left_out.append(str(fault))
                continue
            T_true = annotation.T_camera_model @ self._models[number].T_model_object
            seen: dict[str, Any] = {"object_index": self._index[number], "symmetric": self._symmetric[number]}
            seen |= {"T_camera_object_true": T_true, "points_m": points_m.astype(np.float32)}
            rows.append((n, {**seen, "pixels": pixels.astype(np.int32)}))
        return rows

    def observation(self, frame: Frame, n: int, points_m: np.ndarray) -> Observation:
        """Return the observation of an annotated object, to be judged."""
        annotation = frame.annotations[n]
        number = annotation.object_id
        T_model_object, tree = self._models[number].T_model_object, self._trees[number]
        return Observation(
            annotation.subject, annotation.T_camera_model, T_model_object, tree, self.diameter_m(number), points_m
        )

    def T_model_object(self, number: int) -> np.ndarray:
        """Return where the centered object lies in the frame of its model."""
        return self._models[number].T_model_object

    def symmetric_ids(self) -> list[int]:
        """Return the ids of the objects that a rotation leaves as they are."""
        return [number for number, symmetric in self._symmetric.items() if symmetric]

    def initial_pose(self, frame: Frame, n: int, row: dict) -> np.ndarray:
        """Return ``T_camera_object`` that ICP starts from where no estimator is asked."""
        number = frame.annotations[n].object_id
        axes = (self.name, frame.scene, frame.image, n, "initial pose")
        if self._settings.form == "true_pose":
            return displace(row["T_camera_object_true"], self.diameter_m(number), self._settings, generator(*axes))
        if number not in self._registration:
            i = self._index[number]
            points_m, normals = self._objects.points(i), self._objects.normals(i)
            self._registration[number] = GlobalRegistration(points_m, normals, self.diameter_m(number), self._settings)
        return self._registration[number].register(row["points_m"], seed_of(*axes))

    def diameter_m(self, number: int) -> float:
        """Return an object's diameter in meters."""
        return float(self._objects.diameters_m[self._index[number]])

    def _is_symmetric(self, number: int) -> bool:
        listed = self._models[number].listed_symmetries
        i = self._index[number]
        return bool(
            find_symmetries(self._objects.points(i), self._objects.diameters_m[i]) if listed is None else listed
        )
