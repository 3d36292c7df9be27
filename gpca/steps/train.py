"""Step ``train``: registrations -> ``encoders/{source}/{backbone}/seed{seed}.pt`` and its training curve.

The encoder of depth frames starts from one that was trained on the registrations of all sources together.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from gpca.alignment.icp import ICPSettings
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import load_model, train_encoder, write_weights
from gpca.errors import InputError
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations, read_instances_of
from gpca.pairs.synthesis import read_as
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Train, keeping a checkpoint beside the weights until they are written."""
    of_encoder, of_icp = job.settings_and_icp()
    settings, icp = EncoderSettings(**of_encoder), ICPSettings(**of_icp)
    poses, weights = job.get("poses"), job.get("start")
    files = job.files("registrations")
    sources = job.get("registrations_of", [job.source])
    parts = [Registrations.load(path, (source, job.seed)) for path, source in zip(files, sources, strict=True)]
    registrations = Registrations.joined(parts)
    # Clouds of frames are as small as objects look, so some of their points are drawn twice; others are as configured.
    if poses is None and settings.draw_points > (most := int(np.diff(registrations.offsets).max())):
        fault = f"the largest cloud has {most} points, fewer than draw_points, {settings.draw_points}"
        raise InputError(
            job.files("registrations")[0], fault, "lower draw_points, or raise cloud_points of registrations"
        )
    instance_S = read_instances_of(poses, registrations) if poses else None
    start = load_model(weights, settings).state_dict() if weights else None
    # This is no output of the rule: Snakemake removes those before a rerun, and the rerun is what needs it.
    checkpoint = job.weights.with_suffix(".checkpoint")
    inputs = [*files, *(path for path in (poses, weights) if path)]
    with record_provenance([job.weights, job.curve], inputs, job.settings, seed=job.seed):
        seen = read_as(settings.reading, registrations, icp)
        model, curve = train_encoder(seen, job.source, job.seed, settings, checkpoint, start=start, group_S=instance_S)
        write_weights(job.weights, model, (job.source, job.seed))
        write_csv(job.curve, pd.DataFrame(curve), form="%.6g")
        checkpoint.unlink(missing_ok=True)
