"""Step ``reenact_frames``: causes of depth frames -> ``reenactments/{source}/seed{seed}.npz``."""

from __future__ import annotations

from gpca.causes.dataset import Causes
from gpca.causes.settings import CauseSettings
from gpca.frames.dataset import datasets_of, files_behind, meshes_of, models_of
from gpca.frames.instances import Instances, require_of_objects
from gpca.frames.starts import Starts
from gpca.objects.canonical import EVALUATION, ObjectClouds
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.reenactment.frame_enactment import reenact_frames
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings


def run(job: Job) -> None:
    """Re-enact every registration; of the truth's settings it reads how ICP runs, and the limits of the states."""
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
