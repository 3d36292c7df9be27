"""The datasets that instances are read from, and the meshes of their objects, ready to be rendered."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from gpca.errors import InputError
from gpca.frames.camera import MeshScene
from gpca.frames.reading import (
    CenteredModel,
    Dataset,
    distinct_surfaces,
    models_of_ids,
    read_models,
    shape_of,
    with_shared_models,
)
from gpca.frames.source import frame_files, patterns, resolve_datasets
from gpca.objects.canonical import ObjectClouds
from gpca.objects.source import folders
from gpca.objects.splits import EVALUATION, TRAINING, read_scene_splits
from gpca.objects.surface import Surface
from gpca.process.environment import require_open3d

MOST_FACES = 2000  # of a mesh; what decimation moves is far below the noise of depth


def datasets_of(
    datasets: Mapping[str, dict] | None,
    data_dir: str | None,
    downloads: Path,
    scenes: Path | None,
    splits: Path | None = None,
    role: str = EVALUATION,
) -> dict[str, Dataset]:
    """Return the datasets of the config, by name, or the rendered scenes in their place, of which all frames are read.

    Args:
        splits, role: the file of scenes, and what the frames are for (:mod:`gpca.objects.splits`).

    Raises:
        InputError: neither is given, or what :func:`gpca.frames.source.resolve_datasets` refuses.
    """
    if scenes:
        return {"scenes": Dataset("scenes", (scenes,), most_frames=None)}
    entries = resolve_datasets(datasets, data_dir)
    if not entries:
        raise InputError("real_world.datasets", "is empty", "name a dataset, or the folder of the step scenes")
    return {
        name: Dataset(
            name,
            tuple(folders(entry, downloads)),
            places=read_scene_splits(splits, name) if splits else {},
            role=role,
            **_dataset_options(entry),
        )
        for name, entry in entries.items()
    }


def models_of(datasets: Mapping[str, Dataset]) -> dict[str, dict[int, CenteredModel]]:
    """Return the models of the objects that each dataset's frames show; those that datasets share bear one name."""
    return with_shared_models({name: read_models(dataset, dataset.frames()) for name, dataset in datasets.items()})


def untested_surfaces(datasets: Mapping[str, Dataset]) -> list[Surface]:
    """Return the models of the objects that no frame shows that may be tested, those that datasets share once."""
    models = with_shared_models({name: models_of_ids(dataset) for name, dataset in datasets.items()})
    tested = {
        shape_of(models[name][annotation.object_id])
        for name, dataset in datasets.items()
        for frame in dataset.frames()
        for annotation in frame.annotations
        if dataset.fold(frame.scene) != TRAINING and annotation.object_id in models[name]
    }
    untested = {
        name: {number: model for number, model in of_dataset.items() if shape_of(model) not in tested}
        for name, of_dataset in models.items()
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
    """Return each object's mesh alone, in the object's frame, by the number that it has among the objects.

    Args:
        models: of every dataset, as :func:`gpca.frames.reading.with_shared_models` returns them.
        objects: their canonical clouds.
        shown: numbers of the objects that are needed.

    Raises:
        InputError: an object without a mesh.
    """
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
    """Return a mesh of at most so many faces, by quadric decimation (Garland and Heckbert 1997): scans have more.

    Raises:
        InputError: a cloud of points.
    """
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


def _dataset_options(entry: dict) -> dict:
    options = {name: entry[name] for name in ("unit", "split", "most_frames") if name in entry}
    paths = {name: Path(entry[name]) if entry.get(name) else None for name in ("models", "errors")}
    return options | paths | {"results": tuple(map(Path, entry["results"]))}
