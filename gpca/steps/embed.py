"""Step ``embed``: registrations and encoder -> ``embeddings/{source}/{backbone}/{reduction}/seed{seed}.npz``."""

from __future__ import annotations

from time import perf_counter

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import read_timings, write_timings
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, load_model
from gpca.io.arrays import save_arrays
from gpca.pairs.dataset import Registrations
from gpca.pairs.synthesis import read_as
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Embed every cloud."""
    of_encoder, of_icp = job.settings_and_icp()
    settings, icp = EncoderSettings(**of_encoder), ICPSettings(**of_icp)
    inputs, axes = [job.registrations, job.encoder], (job.source, job.seed)
    with record_provenance([job.embeddings, job.timings], inputs, job.settings, seed=job.seed):
        registrations = Registrations.load(job.registrations, axes)
        seconds_S, icp_seconds_S = read_timings(job.registration_timings, registrations)
        model = load_model(job.encoder, settings, axes=(job.get("encoder_of", job.source), job.seed))
        started = perf_counter()
        seen = read_as(settings.reading, registrations, icp)
        h_S_d, logits_S_C = embed(model, seen, *axes, settings)
        seconds = (perf_counter() - started) / len(h_S_d)
        arrays = {"h": h_S_d, "head_logits": logits_S_C, "sample": registrations.sample, "split": registrations.split}
        save_arrays(job.embeddings, arrays, axes)
        write_timings(job.timings, registrations, seconds_S + seconds, icp_seconds_S)
