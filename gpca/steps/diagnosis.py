"""The steps of diagnoses: explainers of causes on held-out objects, on parts of what is read, and on depth frames."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import prediction_frame, read_timings, write_predictions, write_timings
from gpca.causes.dataset import LABELS, Causes, labeled, observed_only
from gpca.causes.descriptors import Descriptors, describe_all
from gpca.causes.settings import DescriptorSettings
from gpca.causes.truth import BORDERLINE
from gpca.classifier.scores import Attribution
from gpca.encoders.registry import EncoderSettings
from gpca.errors import InputError
from gpca.explainers.interface import BARE, REENACTED, ConceptExplainer, ExplainerEntry, icp_calls
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.io.csv_file import write_csv
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.reenactment.dataset import Reenactments, reenactment_features
from gpca.reenactment.settings import ReenactmentSettings
from gpca.seeds import seed_of_file

EMBEDDED, DESCRIBED = "embeddings", "descriptors"  # `reads` of explainers; all but these and `REENACTED` need neither


def diagnose(job: Job) -> None:
    """Fit an explainer on training rows with a label and explain every row, seed by seed -> its predictions."""
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


def diagnose_by_features(job: Job) -> None:
    """Let learners that see more and more of a pair learn and explain, seed by seed -> their predictions."""
    remedies = DescriptorSettings(**job.section("descriptors"))
    own = {(path.parts[-2], seed_of_file(path)): path for path in job.predictions}
    with record_provenance(job.predictions, [*job.causes, *job.descriptors], job.settings):
        for seed, causes_file, descriptors in job.per_seed("causes", "descriptors"):
            causes = Causes.load(causes_file, (job.source, seed))
            for name, settings in job.section("by_features").items():
                entry = explainer_entry(name, CAUSES)
                explainer = entry.make(job.source, seed, **(settings or {}))
                registrations = with_what_it_reads(labeled(causes), entry, descriptors)
                attribution = explained(explainer, entry, registrations, causes, remedies, causes_file)
                write_predictions(own[name, seed], causes.registrations, attribution)


def diagnose_frames(job: Job) -> None:
    """Ask every explainer about the causes of registrations of depth frames -> their predictions.

    They have learned from registrations whose causes were drawn, those of all sources, and from no frame.
    """
    import pandas as pd

    learned = {"causes": job.causes, DESCRIBED: job.descriptors, "encoders": job.encoders, EMBEDDED: job.embeddings}
    learned |= {REENACTED: job.get("reenactments", [])}  # only where an explainer reads them
    enacted = job.get("frame_reenactments")
    read = [job.frame_causes, *([enacted] if enacted else [])]
    inputs = read + [path for paths in learned.values() for path in paths]
    with record_provenance([job.predictions], inputs, job.settings, seed=job.seed):
        causes = Causes.load(job.frame_causes, (job.source, job.seed))
        frames = FramesToExplain(job, causes, enacted, learned)
        predictions = []
        for name, settings in job.section("explainers").items():
            attribution = frames.attribution(name, settings or {})
            predictions.append(prediction_frame(causes.registrations, attribution).assign(explainer=name))
        write_csv(job.predictions, pd.concat(predictions))


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

    The registrations have labels, and what it reads attached; `causes`, of the file `path`, are the same ones.
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


class World(ABC):
    """Registrations that explainers which learned from objects are asked about: in depth frames, or of scans.

    Diagnosis of held-out objects is :func:`diagnose`: there one file has training and test rows. An implementation for
    another world provides what its explainers read of its registrations but embeddings (:meth:`_read`), and from whom
    an explainer learns (its method ``attribution``).

    Args:
        files: of all sources of objects, by what explainers read, and their encoders.
        registrations: those of this world, with labels.
        starts: runs of each from other starts.
    """

    def __init__(self, job: Job, files: dict[str, list[Path]], registrations: Registrations, starts: int) -> None:
        self._axes, self._files, self._registrations = (job.source, job.seed), files, registrations
        self._encoder = EncoderSettings(**job.section("encoder"))
        self._descriptors = DescriptorSettings(**job.section("descriptors"))
        calls = ReenactmentSettings(**job.section("reenactment")).calls(starts)
        self._calls = partial(icp_calls, starts=starts, descriptors=self._descriptors, reenactment=calls)
        self._prepared: dict[tuple[str, bool], list[tuple[Registrations, Registrations]]] = {}

    @abstractmethod
    def _read(self, reads: str) -> Registrations:
        """Return the registrations with their descriptors or re-enactments attached."""

    def _sets(self, entry: ExplainerEntry, from_objects: bool = True) -> list[tuple[Registrations, Registrations]]:
        """Return what an explainer learns from, and the registrations it is asked about; the same twice if not objects.

        Descriptors and re-enactments of all sources are one set; embeddings are by an encoder for each source.
        """
        reads = entry.reads if entry.reads in (EMBEDDED, REENACTED) else DESCRIBED
        if (reads, from_objects) not in self._prepared:
            entry = explainer_entry("gpca_pair", CAUSES) if reads == DESCRIBED else entry
            learned = []
            for path, read in zip(self._files["causes"], self._files[reads], strict=True) if from_objects else ():
                registrations = with_what_it_reads(labeled(Causes.load(path)), entry, read)
                learned.append(registrations.subset(training_rows(registrations, path)))
            asked = self._embedded(learned) if reads == EMBEDDED else [self._read(reads)]
            if reads != EMBEDDED and from_objects:
                learned = [Registrations.joined(learned)]
            self._prepared[reads, from_objects] = list(zip(learned or asked, asked, strict=True))
        return self._prepared[reads, from_objects]

    def _embedded(self, learned: list[Registrations]) -> list[Registrations]:
        """Return the registrations with embeddings by the encoder of each source of objects."""
        from gpca.encoders.training import embed, load_model

        observed, embedded = observed_only(self._registrations), []
        axes = [part.axes for part in learned] or [None] * len(self._files["encoders"])
        for weights, trained_on in zip(self._files["encoders"], axes, strict=True):
            model = load_model(weights, self._encoder, LABELS, trained_on)
            h_S_d, logits_S_C = embed(model, observed, *self._axes, self._encoder)
            attached = {**self._registrations.attached, "embedding": h_S_d, "head_logits": logits_S_C}
            embedded.append(replace(self._registrations, attached=attached))
        return embedded

    def _mean(self, entry: ExplainerEntry, attributions: list[Attribution]) -> Attribution:
        """Return the mean of the scores over all sets, with the runs of ICP that the explainer needs."""
        return Attribution.of_scores(
            LABELS,
            np.mean([each.scores_N_C for each in attributions], axis=0),
            seconds=0.0,
            icp_calls=self._calls(entry.sees),
            abstained_N=np.all([each.abstained_N for each in attributions], axis=0),
        )


class FramesToExplain(World):
    """Registrations of frames to be explained, and their re-enactments; see :class:`World`."""

    def __init__(self, job: Job, causes: Causes, enacted: Path | None, learned: dict[str, list[Path]]) -> None:
        super().__init__(job, learned, labeled(causes), causes.T_target_source_runs.shape[1])
        self._causes, self._enacted = causes, enacted
        self._icp = ICPSettings(**job.section("icp"))

    def prepare(self, name: str) -> None:
        """Measure what an explainer reads, once for all that read the same."""
        self._sets(explainer_entry(name, CAUSES))

    def attribution(self, name: str, settings: dict) -> Attribution:
        """Return the mean of the scores over all that the explainer learns from."""
        entry = explainer_entry(name, CAUSES)
        attributions = []
        for learned, frames in self._sets(entry):
            explainer = entry.make(*self._axes, **settings)
            explainer.fit(learned)
            attributions.append(explainer.explain(observed_only(frames)))
        return self._mean(entry, attributions)

    def _read(self, reads: str) -> Registrations:
        if reads == DESCRIBED:
            described, _, _ = describe_all(self._causes, *self._axes, self._descriptors, self._icp)
            read = described.groups
        else:
            assert self._enacted is not None
            enacted = Reenactments.load(self._enacted, self._registrations)
            read = {"verdict": enacted.verdict, "reenactment": reenactment_features(enacted)}
        return replace(self._registrations, attached={**self._registrations.attached, **read})
