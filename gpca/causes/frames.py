"""Registrations of depth frames whose causes are measured: nothing about them was simulated.

An instance was seen by a real (or the virtual) sensor, behind whatever stood in front of it, and an estimator said
where it is. Mesh, pose and camera are known, so each of the three can be taken away:

- without noise: where the rays of the same pixels meet the mesh at the true pose;
- without missing surface: the whole side that the camera would see, with residuals like those measured where noise is;
- without pose error: started from the true pose.

The model that is registered is what the camera would see of it at the pose that ICP starts from, since a single view
never shows an object's back: the side that it hides by itself counts as no cause.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.alignment.rigid import inverse, rotation_angle_rad, scale_translation
from gpca.causes.candidate import Candidate
from gpca.causes.counterfactuals import Registrar, Unmeasurable
from gpca.causes.dataset import Causes
from gpca.causes.measuring import Measuring, as_causes
from gpca.causes.settings import FEWEST_POINTS, CauseSettings, FrameCauseSettings
from gpca.causes.shapley import ALL, NONE
from gpca.causes.subjects import Subject, measure_clean_pairs
from gpca.errors import InputError
from gpca.frames.camera import MeshScene
from gpca.frames.clean_view import clean_view, rendered_side
from gpca.frames.instances import Instances
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.perturbation import CONCEPTS, SEVERITIES
from gpca.process.progress import progress
from gpca.seeds import generator

if TYPE_CHECKING:
    import pandas as pd

OUTLINE_POINTS = 2048  # of an object, which tell where in the image it lies


def chosen_instances(instances: Instances, source: str, settings: FrameCauseSettings) -> np.ndarray:
    """Return the numbers of the instances that are measured, in order."""
    if settings.instances is None or settings.instances >= len(instances):
        return np.arange(len(instances))
    return np.sort(generator(source, "frame causes").permutation(len(instances))[: settings.instances])


def measure_frames(
    instances: Instances,
    rows: np.ndarray,
    objects: ObjectClouds,
    meshes: Mapping[int, MeshScene],
    source: str,
    seed: int,
    settings: CauseSettings,
    points: int,
) -> tuple[Causes, pd.DataFrame]:
    """Measure the causes of these instances.

    Instances that cannot be measured are left out and named on stderr.

    Args:
        meshes: of the objects that they show, see :func:`gpca.frames.meshes.meshes_of`.
        points: of what was measured, at most, and of the model.

    Returns:
        the registrations, all of them test samples with the number of their instance; a row for each of where it was
        seen and what was found.

    Raises:
        InputError: no instance can be measured.
    """
    subjects, limit = measure_clean_pairs(_subjects(instances, rows, objects), source, seed, settings)
    measuring, of_object = Measuring(settings, limit), {subject.index: subject for subject in subjects}
    records: list[dict[str, Any]] = []
    for i in progress(rows.tolist(), f"causes of {source}, seed {seed}"):
        axes = (source, seed, "frame causes", i)
        try:
            if (subject := of_object.get(int(instances.object_index[i]))) is None:
                raise Unmeasurable("its clean pairs are misaligned")
            candidate = frame_candidate(instances, i, subject, meshes[subject.index], points, generator(*axes))
            records.append(_measured(candidate, measuring, subject, axes) | {"sample": i, "split": "test"})
        except Unmeasurable as fault:
            print(f"causes of {source}: instance {i} is skipped: {fault}", file=sys.stderr)
    if not records:
        raise InputError(
            f"causes of {source}", "no instance in the frames can be measured", "check the meshes and poses"
        )
    causes, _ = as_causes(records, (source, seed))
    return causes, _table(instances, causes)


def frame_candidate(
    instances: Instances, i: int, subject: Subject, mesh: MeshScene, points: int, random: np.random.Generator
) -> Candidate:
    """Return an instance with everything that may be taken away from it, in diameters.

    Raises:
        Unmeasurable: no ray of its pixels meets the mesh, or the model cannot be seen at the initial pose.
    """
    diameter_m, camera_3_3 = subject.diameter_m, instances.camera_3_3[i]
    T_true, T_init = instances.T_camera_object_true[i], instances.T_camera_object_init[i]
    outline_m = subject.surface[:OUTLINE_POINTS] * diameter_m
    if (view := clean_view(instances, i, mesh, outline_m)) is None:
        raise Unmeasurable("its pixels show none of the mesh at the true pose")
    models = [_drawn(rendered_side(mesh, camera_3_3, T, outline_m), points, random) for T in (T_true, T_init)]
    if min(map(len, models)) < FEWEST_POINTS:
        raise Unmeasurable("its mesh is not visible at the pose that ICP starts from")
    kept = random.permutation(len(view.clean))[:points]
    hidden = _drawn(view.unmeasured, round(len(kept) * (1 - view.share) / max(view.share, 1e-9)), random)
    residuals = view.measured[kept] - view.clean[kept]
    T_model_observed = scale_translation(inverse(T_init) @ T_true, 1 / diameter_m)
    return Candidate(
        applied=np.ones(len(CONCEPTS), bool),
        model=models[1] / diameter_m,
        clean=np.concatenate([view.clean[kept], hidden]) / diameter_m,
        noisy=np.concatenate([view.measured[kept], hidden + residuals[random.integers(len(kept), size=len(hidden))]])
        / diameter_m,
        seen=np.arange(len(kept) + len(hidden)),
        kept=np.arange(len(kept)),
        T_near=np.eye(4),
        T_init=T_model_observed,
        severity={
            "noise": float(np.sqrt(np.square(residuals).sum(axis=1).mean() / 3)) / diameter_m,
            "outliers": 0.0,
            "rotation_rad": rotation_angle_rad(T_model_observed),
            "translation": float(np.linalg.norm(T_model_observed[:3, 3])),
            "crop": 1 - view.share,
        },
        model_at_truth=models[0] / diameter_m,
    )


def _drawn(points_N_3: np.ndarray, most: int, random: np.random.Generator) -> np.ndarray:
    return points_N_3[random.permutation(len(points_N_3))[:most]]


def _measured(candidate: Candidate, measuring: Measuring, subject: Subject, axes: tuple) -> dict[str, Any]:
    registrar = Registrar(candidate, measuring.settings)
    truths = [
        measuring.truth(measuring.counterfactuals(registrar, subject, axes, starts))
        for starts in ("starts", "other starts")
    ]
    observed = measuring.observed(registrar, subject, axes)
    return {**observed, "truth": truths[0], "again": truths[1], "candidate": axes[-1]}


def _subjects(instances: Instances, rows: np.ndarray, objects: ObjectClouds) -> list[Subject]:
    """Return the objects that the instances show; symmetric is what the dataset says is."""
    return [
        Subject.of(objects, index, bool(instances.symmetric[instances.object_index == index].any()))
        for index in np.unique(instances.object_index[rows]).tolist()
    ]


def _table(instances: Instances, causes: Causes) -> pd.DataFrame:
    import pandas as pd

    registrations, truth = causes.registrations, causes.truth
    rows = registrations.sample
    seen = {name: getattr(instances, name)[rows] for name in ("dataset", "scene", "image", "init_from")}
    severities = {name: getattr(registrations, f"severity_{name}") for name in SEVERITIES}
    judged = {"state": truth.state, "dominant": truth.dominant}
    judged |= {"error": truth.error[:, ALL], "error_clean": truth.error[:, NONE]}
    judged |= {f"phi_{concept}": truth.phi[:, c] for c, concept in enumerate(CONCEPTS)}
    return pd.DataFrame({"sample": rows, **seen, "object": registrations.object_name, **severities, **judged})
