"""Step ``retrain``: canonical clouds -> ``retrained/{severities}/{source}/seed{seed}.npz``, sets of samples.

The samples are perturbed within other ranges than the protocol's, from the same random numbers, and an encoder learns
from them as the protocol's does.
"""

from __future__ import annotations

from dataclasses import replace

from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.objects.canonical import ObjectClouds
from gpca.pairs.synthesis import RegistrationSettings, make_registrations
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.steps.shift import ShiftSettings, sets_of_encoder


def run(job: Job) -> None:
    """Perturb, align, train, embed and measure."""
    axes = (job.source, job.seed)
    parts = {name: job.section(name) for name in ("shift", "registrations", "encoder")}
    settings, encoder_settings = ShiftSettings.from_dicts(**parts), EncoderSettings(**parts["encoder"])
    checkpoint = job.out.with_suffix(".checkpoint")  # no output of the rule: a rerun continues from it
    with record_provenance([job.out], [job.objects], job.settings, seed=job.seed):
        objects = ObjectClouds.load(job.objects, job.source)
        samples, _ = make_registrations(objects, *axes, RegistrationSettings.from_dict(parts["registrations"]))
        model, _ = train_encoder(samples, *axes, encoder_settings, checkpoint)
        samples = replace(samples, attached={"embedding": embed(model, samples, *axes, encoder_settings)[0]})
        sets = sets_of_encoder(objects, samples, None, model, encoder_settings, *axes, settings)
        sets.save(job.out, axes)
        checkpoint.unlink(missing_ok=True)
