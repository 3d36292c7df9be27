"""The steps of depth frames: rendered scenes, instances, their registrations and re-enactments."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from gpca.attribution.predictions import write_timings
from gpca.causes.dataset import Causes
from gpca.causes.frames import chosen_starts, measure_frames
from gpca.causes.settings import CauseSettings, FrameCauseSettings
from gpca.errors import InputError
from gpca.frames import dataset
from gpca.frames.dataset import meshes_of, models_of
from gpca.frames.initial_pose import InitialPoseSettings
from gpca.frames.instances import Instances, Starts, all_starts, read_instances
from gpca.frames.rgbd_scene import SceneSettings, stable_poses, write_scenes
from gpca.frames.synthesis import FrameSettings, make_frame_registrations
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects import procedural
from gpca.objects.canonical import EVALUATION, ObjectClouds, sample_objects
from gpca.pairs.judge import Judges
from gpca.pairs.synthesis import RegistrationSettings
from gpca.reenactment import frames as reenactment
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings
from gpca.steps.registration_trials import outcomes_by

ALL_OBJECTS = "all"
SHOWN_METHOD = "point_to_point"  # ICP as in the registrations that are shown


def scenes(job: Job) -> None:
    """Lay table-top scenes of procedural objects, or of datasets' models, and render them -> a BOP dataset."""
    sections = dict(job.settings)
    datasets, role = sections.pop("datasets", None), sections.pop("role", EVALUATION)
    is_all = sections.pop("rendered", ALL_OBJECTS) == ALL_OBJECTS
    settings = read_settings(SceneSettings, sections)
    inputs = dataset.files_behind(datasets, job.data_dir, None) if datasets else []
    with record_provenance([job.out], inputs, job.settings, folders=True):
        if not datasets:
            surfaces = (surface for family in settings.families for surface in procedural.surfaces(family))
            write_scenes(surfaces, job.source, settings, job.out)
            return
        frames = dataset.datasets_of(datasets, job.data_dir, job.downloads, None, job.get("splits"), role)
        shown = dataset.distinct_surfaces(models_of(frames)) if is_all else dataset.untested_surfaces(frames)
        models = []
        for surface in shown:
            try:
                model = dataset.simplified(surface)
                stable_poses(model)
            except InputError as fault:
                print(f"skipped: {fault}", file=sys.stderr)
            else:
                models.append(model)
        if not models:
            lacking = f"no model of {'them' if is_all else 'an object that is not tested'} can be rendered on a table"
            raise InputError("real_world.datasets", lacking, "set real_world.virtual to null, or name other datasets")
        write_scenes(models, job.source, replace(settings, families=()), job.out)


def _datasets(job: Job) -> dict[str, dataset.Dataset]:
    places = job.get("scenes"), job.get("splits"), job.settings.get("role", EVALUATION)
    return dataset.datasets_of(job.settings.get("datasets"), job.data_dir, job.downloads, *places)


def _inputs(job: Job, *files: Path) -> list[Path]:
    return [*files, *dataset.files_behind(job.settings.get("datasets"), job.data_dir, job.get("scenes"))]


def _instances(job: Job, name: str) -> tuple[Instances, ObjectClouds]:
    return Instances.load(job.instances, (name, None)), ObjectClouds.load(job.objects, name)


def instances(job: Job) -> None:
    """Read models and frames of BOP datasets -> instances with initial poses, and the models' canonical clouds."""
    datasets, inputs = _datasets(job), _inputs(job)
    initial_pose = InitialPoseSettings(**job.settings.get("initial_pose", {}))
    declared = {**job.settings, "surface_points": job.surface_points}
    with record_provenance([job.instances, job.objects], inputs, declared):
        frames = {name: each.frames() for name, each in datasets.items()}
        read_models = {name: dataset.read_models(datasets[name], shown) for name, shown in frames.items()}
        models = dataset.with_shared_models(read_models)
        objects = sample_objects(dataset.distinct_surfaces(models), job.source, job.surface_points)
        read = {name: (each, frames[name], models[name]) for name, each in datasets.items()}
        instances = read_instances(read, objects, initial_pose)
        named = job.get("name", job.source)
        objects.save(job.objects, named)
        instances.save(job.instances, (named, None))


