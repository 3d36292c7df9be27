"""The steps of the paper's protocol: objects, registrations, uncertainty, encoders, and explainers' predictions."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import read_timings, write_predictions, write_timings
from gpca.encoders import reduction
from gpca.encoders.registry import EncoderSettings
from gpca.errors import InputError
from gpca.explainers.interface import Describing, answer_of
from gpca.explainers.registry import explainer_entry
from gpca.io.arrays import REAL, REGENERATE, TEXT, WHOLE, load_arrays, save_arrays
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.objects.canonical import ObjectClouds, write_objects
from gpca.objects.source import data_files, resolve, surfaces
from gpca.pairs.dataset import Registrations, read_embedding, read_instances_of
from gpca.pairs.synthesis import RegistrationSettings, make_registrations, read_as
from gpca.settings import fields_of, read_settings
from gpca.uncertainty.designs import design_rows, evaluate_design
from gpca.uncertainty.outcomes import Outcomes, read_seconds, write_seconds
from gpca.uncertainty.settings import CONDITIONS, UncertaintySettings

EARLIER = ("earlier_seconds", "earlier_icp_seconds")  # spent before an explainer starts


def objects(job: Job) -> None:
    """Read a configured source's surfaces -> canonical clouds, ``objects/{source}.npz``."""
    entry = resolve(job.settings, job.data_dir)
    declared = {"entry": entry, "surface_points": job.surface_points}
    splits = job.get("splits")
    with record_provenance([job.out], [*data_files(entry), *filter(None, [splits])], declared):
        write_objects(surfaces(entry, job.downloads), job.source, job.out, job.surface_points, splits)


def registrations(job: Job) -> None:
    """Perturb and align canonical clouds -> ``registrations/{source}/seed{seed}.npz``."""
    settings = read_settings(RegistrationSettings, job.settings)
    objects = ObjectClouds.load(job.objects, job.source)
    with record_provenance([job.registrations, job.timings], [job.objects], job.settings, seed=job.seed):
        registrations, icp_seconds_S = make_registrations(objects, job.source, job.seed, settings)
        registrations.save(job.registrations)
        write_timings(job.timings, registrations, icp_seconds_S, icp_seconds_S)


def uncertainty(job: Job) -> None:
    """Run the conditions of a design by Monte-Carlo ICP, seed by seed -> ``uncertainty/{source}/{design}/``."""
    own, icp = job.settings_and_icp()
    settings = UncertaintySettings(**fields_of(own, UncertaintySettings), icp=ICPSettings(**icp))
    for seed, registrations_path, out, table, timings in job.per_seed("registrations", "outcomes", "tables", "timings"):
        with record_provenance([out, table, timings], [registrations_path], job.settings, seed=seed):
            registrations = Registrations.load(registrations_path, (job.source, seed))
            chosen = registrations.subset(design_rows(registrations, job.design, own.get("samples")))
            outcomes, *seconds = evaluate_design(job.design, chosen, job.source, seed, settings)
            outcomes.save(out, (job.source, seed))
            outcomes.write_table(table, CONDITIONS[job.design])
            write_seconds(timings, outcomes, *seconds)


def train(job: Job) -> None:
    """Train an encoder on registrations, perhaps from the weights of another -> its weights and training curve."""
    import pandas as pd

    from gpca.encoders.training import load_model, train_encoder, write_weights

    of_encoder, of_icp = job.settings_and_icp()
    settings, icp = EncoderSettings(**of_encoder), ICPSettings(**of_icp)
    poses, weights = job.get("poses"), job.get("start")
    files = job.files("registrations")
    sources = job.get("registrations_of", [job.source])
    parts = [Registrations.load(path, (source, job.seed)) for path, source in zip(files, sources, strict=True)]
    registrations = Registrations.joined(parts)
    # Clouds of frames are as small as objects look, so some of their points are drawn twice; others are as configured.
    if poses is None and settings.draw_points > (most := int(np.diff(registrations.offsets).max())):
        fault = f"the largest cloud has {most} points, fewer than draw_points, {settings.draw_points}"
        raise InputError(files[0], fault, "lower draw_points, or raise cloud_points of registrations")
    instance_S = read_instances_of(poses, registrations) if poses else None
    start = load_model(weights, settings).state_dict() if weights else None
    # This is no output of the rule: Snakemake removes those before a rerun, and the rerun is what needs it.
    checkpoint = job.weights.with_suffix(".checkpoint")
    inputs = [*files, *(path for path in (poses, weights) if path)]
    with record_provenance([job.weights, job.curve], inputs, job.settings, seed=job.seed):
        seen = read_as(settings.reading, registrations, icp)
        model, curve = train_encoder(seen, job.source, job.seed, settings, checkpoint, start=start, group_S=instance_S)
        write_weights(job.weights, model, job.axes)
        write_csv(job.curve, pd.DataFrame(curve), form="%.6g")
        checkpoint.unlink(missing_ok=True)


