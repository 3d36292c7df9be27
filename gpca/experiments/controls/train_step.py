"""Step ``train_control``: registrations -> embeddings by an encoder that is trained under a control."""

from __future__ import annotations

import sys

import pandas as pd

from gpca.encoders.settings import EncoderSettings
from gpca.experiments.controls.encoding import encode, nothing
from gpca.experiments.controls.settings import ControlSettings
from gpca.experiments.controls.variants import left_out
from gpca.io.arrays import save_arrays
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations
from gpca.process.job import Job
from gpca.process.provenance import record_provenance

CURVE = ("epoch", "learning_rate", "loss", "accuracy")


def run(job: Job) -> None:
    """Train, keeping a checkpoint, and embed every sample; none where the registrations do not admit the control."""
    settings, encoder = ControlSettings.from_dict(job.section("controls")), EncoderSettings(**job.section("encoder"))
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
