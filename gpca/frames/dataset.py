"""Datasets of depth frames: their frames, the models of their objects, and the meshes to render."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.frames.bop import Frame, read_frames
from gpca.frames.initial_pose import PosesByObject, read_bop_results
from gpca.frames.source import frame_files, patterns, resolve_datasets
from gpca.objects import bop
from gpca.objects.camera import MeshScene
from gpca.objects.canonical import DRAWN, EVALUATION, TRAINING, ObjectClouds, Place, bounding_center, read_scene_splits
from gpca.objects.source import folders
from gpca.objects.surface import Surface
from gpca.process.environment import require_open3d
from gpca.rigid import rigid_motion
from gpca.seeds import generator


@dataclass(frozen=True)
class Dataset:
    """A BOP dataset on disk."""

    name: str  # seeds the draw of frames and prefixes the names of objects
    folders: tuple[Path, ...]  # its own, or those that its archives were unpacked in
    unit: str = "mm"  # of the models' vertices
    split: str = "test"
    results: tuple[Path, ...] = ()  # BOP results files with initial poses, one of each estimator
    errors: Path | None = None  # CSV of errors that estimators made elsewhere on its objects
    models: Path | None = None  # the folder of its models where that is not its own
    most_frames: int | None = 200  # of more frames, this many are drawn; None reads all
    places: Mapping[int, Place] = field(default_factory=dict)  # of its scenes, by number; none where no file says so
    role: str = EVALUATION  # of the frames: other than for evaluation, only scenes of this role are read

    def frames(self) -> list[Frame]:
        """Return its frames, or a draw of them; InputError for a scene that the splits lack."""
        frames = read_frames(self.folders, self.split)
        if self.places:
            if unknown := [frame.scene for frame in frames if frame.scene not in self.places]:
                remedy = "add it to the file of scenes, or set splits.scenes: null"
                raise InputError(f"dataset {self.name}", f"scene {unknown[0]} is in no split", remedy)
            frames = [frame for frame in frames if self.role in (EVALUATION, self.places[frame.scene].role)]
        if self.most_frames is None or len(frames) <= self.most_frames:
            return frames
        rows = generator(self.name, "frames").choice(len(frames), self.most_frames, replace=False)
        return [frames[row] for row in np.sort(rows)]

    def place(self, scene: int) -> Place:
        """Return the place of a scene; by default it has the role of the frames and annotated poses."""
        return self.places.get(scene, Place(f"{self.name} {scene}", self.role, DRAWN))

    def fold(self, scene: int) -> int:
        """Return the fold that a scene is tested with, `DRAWN` by default, `TRAINING` if it is never tested."""
        place = self.place(scene)
        return place.fold if place.role == self.role else TRAINING

    def estimators(self) -> dict[str, PosesByObject]:
        """Return the poses of each of its results files, by the name of the file."""
        if not self.results:
            return {}
        # Against all images, not only the drawn ones: a results file covers the whole dataset.
        distances_m = {
            frame.place: [float(np.linalg.norm(annotation.T_camera_model[:3, 3])) for annotation in frame.annotations]
            for frame in read_frames(self.folders, self.split)
        }
        ids = bop.read_models_info(self.models_folder() / "models_info.json").keys()
        return {path.stem: read_bop_results(path, distances_m, ids) for path in self.results}

    def models_folder(self) -> Path:
        """Return the folder of its models."""
        for folder in (self.models,) if self.models else self.folders:
            try:
                return bop.models_folder(folder)
            except InputError:
                continue
        raise InputError(", ".join(map(str, self.folders)), "has no models/obj_*.ply", "download the models too")


@dataclass(frozen=True)
class CenteredModel:
    """An object with its bounding box moved to the origin, and its pose in the frame of its model."""

    surface: Surface
    T_model_object: np.ndarray
    listed_symmetries: dict | None

    @property
    def shape(self) -> bytes:
        """A key that is the same for models of the same shape."""
        return np.asarray(self.surface.vertices_m).tobytes()


def read_models(dataset: Dataset, frames: Iterable[Frame] | None = None) -> dict[int, CenteredModel]:
    """Return the models of the objects in the frames, or of all, by id; InputError for a missing or faulty one."""
    folder = dataset.models_folder()
    info = bop.read_models_info(folder / "models_info.json")
    shown = {annotation.object_id for frame in frames or () for annotation in frame.annotations}
    if not (ids := sorted(info if frames is None else shown)):
        fault = "its scene_gt.json files list no object in any frame"
        raise InputError(dataset.name, fault, "check split, or fetch it again")
    if unknown := [number for number in ids if not (folder / f"obj_{number:06d}.ply").is_file()]:
        raise InputError(f"{dataset.name}: object {unknown[0]}", f"has no model in {folder}", "fetch the models again")
    models = {}
    for number, surface in zip(ids, bop.read_models(folder, dataset.unit, ids, info), strict=True):
        T_model_object = rigid_motion(np.eye(3), bounding_center(surface))
        name = f"{dataset.name} {info[number].get('name', surface.name)}"
        centered = Surface(name, surface.vertices_m - T_model_object[:3, 3], surface.faces)
        models[number] = CenteredModel(centered, T_model_object, bop.read_symmetries(info, number))
    return models


def with_shared_models(models_of: Mapping[str, dict[int, CenteredModel]]) -> dict[str, dict[int, CenteredModel]]:
    """Return all models, each named as in the first dataset with its shape: LINEMOD-Occlusion shows LINEMOD's."""
    first: dict[bytes, str] = {}

    def named_as_first(model: CenteredModel) -> CenteredModel:
        return replace(model, surface=replace(model.surface, name=first.setdefault(model.shape, model.surface.name)))

    return {name: {n: named_as_first(model) for n, model in models.items()} for name, models in models_of.items()}


