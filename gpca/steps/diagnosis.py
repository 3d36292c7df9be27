"""The steps of diagnoses: explainers of causes on held-out objects, on parts of what is read, and on depth frames."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import prediction_frame, read_timings, write_predictions, write_timings
from gpca.causes.dataset import LABELS, Causes, labeled, observed_only
from gpca.causes.descriptors import Descriptors, LabeledSamples, describe_all, joined_without
from gpca.causes.settings import OBJECTS, DescriptorSettings
from gpca.causes.truth import BORDERLINE
from gpca.classifier.scores import Attribution
from gpca.encoders.registry import EncoderSettings
from gpca.errors import InputError
from gpca.explainers import interface
from gpca.explainers.registry import CAUSES, explainer_entry
from gpca.io.csv_file import write_csv
from gpca.io.frame import Frame
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.reenactment.dataset import Reenactments, reenactment_features
from gpca.reenactment.settings import ReenactmentSettings
from gpca.seeds import seed_of_file

DESCRIBED = "descriptors"  # `reads` of explainers; all but these, `EMBEDDINGS` and `REENACTED` need nothing else
FEWEST_LABELS = 2  # among the samples that an explainer learns from


def diagnose(job: Job) -> None:
    """Fit an explainer on training rows with a label and explain every row, seed by seed -> its predictions."""
    entry = explainer_entry(job.explainer, CAUSES)
    remedies = DescriptorSettings(**json.loads(job.remedies))
    reenactment = ReenactmentSettings(**json.loads(job.reenactment))
    files = ("causes", "read", "read_timings", "predictions", "timings")
    others, further = _others(job), job.get("further", [])
    for seed, path, read, read_timing, predictions, timings in job.per_seed(*files):
        inputs = [path, read, read_timing, *(file for pair in others[seed] for file in pair), *further]
        with record_provenance([predictions, timings], inputs, job.settings, seed=seed):
            causes = Causes.load(path, (job.source, seed))
            seconds_S, icp_seconds_S = read_timings(read_timing, causes.registrations)
            learned = others[seed], further
            attribution = explained(entry, job.settings, causes, path, read, remedies, reenactment, *learned)
            write_predictions(predictions, causes.registrations, attribution)
            write_timings(timings, causes.registrations, seconds_S + attribution.seconds_N, icp_seconds_S)


def diagnose_by_features(job: Job) -> None:
    """Let learners that see more and more of a pair learn and explain, seed by seed -> their predictions."""
    remedies = DescriptorSettings(**job.section("descriptors"))
    own, others = {(path.parts[-2], seed_of_file(path)): path for path in job.predictions}, _others(job)
    inputs = [*job.causes, *job.descriptors, *(file for pairs in others.values() for pair in pairs for file in pair)]
    with record_provenance(job.predictions, inputs, job.settings):
        for seed, path, descriptors in job.per_seed("causes", "descriptors"):
            causes = Causes.load(path, (job.source, seed))
            for name, settings in job.section("by_features").items():
                entry = explainer_entry(name, CAUSES)
                attribution = explained(entry, settings or {}, causes, path, descriptors, remedies, others=others[seed])
                write_predictions(own[name, seed], causes.registrations, attribution)


def _others(job: Job) -> dict[int, list[tuple[Path, Path]]]:
    """Return the causes of the other sources and what is read of them, by seed."""
    others: dict[int, list[tuple[Path, Path]]] = {seed: [] for seed in map(int, job.seeds)}
    for path, read in zip(job.get("all_causes", []), job.get("all_read", []), strict=True):
        if path.parent.name != job.source:
            others[seed_of_file(path)].append((path, read))
    return others


def diagnose_frames(job: Job) -> None:
    """Ask explainers that learned from all sources about the causes of registrations of depth frames -> predictions."""
    learned, enacted = learned_files(job), job.get("frame_reenactments")
    inputs = [job.frame_causes, *filter(None, [enacted]), *(path for paths in learned.values() for path in paths)]
    with record_provenance([job.predictions], inputs, job.settings, seed=job.seed):
        causes = Causes.load(job.frame_causes, job.axes)
        frames = frames_to_explain(job, causes, enacted, learned)
        write_csv(job.predictions, frames.predictions(job.section("explainers"), causes.registrations))


def learned_files(job: Job) -> dict[str, list[Path]]:
    """Return the files that explainers learn from, those of all sources of objects, by what explainers read of them."""
    return {
        name: job.get(name, [])
        for name in ("causes", DESCRIBED, interface.REENACTED, "encoders", interface.EMBEDDINGS, "further")
    }


def explained(
    entry: interface.ExplainerEntry,
    settings: dict[str, Any],
    causes: Causes,
    path: Path,
    read: Path | None,
    remedies: DescriptorSettings,
    reenactment: ReenactmentSettings | None = None,
    others: Iterable[tuple[Path, Path | None]] = (),
    further: Iterable[Path] = (),
) -> Attribution:
    """Let an explainer learn from the training rows and explain all, and count the runs of ICP that it needs.

    `read` has what it reads of the file `path`; of `others`, families that are not tested are learned from too.
    """
    explainer = entry.made(*(causes.registrations.axes or ()), **settings)
    registrations = with_what_it_reads(labeled(causes), entry.reads, read)
    learned = [registrations.subset(training_rows(registrations, path))]
    for other, other_read in others:
        part = with_what_it_reads(labeled(Causes.load(other)), entry.reads, other_read)
        learned.append(part.subset(training_rows(part, other)))
    fit(explainer, entry, learned, further, registrations.cluster[causes.rows("test")])
    starts = causes.T_target_source_runs.shape[1]
    calls = interface.icp_calls(entry.sees, starts, remedies, reenactment.calls(starts) if reenactment else 0)
    answer = interface.answer_of(explainer, observed_only(registrations), LABELS)
    return replace(answer, icp_calls_N=np.full(len(registrations), calls))


def fit(
    explainer: interface.ConceptExplainer,
    entry: interface.ExplainerEntry,
    learned: Sequence[Registrations],
    further: Iterable[Path],
    families: Sequence[str] | np.ndarray = (),
) -> None:
    """Let an explainer learn from labeled samples, perhaps from files of further ones, but of none of the families."""
    if entry.further:
        samples = [LabeledSamples.of(part) for part in learned] + [LabeledSamples.load(each) for each in further]
        explainer.fit(joined_without(families, samples))  # type: ignore[arg-type]  # descriptors and labels are all
    else:
        explainer.fit(joined_without(families, learned))


def training_rows(registrations: Registrations, path: Path) -> np.ndarray:
    rows = np.flatnonzero((registrations.split == "train") & (registrations.concept != BORDERLINE))
    if not len(rows):
        raise InputError(path, "has no training samples with a label", "raise causes.train")
    return rows


def with_what_it_reads(registrations: Registrations, reads: str, path: Path | None) -> Registrations:
    """Attach what an explainer with these `reads` needs, from its file."""
    if reads == interface.BARE or path is None:
        return registrations
    if reads == interface.EMBEDDINGS:
        read = read_embedding(path, registrations, logits=True)
    elif reads == interface.REENACTED:
        enacted = Reenactments.load(path, registrations)
        read = {"verdict": enacted.verdict, "reenactment": reenactment_features(enacted)}
        read |= {"result_error": enacted.result_error, "weight": enacted.weight}
    else:
        read = dict(Descriptors.load(path, registrations).groups)
    return replace(registrations, attached={**registrations.attached, **read})


class World:
    """Registrations that explainers are asked about which learned from objects, or from all its folds (S,) but one.

    `read` attaches what an explainer reads. With `apart`, no family of objects is learned from that is asked about.
    """

    def __init__(
        self,
        job: Job,
        files: dict[str, list[Path]],
        registrations: Registrations,
        starts: int,
        read: Callable[[str], Registrations],
        fold_S: np.ndarray | None = None,
        apart: bool = False,
    ) -> None:
        self._axes, self._files, self._registrations = job.axes, files, registrations
        self._read, self._fold_S = read, fold_S
        self._left_out = np.unique(registrations.cluster) if apart else ()
        self._encoder = EncoderSettings(**job.section("encoder"))
        descriptors = DescriptorSettings(**job.section("descriptors"))
        calls = ReenactmentSettings(**job.section("reenactment")).calls(starts)
        self._calls = partial(interface.icp_calls, starts=starts, descriptors=descriptors, reenactment=calls)
        self._prepared: dict[tuple[str, str], list[tuple[Registrations, Registrations]]] = {}

    def prepare(self, name: str, learned_from: str = OBJECTS) -> list[tuple[Registrations, Registrations]]:
        """Return what an explainer learns from, and what it is asked about; the same twice if not objects."""
        from gpca.encoders.training import embed, load_model

        reads = explainer_entry(name, CAUSES).reads
        reads = reads if reads in (interface.EMBEDDINGS, interface.REENACTED) else DESCRIBED
        if (reads, learned_from) in self._prepared:
            return self._prepared[reads, learned_from]
        learned, asked = [], []
        files = list(zip(self._files["causes"], self._files[reads], strict=True)) if learned_from == OBJECTS else []
        for path, read in files:
            registrations = with_what_it_reads(labeled(Causes.load(path)), reads, read)
            rows = training_rows(registrations, path)
            learned.append(registrations.subset(rows[~np.isin(registrations.cluster[rows], self._left_out)]))
        if reads == interface.EMBEDDINGS:
            weights = self._files["encoders"]
            encoders = list(zip(weights, [part.axes for part in learned] or [None] * len(weights), strict=True))
            if learned:  # of a dataset whose families are all asked about, nothing is left to learn from
                enough = [len(set(part.concept)) >= FEWEST_LABELS for part in learned]
                learned, encoders = list(compress(learned, enough)), list(compress(encoders, enough))
            if not encoders:
                raise InputError(name, "has nothing to learn from: all families are asked about", "raise causes.train")
            for file, trained_on in encoders:
                model = load_model(file, self._encoder, LABELS, trained_on)
                h_S_d, logits_S_C = embed(model, observed_only(self._registrations), *self._axes, self._encoder)
                attached = {**self._registrations.attached, "embedding": h_S_d, "head_logits": logits_S_C}
                asked.append(replace(self._registrations, attached=attached))
        else:
            learned, asked = [Registrations.joined(learned)] if learned else [], [self._read(reads)]
        self._prepared[reads, learned_from] = list(zip(learned or asked, asked, strict=True))
        return self._prepared[reads, learned_from]

    def predictions(self, explainers: Mapping[str, dict | None], shown: Registrations, **columns: np.ndarray) -> Frame:
        """Return the predictions of explainers that learned from objects, name -> settings, with further columns."""
        import pandas as pd

        frames = []
        for name, settings in explainers.items():
            attribution = self.attribution(name, settings or {})
            assert attribution is not None  # objects have all labels
            frames.append(prediction_frame(shown, attribution).assign(explainer=name, **columns))
        return pd.concat(frames)

    def attribution(self, name: str, settings: dict, learned_from: str = OBJECTS) -> Attribution | None:
        """Return the mean of the scores over all encoders; None where it would learn from fewer than two classes."""
        entry, all_scores, all_abstained = explainer_entry(name, CAUSES), [], []
        for training, asked in self.prepare(name, learned_from):
            parts = [(np.arange(len(asked)), training)]
            if training is asked:  # one fold is asked about, and the labeled rows of the others are learned from
                labeled_S, fold_S = asked.concept != BORDERLINE, np.asarray(self._fold_S)
                folds = [fold_S == fold for fold in np.unique(fold_S)]
                parts = [(np.flatnonzero(in_S), asked.subset(np.flatnonzero(labeled_S & ~in_S))) for in_S in folds]
            scores_S_C, abstained_S = np.empty((len(asked), len(LABELS))), np.empty(len(asked), bool)
            for rows, learned in parts:
                if self._fold_S is not None and len(np.unique(learned.concept)) < FEWEST_LABELS:
                    return None
                explainer = entry.made(*self._axes, **settings)
                others = (self._files["further"], self._left_out) if learned_from == OBJECTS else ((), ())
                fit(explainer, entry, [learned], *others)
                answer = interface.answer_of(explainer, observed_only(asked.subset(rows)), LABELS)
                scores_S_C[rows], abstained_S[rows] = answer.scores_N_C, answer.abstained_N
            all_scores.append(scores_S_C)
            all_abstained.append(abstained_S)
        scores_S_C, abstained_S = np.mean(all_scores, axis=0), np.all(all_abstained, axis=0)
        calls = self._calls(entry.sees)
        return Attribution.of_scores(LABELS, scores_S_C, icp_calls=calls, abstained_N=abstained_S)


def frames_to_explain(job: Job, causes: Causes, enacted: Path | None, learned: dict[str, list[Path]]) -> World:
    """Registrations of frames to be explained, and the file of their re-enactments."""
    registrations = labeled(causes)

    def read(reads: str) -> Registrations:
        if reads == interface.REENACTED:
            return with_what_it_reads(registrations, reads, enacted)
        descriptors, icp = DescriptorSettings(**job.section("descriptors")), ICPSettings(**job.section("icp"))
        described, _, _ = describe_all(causes, job.source, job.seed, descriptors, icp)
        return replace(registrations, attached={**registrations.attached, **described.groups})

    return World(job, learned, registrations, causes.T_target_source_runs.shape[1], read)
