"""Step ``train_on_causes``: causes -> weights of an encoder that tells their labels apart, and its embeddings."""

from __future__ import annotations

from time import perf_counter

import pandas as pd

from gpca.attribution.predictions import read_timings, write_timings
from gpca.causes.dataset import LABELS, Causes, with_label
from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import TrainingTask, embed, train_encoder, write_weights
from gpca.io.arrays import save_arrays
from gpca.io.csv_file import write_csv
from gpca.process.job import Job
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Train on the training samples that have a label, keeping a checkpoint, and embed every sample."""
    settings = EncoderSettings(**job.settings)
    checkpoint = job.weights.with_suffix(".checkpoint")
    axes = (job.source, job.seed)
    outputs = [job.weights, job.curve, job.embeddings, job.timings]
    inputs = [job.causes, job.causes_timings]
    with record_provenance(outputs, inputs, job.settings, seed=job.seed):
        causes = Causes.load(job.causes, axes)
        registrations = causes.registrations
        seconds_S, icp_seconds_S = read_timings(job.causes_timings, registrations)
        model, curve = train_encoder(with_label(causes), *axes, settings, checkpoint, TrainingTask(LABELS))
        started = perf_counter()
        h_S_d, logits_S_C = embed(model, registrations, *axes, settings)
        seconds = (perf_counter() - started) / len(h_S_d)
        write_weights(job.weights, model, axes)
        write_csv(job.curve, pd.DataFrame(curve), form="%.6g")
        arrays = {"h": h_S_d, "head_logits": logits_S_C, "sample": registrations.sample, "split": registrations.split}
        save_arrays(job.embeddings, arrays, axes)
        write_timings(job.timings, registrations, seconds_S + seconds, icp_seconds_S)
        checkpoint.unlink(missing_ok=True)
