"""The steps of depth frames: rendered scenes, instances, their registrations and re-enactments."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import TYPE_CHECKING

from gpca.attribution.predictions import write_timings
from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings, FrameCauseSettings
from gpca.errors import InputError
from gpca.io.csv_file import write_csv
from gpca.objects.canonical import EVALUATION, ObjectClouds, sample_objects
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings

if TYPE_CHECKING:
    from gpca.frames.dataset import Dataset
    from gpca.objects.surface import Surface


ALL_OBJECTS = "all"


def scenes(job: Job) -> None:
    """Lay table-top scenes of procedural objects, or of datasets' models, and render them -> a BOP dataset."""
    from gpca.frames.dataset import datasets_of, files_behind
    from gpca.frames.rgbd_scene import SceneSettings, write_scenes
    from gpca.objects import procedural

    sections = dict(job.settings)
    datasets, role = sections.pop("datasets", None), sections.pop("role", EVALUATION)
    rendered = sections.pop("rendered", ALL_OBJECTS)
    settings = SceneSettings.from_dict(sections)
    inputs = files_behind(datasets, job.data_dir, None) if datasets else []
    with record_provenance([job.out], inputs, job.settings, folders=True):
        if datasets:
            frames = datasets_of(datasets, job.data_dir, job.downloads, None, job.get("splits"), role)
            write_scenes(_renderable(frames, rendered), job.source, replace(settings, families=()), job.out)
        else:
            surfaces = (surface for family in settings.families for surface in procedural.surfaces(family))
            write_scenes(surfaces, job.source, settings, job.out)


def _renderable(datasets: dict[str, Dataset], rendered: str) -> list[Surface]:
    """Return the models of objects of the datasets, those that datasets share once.

    Those that cannot be rendered or stood on a table are skipped, with a line on stderr.

    Args:
        rendered: all that the frames show, or those that no frame shows which may be tested.

    Raises:
        InputError: none is left.
    """
    from gpca.frames.dataset import distinct_surfaces, models_of, simplified, untested_surfaces
    from gpca.frames.rgbd_scene import stable_poses

    models = []
    is_all = rendered == ALL_OBJECTS
    for surface in distinct_surfaces(models_of(datasets)) if is_all else untested_surfaces(datasets):
        try:
            model = simplified(surface)
            stable_poses(model)
        except InputError as fault:
            print(f"skipped: {fault}", file=sys.stderr)
        else:
            models.append(model)
    if not models:
        which = "no model of them" if is_all else "no model of an object that is not tested"
        choice = "" if is_all else ".objects to all, or virtual"
        remedy = f"set real_world.virtual{choice} to null, or name other datasets"
        raise InputError("real_world.datasets", f"{which} can be rendered on a table", remedy)
    return models


def instances(job: Job) -> None:
    """Read models and frames of BOP datasets, back-project the masks and find the initial poses.

    The outputs are ``instances/{source}.npz`` and the canonical clouds of the models.
    """
    from gpca.frames.dataset import datasets_of, distinct_surfaces, files_behind, read_models, with_shared_models
    from gpca.frames.initial_pose import InitialPoseSettings
    from gpca.frames.instances import points_on_model, read_instances

    datasets = datasets_of(
        job.settings.get("datasets"),
        job.data_dir,
        job.downloads,
        job.get("scenes"),
        job.get("splits"),
        job.settings.get("role", EVALUATION),
    )
    inputs = files_behind(job.settings.get("datasets"), job.data_dir, job.get("scenes"))
    initial_pose = InitialPoseSettings(**job.settings.get("initial_pose", {}))
    declared = {**job.settings, "surface_points": job.surface_points}
    with record_provenance([job.instances, job.objects], inputs, declared):
        frames = {name: dataset.frames() for name, dataset in datasets.items()}
        models = with_shared_models({name: read_models(datasets[name], shown) for name, shown in frames.items()})
        objects = sample_objects(distinct_surfaces(models), job.source, job.surface_points)
        read = {name: (dataset, frames[name], models[name]) for name, dataset in datasets.items()}
        instances = read_instances(read, objects, initial_pose)
        named = job.get("name", job.source)
        objects.save(job.objects, named)
        instances.save(job.instances, (named, None))
    for name in datasets:
        medians_m = points_on_model(instances, objects)[instances.dataset == name]
        print(
            f"{name}: {len(medians_m)} instances; median distance to the model under the true pose: "
            f"{1e3 * medians_m.mean():.2f} mm on average, {1e3 * medians_m.max():.2f} mm at most",
            file=sys.stderr,
        )