def frame_registrations(job: Job) -> None:
    """Perturb and align instances -> ``registrations/{source}/seed{seed}.npz``, and their pose errors."""
    registration = dict(job.settings)
    frame_settings = {name: registration.pop(name) for name in ("test_share", "occluders") if name in registration}
    settings = FrameSettings(**frame_settings, registration=read_settings(RegistrationSettings, registration))
    inputs, name = [job.instances, job.objects], job.get("name", job.source)
    with record_provenance([job.registrations, job.poses, job.timings], inputs, job.settings, seed=job.seed):
        registrations, icp_seconds_S, poses = make_frame_registrations(*_instances(job, name), *job.axes, settings)
        replace(registrations, axes=(name, job.seed)).save(job.registrations)
        write_csv(job.poses, poses)
        write_timings(job.timings, registrations, icp_seconds_S, icp_seconds_S)


def frame_causes(job: Job) -> None:
    """Choose starts, register the instances from each, and measure the causes -> ``frame_causes/seed{seed}.npz``."""
    inputs, outputs = _inputs(job, job.instances, job.objects), [job.frame_causes, job.samples, job.starts]
    with record_provenance(outputs, inputs, job.settings, seed=job.seed):
        instances, objects = _instances(job, job.source)
        own, datasets = read_settings(FrameCauseSettings, job.section("frames")), _datasets(job)
        models, axes = models_of(datasets), job.axes
        starts = chosen_starts(all_starts(instances, objects, datasets, models, own.rungs), instances, job.source, own)
        meshes = meshes_of(models, objects, instances.object_index[starts.instance].tolist())
        settings = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
        causes, samples = measure_frames(instances, starts, objects, meshes, *axes, settings, own.points)
        seen = zip(samples["dataset"], samples["scene"], strict=True)
        causes.save(job.frame_causes)
        samples = samples.assign(truth=[datasets[name].place(scene).truth for name, scene in seen])
        limit = settings.limits.failed
        failed = {f"failed_{SHOWN_METHOD}": causes.error_shown > limit}
        failed |= {f"failed_{name}": errors_S > limit for name, errors_S in _errors(causes, objects, axes, own).items()}
        write_csv(job.samples, samples.assign(**failed))
        starts.subset(causes.registrations.sample).save(job.starts, axes)


def _errors(
    causes: Causes, objects: ObjectClouds, axes: tuple[str, int], settings: FrameCauseSettings
) -> dict[str, np.ndarray]:
    """Return the errors (S,) of each other method from the same starts, in diameters; infinite where it fails."""
    registrations, judges = causes.registrations, Judges(objects, f"objects of {axes[0]}")
    outcomes = outcomes_by({name: {} for name in settings.methods}, registrations, *axes, settings.points)
    errors = {name: np.full(len(causes), np.inf) for name in outcomes}
    for name, outcomes_S in outcomes.items():
        for row, outcome in enumerate(outcomes_S):
            if outcome.converged:
                judge, T_true = judges.of(registrations, row), registrations.T_target_source("true", row)
                errors[name][row] = judge(outcome.T_target_source, T_true)["add_relative"]
    return errors


def reenact_frames(job: Job) -> None:
    """Re-enact the registrations of depth frames -> ``reenactments/{source}/seed{seed}.npz``."""
    settings = read_settings(ReenactmentSettings, job.section("reenactment"))
    truth = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
    inputs, axes = _inputs(job, job.frame_causes, job.starts, job.instances, job.objects), job.axes
    with record_provenance([job.reenactments], inputs, job.settings, seed=job.seed):
        causes, starts = Causes.load(job.frame_causes, axes), Starts.load(job.starts, axes)
        instances, objects = _instances(job, job.source)
        meshes = meshes_of(models_of(_datasets(job)), objects, causes.registrations.object_index.tolist())
        enacted = reenactment.reenact_frames(causes, starts, instances, objects, meshes, settings, truth)
        enacted.save(job.reenactments)
