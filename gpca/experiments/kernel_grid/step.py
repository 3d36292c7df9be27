"""Step ``kernel_grid``: embeddings -> accuracy and calibration by kernel, learning rate and number of iterations.

With the predictions of the test samples.
"""

from __future__ import annotations

from dataclasses import replace

from gpca.experiments.kernel_grid.grid import KernelGrid, evaluate_grid, write_grid
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.settings import fields_of


def run(job: Job) -> None:
    """Evaluate the grid, seed by seed."""
    grid = KernelGrid(**fields_of(job.settings, KernelGrid))
    files = job.per_seed("registrations", "embeddings", "out", "predictions")
    for seed, registrations, embeddings, out, predictions in files:
        with record_provenance([out, predictions], [registrations, embeddings], job.settings, seed=seed):
            loaded = Registrations.load(registrations, (job.source, seed))
            loaded = replace(loaded, attached=read_embedding(embeddings, loaded))
            rows, of_samples = evaluate_grid(loaded, grid, job.source, seed)
            write_grid(out, rows)
            write_csv(predictions, of_samples)