def frame_registrations(job: Job) -> None:
    """Perturb and align instances -> ``registrations/{source}/seed{seed}.npz``, and their pose errors."""
    from gpca.frames.instances import Instances, require_of_objects
    from gpca.frames.synthesis import FrameSettings, make_frame_registrations
    from gpca.pairs.synthesis import RegistrationSettings

    of_registrations = dict(job.settings)
    own = {name: of_registrations.pop(name) for name in ("test_share", "occluders") if name in of_registrations}
    settings = FrameSettings(**own, registration=RegistrationSettings.from_dict(of_registrations))
    inputs, name = [job.instances, job.objects], job.get("name", job.source)
    with record_provenance([job.registrations, job.poses, job.timings], inputs, job.settings, seed=job.seed):
        instances = Instances.load(job.instances, (name, None))
        objects = ObjectClouds.load(job.objects, name)
        require_of_objects(instances, objects, job.instances)
        made = make_frame_registrations(instances, objects, job.source, job.seed, settings)
        registrations, icp_seconds_S, poses = made
        replace(registrations, axes=(name, job.seed)).save(job.registrations)
        write_csv(job.poses, poses)
        write_timings(job.timings, registrations, icp_seconds_S, icp_seconds_S)


def frame_causes(job: Job) -> None:
    """Choose starts, register the instances from each, and measure the causes -> ``frame_causes/seed{seed}.npz``."""
    from gpca.causes.frames import chosen_starts, measure_frames
    from gpca.frames.dataset import datasets_of, files_behind, meshes_of, models_of
    from gpca.frames.instances import Instances, require_of_objects
    from gpca.frames.starts import all_starts

    frames = files_behind(job.section("datasets"), job.data_dir, job.get("scenes"))
    inputs, outputs = [job.instances, job.objects, *frames], [job.frame_causes, job.samples, job.starts]
    with record_provenance(outputs, inputs, job.settings, seed=job.seed):
        instances, objects = (
            Instances.load(job.instances, (job.source, None)),
            ObjectClouds.load(job.objects, job.source),
        )
        require_of_objects(instances, objects, job.instances)
        own = read_settings(FrameCauseSettings, job.section("frames"))
        places = job.get("scenes"), job.get("splits"), job.settings.get("role", EVALUATION)
        datasets = datasets_of(job.section("datasets"), job.data_dir, job.downloads, *places)
        models = models_of(datasets)
        starts = chosen_starts(all_starts(instances, objects, datasets, models, own.rungs), instances, job.source, own)
        meshes = meshes_of(models, objects, instances.object_index[starts.instance].tolist())
        settings = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
        axes = (job.source, job.seed)
        causes, samples = measure_frames(instances, starts, objects, meshes, *axes, settings, own.points)
        seen = zip(samples["dataset"], samples["scene"], strict=True)
        causes.save(job.frame_causes)
        write_csv(job.samples, samples.assign(truth=[datasets[name].place(scene).truth for name, scene in seen]))
        starts.subset(causes.registrations.sample).save(job.starts, axes)


def reenact_frames(job: Job) -> None:
    """Re-enact the registrations of depth frames -> ``reenactments/{source}/seed{seed}.npz``.

    Of the truth's settings it reads how ICP runs, and the limits of the states.
    """
    from gpca.frames.dataset import datasets_of, files_behind, meshes_of, models_of
    from gpca.frames.instances import Instances, require_of_objects
    from gpca.frames.starts import Starts
    from gpca.reenactment.frames import reenact_frames

    settings = read_settings(ReenactmentSettings, job.section("reenactment"))
    truth = CauseSettings.from_dict(job.section("causes"), job.section("icp"))
    frames = files_behind(job.section("datasets"), job.data_dir, job.get("scenes"))
    inputs = [job.frame_causes, job.starts, job.instances, job.objects, *frames]
    with record_provenance([job.reenactments], inputs, job.settings, seed=job.seed):
        axes = (job.source, job.seed)
        causes, starts = Causes.load(job.frame_causes, axes), Starts.load(job.starts, axes)
        instances, objects = (
            Instances.load(job.instances, (job.source, None)),
            ObjectClouds.load(job.objects, job.source),
        )
        require_of_objects(instances, objects, job.instances)
        places = job.get("scenes"), job.get("splits"), job.settings.get("role", EVALUATION)
        models = models_of(datasets_of(job.section("datasets"), job.data_dir, job.downloads, *places))
        meshes = meshes_of(models, objects, causes.registrations.object_index.tolist())
        reenact_frames(causes, starts, instances, objects, meshes, settings, truth).save(job.reenactments)
