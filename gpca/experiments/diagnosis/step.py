"""Step ``diagnose``: one explainer of causes on all seeds of a source -> its predictions."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from gpca.attribution.predictions import read_timings, write_predictions, write_timings
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import Causes, labeled
from gpca.causes.descriptors import Descriptors
from gpca.causes.settings import DescriptorSettings
from gpca.causes.truth import BORDERLINE
from gpca.errors import InputError
from gpca.explainers.interface import BARE, REENACTED, ConceptExplainer, ExplainerEntry, icp_calls
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.reenactment.dataset import Reenactments, reenactment_features
from gpca.reenactment.settings import ReenactmentSettings


def run(job: Job) -> None:
    """Fit on the training rows that have a label and explain every row, seed by seed."""
    entry = explainer_entry(job.explainer, CAUSES)
    remedies = DescriptorSettings(**json.loads(job.remedies))
    reenactment = ReenactmentSettings(**json.loads(job.reenactment))
    files = ("causes", "read", "read_timings", "predictions", "timings")
    for seed, causes_file, read, read_timing, predictions, timings in job.per_seed(*files):
        explainer = entry.make(job.source, seed, **job.settings)
        inputs = [causes_file, read, read_timing]
        with record_provenance([predictions, timings], inputs, job.settings, seed=seed):
            causes = Causes.load(causes_file, (job.source, seed))
            registrations = with_what_it_reads(labeled(causes), entry, read)
            seconds_S, icp_seconds_S = read_timings(read_timing, registrations)
            attribution = explained(explainer, entry, registrations, causes, remedies, causes_file, reenactment)
            write_predictions(predictions, causes.registrations, attribution)
            write_timings(timings, registrations, seconds_S + attribution.seconds_N, icp_seconds_S)


def explained(
    explainer: ConceptExplainer,
    entry: ExplainerEntry,
    registrations: Registrations,
    causes: Causes,
    remedies: DescriptorSettings,
    path: Path,
    reenactment: ReenactmentSettings | None = None,
) -> Attribution:
    """Let an explainer learn from the training rows and explain all, and count the runs of ICP that it needs.

    Args:
        registrations: with labels, and with what it reads attached.
        causes, path: these registrations, and their file.
        remedies: the settings of the registrations with remedies.
        reenactment: those of the re-enactments, if it may see them.
    """
    explainer.fit(registrations.subset(training_rows(registrations, path)))
    starts = causes.T_target_source_runs.shape[1]
    calls = icp_calls(entry.sees, starts, remedies, reenactment.calls(starts) if reenactment else 0)
    return replace(explainer.explain(observed_only(registrations)), icp_calls_N=np.full(len(registrations), calls))


def training_rows(registrations: Registrations, path: Path) -> np.ndarray:
    rows = np.flatnonzero((registrations.split == "train") & (registrations.concept != BORDERLINE))
    if not len(rows):
        raise InputError(path, "has no training samples with a label", "raise causes.train")
    return rows


def observed_only(registrations: Registrations) -> Registrations:
    """Return the registrations without anything that reveals what is wrong with them."""
    hidden = registrations.without_labels()
    return replace(hidden, attached={name: array for name, array in hidden.attached.items() if name != "causes"})


def with_what_it_reads(registrations: Registrations, entry: ExplainerEntry, path: Path) -> Registrations:
    if entry.reads == BARE:
        return registrations
    if entry.reads == "embeddings":
        read = read_embedding(path, registrations, logits=True)
    elif entry.reads == REENACTED:
        enacted = Reenactments.load(path, registrations)
        read = {"verdict": enacted.verdict, "reenactment": reenactment_features(enacted)}
    else:
        read = dict(Descriptors.load(path, registrations).groups)
    return replace(registrations, attached={**registrations.attached, **read})
