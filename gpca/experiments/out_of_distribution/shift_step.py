"""Step ``shift``: registrations and encoder -> samples unlike the training samples, embedded, and their distances."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import load_model
from gpca.errors import InputError
from gpca.experiments.out_of_distribution.samples import make_sets
from gpca.experiments.out_of_distribution.settings import ShiftSettings
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Make the sets, seed by seed."""
    settings = ShiftSettings.from_dicts(**job.settings)
    encoder_settings = EncoderSettings(**job.section("encoder"))
    objects = ObjectClouds.load(job.objects, job.source)
    of_others = job.get("other_registrations", [None] * len(job.seeds))
    of_own = job.per_seed("registrations", "embeddings", "encoders", "out")
    for (seed, own, embeddings, weights, out), other in zip(of_own, of_others, strict=True):
        inputs = [path for path in (job.objects, own, other, embeddings, weights) if path]
        with record_provenance([out], inputs, job.settings, seed=seed):
            axes = (job.source, seed)
            registrations = Registrations.load(own, axes)
            registrations = replace(registrations, attached=read_embedding(embeddings, registrations))
            others = _of_another_source(other, job.source) if other else None
            model = load_model(weights, encoder_settings, axes=axes)
            sets = make_sets(objects, registrations, others, model, encoder_settings, *axes, settings)
            sets.save(out, axes)


def _of_another_source(path: Path, own: str) -> Registrations:
    registrations = Registrations.load(path)
    if registrations.axes is not None and registrations.axes[0] == own:
        raise InputError(path, f"is of source '{own}' itself", "give registrations of another source")
    return registrations
