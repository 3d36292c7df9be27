"""Step ``attribute``: one explainer on all seeds of a source -> its predictions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from time import perf_counter

from gpca.attribution.predictions import read_timings, write_predictions, write_timings
from gpca.errors import InputError
from gpca.explainers.interface import Describing, ExplainerEntry
from gpca.explainers.registry import explainer_entry
from gpca.io.arrays import REGENERATE
from gpca.io.names import Axes
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.job import Job
from gpca.process.provenance import record_provenance
from gpca.uncertainty.conditions import CONDITIONS
from gpca.uncertainty.outcomes import Outcomes, read_seconds


def run(job: Job) -> None:
    """Fit on the training rows and explain every row, seed by seed."""
    entry = explainer_entry(job.explainer)
    none = [None] * len(job.seeds)
    optional = [job.get(name, none) for name in ("embeddings", "uncertainty", "uncertainty_timings")]
    files = zip(job.registrations, *optional, job.input_timings, strict=True)
    for (seed, predictions, timings), inputs in zip(job.per_seed("predictions", "timings"), files, strict=True):
        explainer = entry.make(job.source, seed, **job.settings)
        with record_provenance([predictions, timings], [path for path in inputs if path], job.settings, seed=seed):
            axes = (job.get("files_of", job.source), job.get("files_seed", seed))
            registrations = _load(entry, axes, *inputs)
            observed = registrations if entry.oracle else registrations.without_labels()
            started = perf_counter()
            if isinstance(explainer, Describing):  # once, for training and for explanation
                observed = explainer.describe(observed)
            describing_seconds = (perf_counter() - started) / len(observed)
            train = registrations.rows("train")
            if len(train):  # a design may cover the test samples alone; what reads it learns nothing
                explainer.fit(replace(registrations, attached=observed.attached).subset(train))
            attribution = explainer.explain(observed)
            write_predictions(predictions, registrations, attribution)
            write_timings(
                timings,
                registrations,
                registrations.attached["earlier_seconds"] + describing_seconds + attribution.seconds_N,
                registrations.attached["earlier_icp_seconds"] + attribution.icp_seconds_N,
            )


def _load(
    entry: ExplainerEntry,
    axes: Axes,
    registrations: Path,
    embeddings: Path,
    uncertainty: Path,
    uncertainty_timings: Path,
    timings: Path,
) -> Registrations:
    """Return the registrations that the explainer gets, with what it reads and the seconds spent before attached."""
    loaded = Registrations.load(registrations, axes)
    seconds_S, icp_seconds_S = read_timings(timings, loaded)
    attached = {"earlier_seconds": seconds_S, "earlier_icp_seconds": icp_seconds_S}
    if entry.design:
        outcomes = Outcomes.load(uncertainty, axes)
        conditions = outcomes.uncertainty.shape[1]
        if entry.design in CONDITIONS and conditions != len(CONDITIONS[entry.design]):
            fault = f"{conditions} conditions are not those of design '{entry.design}'"
            raise InputError(uncertainty, fault, REGENERATE)
        return outcomes.attach_to(replace(loaded, attached=attached), *read_seconds(uncertainty_timings, outcomes))
    if entry.reads == "embeddings":
        attached |= read_embedding(embeddings, loaded, logits=True)
    return replace(loaded, attached=attached)
