"""Step ``reduce``: embeddings -> shorter ones, ``embeddings/{source}/{backbone}/{reduction}/seed{seed}.npz``."""

from __future__ import annotations

from gpca.encoders.reduction import make_reduction, reduce
from gpca.errors import InputError
from gpca.io.arrays import REAL, REGENERATE, TEXT, WHOLE, load_arrays, save_arrays
from gpca.process.job import Job
from gpca.process.provenance import record_provenance

SHAPES = {"h": ("S", "d"), "head_logits": ("S", "C"), "sample": ("S",), "split": ("S",)}
KINDS = {"h": REAL, "head_logits": REAL, "sample": WHOLE, "split": TEXT}


def run(job: Job) -> None:
    """Fit on the training rows and reduce every row, seed by seed; all else is kept as it is."""
    make_reduction(job.reduction, job.settings)
    for seed, embeddings, out in job.per_seed("embeddings", "out"):
        with record_provenance([out], [embeddings], job.settings, seed=seed):
            arrays = load_arrays(embeddings, SHAPES, KINDS, (job.source, seed))
            h_S_d = arrays["h"]
            train_S = arrays["split"] == "train"
            if not train_S.any():
                raise InputError(embeddings, "has no training samples", REGENERATE)
            axes = (job.source, seed, "reduction")
            reduced_S_c = reduce(job.reduction, h_S_d[train_S], h_S_d, job.settings, *axes)
            save_arrays(out, {name: arrays[name] for name in SHAPES} | {"h": reduced_S_c}, (job.source, seed))
