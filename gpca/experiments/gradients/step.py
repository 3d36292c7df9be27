"""Step ``gradients``: registrations, encoder and embeddings -> saliency and TCAV of GP-CA, seed by seed."""

from __future__ import annotations

from dataclasses import replace

from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.encoders.registry import DIFFERENTIABLE, EncoderSettings
from gpca.encoders.training import load_model
from gpca.errors import InputError
from gpca.experiments.gradients.saliency import deletions
from gpca.experiments.gradients.settings import GradientSettings
from gpca.experiments.gradients.tcav import tcav
from gpca.io.arrays import save_arrays
from gpca.io.csv_file import write_csv
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.job import Job
from gpca.process.progress import progress
from gpca.process.provenance import record_provenance


def run(job: Job) -> None:
    """Fit GP-CA and follow its gradients, seed by seed."""
    settings, encoding = GradientSettings(**job.section("gradients")), EncoderSettings(**job.section("encoder"))
    if encoding.backbone not in DIFFERENTIABLE:
        fault = "has no gradient with respect to the points once it is trained"
        raise InputError(f"backbone '{encoding.backbone}'", fault, f"use {' or '.join(DIFFERENTIABLE)}")
    files = ("registrations", "encoders", "embeddings", "deletions", "maps", "tcav")
    for seed, *paths in progress(list(job.per_seed(*files)), f"gradients of {job.source}"):
        inputs, outputs = paths[:3], paths[3:]
        with record_provenance(outputs, inputs, job.settings, seed=seed):
            of_seed = (job.source, seed)
            plain = Registrations.load(inputs[0], of_seed)
            registrations = replace(plain, attached=read_embedding(inputs[2], plain))
            train, test = (registrations.subset(registrations.rows(split)) for split in ("train", "test"))
            gpc = GPC(CONCEPTS, GPCSettings(**job.section("gpc")), *of_seed)
            gpc.fit(train.embedding, train.concept)
            encoder = load_model(inputs[1], encoding, axes=of_seed).encoder
            rows, maps = deletions(encoder, gpc, registrations, *of_seed, encoding, settings)
            tested = tcav(gpc, train, test, settings, *of_seed)
            write_csv(outputs[0], rows)
            save_arrays(outputs[1], maps, of_seed)
            write_csv(outputs[2], tested)
