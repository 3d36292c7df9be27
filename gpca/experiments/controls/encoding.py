"""Step ``train_control``: registrations -> embeddings by an encoder that is trained under a control."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from gpca.encoders.registry import EncoderSettings
from gpca.encoders.training import embed, train_encoder
from gpca.experiments.controls.settings import HARD, ControlSettings
from gpca.experiments.controls.variants import left_out, of_unseen_objects
from gpca.io.arrays import save_arrays
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.settings import read_settings

CURVE = ("epoch", "learning_rate", "loss", "accuracy")


def encode(
    control: str,
    registrations: Registrations,
    source: str,
    seed: int,
    settings: ControlSettings,
    encoder: EncoderSettings,
    checkpoint: Path | None = None,
) -> tuple[dict[str, np.ndarray], list[dict[str, float]]]:
    """Train an encoder like the paper's except for the control, and embed the samples of the variant.

    With matched density every draw from a cloud has a random number of points; the clouds are whole, as each epoch
    draws anew. An encoder for unseen objects sees no sample of them; nor does one that is trained in another way, by
    such draws. Hard samples are of unseen objects as they are.

    Returns:
        the arrays of a file of embeddings, and the training curve.
    """
    if control in ("density", "random_draws"):
        fewest, most = settings.draw_points
        encoder = replace(encoder, fewest_points=fewest, draw_points=most)
    if control not in ("density", HARD):
        registrations = of_unseen_objects(registrations, settings.folds, source, seed)
    name = f"{source} under {control}"
    model, curve = train_encoder(registrations, name, seed, encoder, checkpoint)
    h_S_d, logits_S_C = embed(model, registrations, name, seed, encoder)
    of_sample = {"sample": registrations.sample, "split": registrations.split}
    return {"h": h_S_d, "head_logits": logits_S_C, **of_sample}, curve


def nothing() -> tuple[dict[str, np.ndarray], list[dict[str, float]]]:
    """Return the result for a control that is left out: arrays without samples, and no epoch."""
    empty = {name: np.zeros((0, 1), np.float32) for name in ("h", "head_logits")}
    return {**empty, "sample": np.zeros(0, int), "split": np.zeros(0, "U5")}, []


def run(job: Job) -> None:
    """Train, keeping a checkpoint, and embed every sample; none where the registrations do not admit the control."""
    settings = read_settings(ControlSettings, job.section("controls"))
    encoder = EncoderSettings(**job.section("encoder"))
    checkpoint = job.embeddings.with_suffix(".checkpoint")
    with record_provenance([job.embeddings, job.curve], [job.registrations], job.settings, seed=job.seed):
        registrations = Registrations.load(job.registrations, (job.source, job.seed))
        if why := left_out(job.control, registrations, settings, encoder.backbone):
            print(f"control '{job.control}' of {job.source} is skipped: {why}", file=sys.stderr)
            arrays, curve = nothing()
        else:
            axes = (job.source, job.seed, settings, encoder, checkpoint)
            arrays, curve = encode(job.control, registrations, *axes)
        save_arrays(job.embeddings, arrays, registrations.axes)
        write_csv(job.curve, pd.DataFrame(curve, columns=list(CURVE)), form="%.6g")
        checkpoint.unlink(missing_ok=True)
