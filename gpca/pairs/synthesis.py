"""Registrations of one source and seed: clouds perturbed, aligned by ICP, labeled; and which cloud an encoder sees."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Annotated, Any, Literal, get_args

import numpy as np

from gpca.alignment.features import estimate_normals
from gpca.alignment.icp import ICP, ICPSettings
from gpca.errors import InputError
from gpca.io.files import SPLITS, Axes
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import REGISTRATION_COLUMNS, Registrations, ragged
from gpca.pairs.perturbation import CONCEPTS, PERTURBATIONS, SEVERITIES, Perturbed, Severities
from gpca.process.environment import require_open3d
from gpca.process.progress import progress
from gpca.rigid import inverse, scale_translation, transform
from gpca.seeds import generator
from gpca.settings import Bounds

TrainSamples = Annotated[int, Bounds(minimum=9)]
TestSamples = Annotated[int, Bounds(minimum=3)]


@dataclass(frozen=True)
class RegistrationSettings:
    """Numbers of registrations and how they are made (docs/protocol.md)."""

    train: TrainSamples = 800  # balanced over concepts and objects
    test: TestSamples = 200
    # Of source and of target; fewer where the object has fewer than twice as many.
    cloud_points: Annotated[int, Bounds(minimum=64, maximum=65536)] = 2048
    severities: Severities = field(default_factory=Severities)
    icp: ICPSettings = field(default_factory=ICPSettings)


def make_registrations(
    objects: ObjectClouds, source: str, seed: int, settings: RegistrationSettings
) -> tuple[Registrations, np.ndarray]:
    """Return the registrations of one source and seed, and the seconds (S,) of ICP.

    Samples 3t, 3t + 1 and 3t + 2 of a split show object t mod O under the three concepts in random order.
    """
    require_open3d()  # here, so that the first sample's seconds do not include its import
    samples = [(split, n) for split in SPLITS for n in range(getattr(settings, split))]
    records = []
    for split, n in progress(samples, f"registrations of {source}, seed {seed}"):
        deal, place = divmod(n, len(CONCEPTS))
        concept = generator(source, seed, "concepts", split, deal).permutation(CONCEPTS)[place]
        object_index = deal % len(objects)
        random = generator(source, seed, "registration", split, n)
        points = objects.points(object_index) / float(objects.diameters_m[object_index])
        n_points = min(settings.cloud_points, len(points) // 2)
        # The clouds share no point: its distance would be zero, which would reveal the concept.
        order = random.permutation(len(points))
        source_rows, target_rows = order[:n_points], order[n_points : 2 * n_points]
        perturbed = PERTURBATIONS[concept](points[source_rows], settings.severities, random)
        record = align_pair(perturbed, objects, object_index, target_rows, settings.icp)
        records.append(record | {"concept": concept, "sample": n, "split": split})
    return as_registrations(records, (source, seed))


def align_pair(
    perturbed: Perturbed, objects: ObjectClouds, object_index: int, target_rows: np.ndarray, icp_settings: ICPSettings
) -> dict:
    """Align a perturbed cloud to these rows of its object's canonical cloud; return the columns of its row."""
    diameter_m = float(objects.diameters_m[object_index])
    target = objects.points(object_index)[target_rows] / diameter_m
    started = perf_counter()
    icp = ICP(target, objects.normals_of(object_index)[target_rows], icp_settings)
    registration = icp.register(perturbed.points, np.eye(4))
    icp_seconds = perf_counter() - started
    return {
        "object_index": object_index,
        "object_name": str(objects.names[object_index]),
        "diameter_m": diameter_m,
        "cluster": objects.families[object_index],
        "fold": objects.folds[object_index],
        "cloud": transform(registration.T_target_source, perturbed.points).astype(np.float32),
        "target": target.astype(np.float32),
        "T_target_source_true": scale_translation(perturbed.T_target_source_true, diameter_m),
        "T_target_source_init": np.eye(4),
        "T_target_source_icp": scale_translation(registration.T_target_source, diameter_m),
        "icp_seconds": icp_seconds,
        "fitness": registration.fitness,
        "inlier_rmse": registration.inlier_rmse,
        **{f"severity_{name}": perturbed.severity.get(name, 0.0) for name in SEVERITIES},
    }


def as_registrations(records: list[dict], axes: Axes | None = None) -> tuple[Registrations, np.ndarray]:
    """Return rows of :func:`align_pair` as registrations with these axes, and the seconds (S,) of ICP."""
    columns: dict[str, Any] = {name: np.array([record[name] for record in records]) for name in REGISTRATION_COLUMNS}
    columns |= ragged([record["cloud"] for record in records], [record["target"] for record in records])
    return Registrations(**columns, axes=axes), np.array([record["icp_seconds"] for record in records])


Reading = Literal["aligned", "observed", "reversed"]
READINGS: tuple[str, ...] = get_args(Reading)


def read_as(reading: str, registrations: Registrations, icp: ICPSettings) -> Registrations:
    """Return the registrations with the clouds that the encoder sees, which the paper leaves open."""
    if reading == "aligned":
        return registrations
    if reading == "observed":
        rows = range(len(registrations))
        starts = [transform(registrations.T_target_source("init", row), registrations.source(row)) for row in rows]
        clouds = [start.astype(np.float32) for start in starts]
        seen: dict[str, Any] = ragged(clouds, [registrations.target(row) for row in rows])
        return replace(registrations, **seen, T_target_source_icp=registrations.T_target_source_init)
    if reading == "reversed":
        return registered_backwards(registrations, icp)
    raise InputError(f"reading '{reading}'", "unknown", f"choose one of {', '.join(READINGS)}")


def registered_backwards(registrations: Registrations, settings: ICPSettings) -> Registrations:
    """Return the pairs, with the observed cloud moved by the inverse of what ICP finds from the model to it."""
    clouds, targets, poses, fits = [], [], [], []
    for row in range(len(registrations)):
        observed, T_init = registrations.source(row), registrations.T_target_source("init", row)
        normals = None if settings.method == "point_to_point" else estimate_normals(observed)
        target = registrations.target(row).astype(np.float64)
        backwards = ICP(observed, normals, settings).register(target, inverse(T_init))
        T_target_source = inverse(backwards.T_target_source)  # ICP's target was the source
        clouds.append(transform(T_target_source, observed).astype(np.float32))
        targets.append(registrations.target(row))
        poses.append(scale_translation(T_target_source, float(registrations.diameter_m[row])))
        fits.append((backwards.fitness, backwards.inlier_rmse))
    fitness, inlier_rmse = np.array(fits).T
    changed: dict[str, Any] = {"T_target_source_icp": np.array(poses), "fitness": fitness, "inlier_rmse": inlier_rmse}
    return replace(registrations, **changed | ragged(clouds, targets), attached={})
