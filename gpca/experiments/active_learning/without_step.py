"""Step ``without``: registrations -> embeddings by encoders that each never saw one of the concepts."""

from __future__ import annotations

import numpy as np

from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.io.arrays import save_arrays
from gpca.pairs.dataset import Registrations
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Train on the training samples of the other concepts and embed every cloud, concept by concept."""
    settings = EncoderSettings(**job.settings)
    with record_provenance([job.out], [job.registrations], job.settings, seed=job.seed):
        registrations = Registrations.load(job.registrations, (job.source, job.seed))
        train = registrations.rows("train")
        arrays = {"sample": registrations.sample, "split": registrations.split}
        for held_out in job.concepts:
            seen = registrations.subset(train[registrations.concept[train] != held_out])
            name = f"{job.source} without {held_out}"
            model, _ = train_encoder(seen, name, job.seed, settings)
            arrays[f"h_{held_out}"], _ = embed(model, registrations, name, job.seed, settings)
        save_arrays(job.out, {name: np.asarray(array) for name, array in arrays.items()}, registrations.axes)