def distinct_surfaces(models_of: Mapping[str, dict[int, CenteredModel]]) -> list[Surface]:
    """Return the surfaces of all datasets' models, shared ones once."""
    models = [model for by_id in models_of.values() for model in by_id.values()]
    return list({(model.surface.name, model.shape): model.surface for model in models}.values())


MOST_FACES = 2000  # of a mesh; what decimation moves is far below the noise of depth


def datasets_of(
    datasets: Mapping[str, dict] | None,
    data_dir: str | None,
    downloads: Path,
    scenes: Path | None,
    splits: Path | None = None,
    role: str = EVALUATION,
) -> dict[str, Dataset]:
    """Return the config's datasets by name, or the rendered `scenes` in their place, of which all frames are read."""
    if scenes:
        return {"scenes": Dataset("scenes", (scenes,), most_frames=None)}
    entries = resolve_datasets(datasets, data_dir)
    if not entries:
        raise InputError("real_world.datasets", "is empty", "name a dataset, or the folder of the step scenes")
    read = {}
    for name, entry in entries.items():
        options = {key: entry[key] for key in ("unit", "split", "most_frames") if key in entry}
        options |= {key: Path(entry[key]) if entry.get(key) else None for key in ("models", "errors")}
        options |= {"places": read_scene_splits(splits, name) if splits else {}, "role": role}
        read[name] = Dataset(
            name, tuple(folders(entry, downloads)), results=tuple(map(Path, entry["results"])), **options
        )
    return read


def models_of(datasets: Mapping[str, Dataset]) -> dict[str, dict[int, CenteredModel]]:
    """Return the models of the objects in the frames of each dataset, shared ones under one name."""
    return with_shared_models({name: read_models(dataset, dataset.frames()) for name, dataset in datasets.items()})


def untested_surfaces(datasets: Mapping[str, Dataset]) -> list[Surface]:
    """Return the models, shared ones once, of objects that no frame of a test fold shows."""
    models = with_shared_models({name: read_models(dataset) for name, dataset in datasets.items()})
    tested = {
        models[name][annotation.object_id].shape
        for name, dataset in datasets.items()
        for frame in dataset.frames()
        for annotation in frame.annotations
        if dataset.fold(frame.scene) != TRAINING and annotation.object_id in models[name]
    }
    untested = {
        name: {number: model for number, model in by_id.items() if model.shape not in tested}
        for name, by_id in models.items()
    }
    return distinct_surfaces(untested)


def files_behind(datasets: Mapping[str, dict] | None, data_dir: str | None, scenes: Path | None) -> list[Path]:
    """Return the local files that :func:`datasets_of` reads, sorted."""
    if scenes:
        return sorted(path for pattern in patterns() for path in scenes.glob(pattern))
    return frame_files(datasets or {}, data_dir)


def meshes_of(
    models: Mapping[str, dict[int, CenteredModel]], objects: ObjectClouds, shown: Iterable[int]
) -> dict[int, MeshScene]:
    """Return the mesh of each object `shown`, in its frame, by its number in `objects`; InputError where one lacks."""
    surfaces = {surface.name: surface for surface in distinct_surfaces(models)}
    meshes = {}
    for index in sorted(set(shown)):
        name = objects.names[index]
        if name not in surfaces or surfaces[name].faces is None:
            fault, remedy = "has no mesh among the models", "regenerate the instances from this config"
            raise InputError(f"object '{name}'", fault, remedy)
        meshes[index] = MeshScene([(surfaces[name].vertices_m, surfaces[name].triangles)])
    return meshes


def simplified(surface: Surface, most_faces: int = MOST_FACES) -> Surface:
    """Return a mesh of at most this many faces, by quadric decimation (Garland and Heckbert 1997): scans have more."""
    if surface.faces is None:
        fault = "is a point cloud, but the virtual camera needs a mesh"
        raise InputError(f"object '{surface.name}'", fault, "name a source of meshes")
    if len(surface.faces) <= most_faces:
        return surface
    o3d = require_open3d()
    vertices, triangles = o3d.utility.Vector3dVector, o3d.utility.Vector3iVector
    mesh = o3d.geometry.TriangleMesh(vertices(surface.vertices_m), triangles(surface.faces.astype(np.int32)))
    mesh = mesh.simplify_quadric_decimation(most_faces)
    return Surface(surface.name, np.asarray(mesh.vertices), np.asarray(mesh.triangles).astype(np.int64))