def embed(job: Job) -> None:
    """Embed the registrations by an encoder -> ``embeddings/{source}/{backbone}/{reduction}/seed{seed}.npz``."""
    from gpca.encoders.training import embed, load_model

    of_encoder, of_icp = job.settings_and_icp()
    settings, icp = EncoderSettings(**of_encoder), ICPSettings(**of_icp)
    inputs = [job.registrations, job.encoder]
    with record_provenance([job.embeddings, job.timings], inputs, job.settings, seed=job.seed):
        registrations = Registrations.load(job.registrations, job.axes)
        seconds_S, icp_seconds_S = read_timings(job.registration_timings, registrations)
        model = load_model(job.encoder, settings, axes=(job.get("encoder_of", job.source), job.seed))
        started = perf_counter()
        seen = read_as(settings.reading, registrations, icp)
        h_S_d, logits_S_C = embed(model, seen, *job.axes, settings)
        seconds = (perf_counter() - started) / len(h_S_d)
        arrays = {"h": h_S_d, "head_logits": logits_S_C, "sample": registrations.sample, "split": registrations.split}
        save_arrays(job.embeddings, arrays, job.axes)
        write_timings(job.timings, registrations, seconds_S + seconds, icp_seconds_S)


EMBEDDING_SHAPES = {"h": ("S", "d"), "head_logits": ("S", "C"), "sample": ("S",), "split": ("S",)}
EMBEDDING_KINDS = {"h": REAL, "head_logits": REAL, "sample": WHOLE, "split": TEXT}


def reduce(job: Job) -> None:
    """Fit a reduction to the training rows of embeddings and reduce every row, seed by seed; all else is kept."""
    reduction.make_reduction(job.reduction, job.settings)
    for seed, embeddings, out in job.per_seed("embeddings", "out"):
        with record_provenance([out], [embeddings], job.settings, seed=seed):
            arrays = load_arrays(embeddings, EMBEDDING_SHAPES, EMBEDDING_KINDS, (job.source, seed))
            h_S_d, axes = arrays["h"], (job.source, seed, "reduction")
            reduced_S_c = reduction.reduce(job.reduction, h_S_d[arrays["split"] == "train"], h_S_d, job.settings, *axes)
            save_arrays(out, {name: arrays[name] for name in EMBEDDING_SHAPES} | {"h": reduced_S_c}, (job.source, seed))


def attribute(job: Job) -> None:
    """Fit an explainer to the training rows and explain every row, seed by seed -> predictions and timings."""
    entry = explainer_entry(job.explainer)
    names = ("registrations", "embeddings", "uncertainty", "uncertainty_timings", "input_timings")
    lists = [job.get(name, [None] * len(job.seeds)) for name in names]
    files = [dict(zip(names, of_seed, strict=True)) for of_seed in zip(*lists, strict=True)]
    for (seed, predictions, timings), read in zip(job.per_seed("predictions", "timings"), files, strict=True):
        explainer = entry.made(job.source, seed, **job.settings)
        inputs = [path for path in read.values() if path]
        with record_provenance([predictions, timings], inputs, job.settings, seed=seed):
            axes = (job.get("files_of", job.source), job.get("files_seed", seed))
            registrations = Registrations.load(read["registrations"], axes)
            earlier = dict(zip(EARLIER, read_timings(read["input_timings"], registrations), strict=True))
            if entry.reads == "embeddings":
                earlier |= read_embedding(read["embeddings"], registrations, logits=True)
            registrations = replace(registrations, attached=earlier)
            if entry.design:
                outcomes = Outcomes.load(read["uncertainty"], axes)
                conditions = outcomes.uncertainty.shape[1]
                if entry.design in CONDITIONS and conditions != len(CONDITIONS[entry.design]):
                    fault = f"{conditions} conditions are not those of design '{entry.design}'"
                    raise InputError(read["uncertainty"], fault, REGENERATE)
                registrations = outcomes.attach_to(registrations, *read_seconds(read["uncertainty_timings"], outcomes))
            observed = registrations if entry.oracle else registrations.without_labels()
            started = perf_counter()
            if isinstance(explainer, Describing):  # once, for training and for explanation
                observed = explainer.describe(observed)
            describing_seconds = (perf_counter() - started) / len(observed)
            train = registrations.rows("train")
            if len(train):  # a design may cover the test samples alone; what reads it learns nothing
                explainer.fit(replace(registrations, attached=observed.attached).subset(train))
            attribution = answer_of(explainer, observed)
            write_predictions(predictions, registrations, attribution)
            seconds_S, icp_seconds_S = (registrations.attached[name] for name in EARLIER)
            seconds_S = seconds_S + describing_seconds + attribution.seconds_N
            write_timings(timings, registrations, seconds_S, icp_seconds_S + attribution.icp_seconds_N)
