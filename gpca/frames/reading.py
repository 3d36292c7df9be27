"""From frames of BOP datasets to instances: models centred, masks back-projected, initial poses found."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gpca.alignment.rigid import inverse, transform
from gpca.errors import InputError
from gpca.frames.bop import Frame, TooFewPoints, read_frames, visible_points
from gpca.frames.initial_pose import GlobalRegistration, InitialPoseSettings, displace, nearest_to, read_bop_results
from gpca.frames.instances import Instances, groups_of_frames
from gpca.objects import bop
from gpca.objects.canonical import ObjectClouds, bounding_centre
from gpca.objects.surface import Surface
from gpca.objects.symmetry import find_symmetries, read_symmetries
from gpca.progress import progress
from gpca.seeds import generator, seed_of


@dataclass(frozen=True)
class Dataset:
    """A BOP dataset on disk.

    Attributes:
        name: seeds its draws and names its objects.
        folders: the dataset's, or those that its archives were unpacked in.
        unit: the unit of the models' vertices.
        split: the split whose frames are read.
        results: a BOP results file with initial poses, or None.
        most_frames: where there are more frames, so many are drawn.
    """

    name: str
    folders: tuple[Path, ...]
    unit: str = "mm"
    split: str = "test"
    results: Path | None = None
    most_frames: int = 200

    def frames(self) -> list[Frame]:
        """Return its frames, or a draw of them."""
        found = read_frames(self.folders, self.split)
        if len(found) <= self.most_frames:
            return found
        rows = generator(self.name, "frames").choice(len(found), self.most_frames, replace=False)
        return [found[row] for row in np.sort(rows)]

    def models_folder(self) -> Path:
        """Return the folder of its models."""
        for folder in self.folders:
            try:
                return bop.models_folder(folder)
            except InputError:
                continue
        raise InputError(", ".join(map(str, self.folders)), "holds no models/obj_*.ply", "fetch the models too")


@dataclass(frozen=True)
class CentredModel:
    """An object of a dataset, its surface moved so that the bounding box is centred, and by how much."""

    surface: Surface
    T_model_object: np.ndarray
    listed_symmetries: dict | None


def read_models(dataset: Dataset, frames: Iterable[Frame]) -> dict[int, CentredModel]:
    """Return the models of the objects that the frames show, by id.

    Raises:
        InputError: an object id without a model, and what :func:`gpca.objects.bop.surfaces` refuses.
    """
    ids = sorted({annotation.object_id for frame in frames for annotation in frame.annotations})
    folder = dataset.models_folder()
    if unknown := [number for number in ids if not (folder / f"obj_{number:06d}.ply").is_file()]:
        raise InputError(
            f"{dataset.name}: object {unknown[0]}", f"there is no model of it in {folder}", "fetch the models anew"
        )
    info = bop.read_models_info(folder / "models_info.json")
    models = {}
    for number, surface in zip(ids, bop.surfaces(folder, dataset.unit, ids), strict=True):
        T_model_object = np.eye(4)
        T_model_object[:3, 3] = bounding_centre(surface)
        name = f"{dataset.name} {info[number].get('name', surface.name)}"
        centred = Surface(name, surface.vertices_m - T_model_object[:3, 3], surface.faces)
        models[number] = CentredModel(centred, T_model_object, read_symmetries(info, number))
    return models


def read_instances(
    datasets: Mapping[str, tuple[Dataset, list[Frame], dict[int, CentredModel]]],
    objects: ObjectClouds,
    settings: InitialPoseSettings,
    gap: int,
) -> Instances:
    """Return every object of the frames of which enough was measured, with its true and its initial pose.

    An object with too few points, or without an estimate among the results, is left out and named on stderr.

    Args:
        datasets: name -> dataset, its frames, the models of their objects.
        objects: the canonical clouds of all these models, by their surfaces' names.
        settings: how initial poses are found.
        gap: images of a scene that follow each other within it are one group.

    Raises:
        InputError: what the files hold is faulty, or nothing is left.
    """
    rows: list[dict] = []
    first_group = 0
    for dataset, frames, models in datasets.values():
        places = np.array([(frame.scene, frame.image) for frame in frames])
        scene_F, image_F = places.T
        groups_F = first_group + groups_of_frames(scene_F, image_F, gap)
        first_group = groups_F.max() + 1
        estimates = _estimates(dataset, places) if settings.form == "results" else {}
        found = _Objects(dataset.name, objects, models, settings)
        for frame, group in progress(list(zip(frames, groups_F, strict=True)), f"frames of {dataset.name}"):
            shown = {"dataset": dataset.name, "scene": frame.scene, "image": frame.image, "group": group}
            shown |= {"camera_3_3": frame.camera_3_3, "colour": str(frame.colour)}
            rows += [shown | row for row in found.in_frame(frame, estimates)]
    if not rows:
        raise InputError(", ".join(datasets), "no object of any frame is left", "check masks, depth and results")
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0] if name not in ("points_m", "pixels")}
    ragged = {name: np.concatenate([row[name] for row in rows]) for name in ("points_m", "pixels")}
    offsets = np.cumsum([0, *(len(row["points_m"]) for row in rows)], dtype=np.int64)
    return Instances(**columns, **ragged, offsets=offsets)


class _Objects:
    """The objects of one dataset, ready to be found in frames."""

    def __init__(
        self, name: str, objects: ObjectClouds, models: dict[int, CentredModel], settings: InitialPoseSettings
    ):
        self._name = name
        self._objects = objects
        self._models = models
        self._settings = settings
        self._index = {number: objects.names.index(model.surface.name) for number, model in models.items()}
        self._symmetric = {number: self._is_symmetric(number) for number in models}
        self._registration: dict[int, GlobalRegistration] = {}

    def in_frame(self, frame: Frame, estimates: Mapping) -> list[dict]:
        depth_m = frame.depth_m()
        rows = []
        for n, annotation in enumerate(frame.annotations):
            number = annotation.object_id
            diameter_m = float(self._objects.diameters_m[self._index[number]])
            try:
                points_m, pixels = visible_points(frame, annotation, depth_m, diameter_m)
            except TooFewPoints as fault:
                print(f"left out: {fault}", file=sys.stderr)
                continue
            T_true = annotation.T_camera_model @ self._models[number].T_model_object
            seen = {"T_camera_object_true": T_true, "points_m": points_m.astype(np.float32), "pixels": pixels}
            seen |= {"object_index": self._index[number], "symmetric": self._symmetric[number]}
            poses = [T @ self._models[number].T_model_object for T in estimates.get((*_place(frame), number), [])]
            if self._settings.form == "results" and not poses:
                print(f"left out: {frame.colour}: the results hold no pose of object {number}", file=sys.stderr)
                continue
            axes = (self._name, frame.scene, frame.image, n, "initial pose")
            T_init = nearest_to(poses, pixels, frame.camera_3_3) if poses else self._found(number, seen, axes)
            rows.append({**seen, "pixels": pixels.astype(np.int32), "T_camera_object_init": T_init})
        return rows

    def _found(self, number: int, seen: dict, axes: tuple) -> np.ndarray:
        i = self._index[number]
        diameter_m = float(self._objects.diameters_m[i])
        if self._settings.form == "true_pose":
            return displace(seen["T_camera_object_true"], diameter_m, self._settings, generator(*axes))
        if number not in self._registration:
            points_m, normals = self._objects.points(i), self._objects.normals(i)
            self._registration[number] = GlobalRegistration(points_m, normals, diameter_m, self._settings)
        return self._registration[number].register(seen["points_m"], seed_of(*axes))

    def _is_symmetric(self, number: int) -> bool:
        listed = self._models[number].listed_symmetries
        i = self._index[number]
        return bool(
            find_symmetries(self._objects.points(i)[:4096], self._objects.diameters_m[i]) if listed is None else listed
        )


def _place(frame: Frame) -> tuple[int, int]:
    return frame.scene, frame.image


def _estimates(dataset: Dataset, places: np.ndarray) -> Mapping:
    if dataset.results is None:
        raise InputError(f"dataset {dataset.name}", "has no results file", "set results, or another initial pose")
    # Against all images, not only the drawn ones: a results file covers the whole dataset.
    images = {_place(frame) for frame in read_frames(dataset.folders, dataset.split)}
    return read_bop_results(dataset.results, images | {tuple(place) for place in places.tolist()})


def points_on_model(instances: Instances, objects: ObjectClouds) -> np.ndarray:
    """Return the median distance (I,) in metres from each instance's points to its model under the true pose."""
    from scipy.spatial import cKDTree

    trees = {index: cKDTree(objects.points(index)) for index in np.unique(instances.object_index)}
    medians = []
    for i, index in enumerate(instances.object_index):
        points_m = transform(inverse(instances.T_camera_object_true[i]), instances.cloud_m(i))
        medians.append(np.median(trees[index].query(points_m)[0]))
    return np.array(medians)
