"""Lets a method learn from the training samples of a track and explain the test samples, as a run does."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import Causes, labeled
from gpca.encoders.registry import EncoderSettings
from gpca.errors import InputError
from gpca.experiments.controls.protocol import ControlRun
from gpca.experiments.controls.rivals import make_rivals
from gpca.experiments.controls.settings import HARD, ControlSettings
from gpca.experiments.diagnosis.step import explained, with_what_it_reads
from gpca.experiments.frame_causes.diagnosis_step import FramesToExplain
from gpca.explainers.interface import BARE, REENACTED, ExplainerEntry
from gpca.explainers.registry import explainer_entry, require_settings
from gpca.features.settings import DescriptorSettings
from gpca.frames.source import REAL_WORLD
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.job import Job
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings
from gpca.tracks.published import NOTHING_NAMED, Method
from gpca.tracks.samples import Samples
from gpca.tracks.scans import ask
from gpca.tracks.track import CAUSES_TRACK, FRAMES_TRACK, SCANS_TRACK
from gpca.uncertainty.settings import UncertaintySettings

EMBEDDED = "embeddings"  # `reads` of explainers


@dataclass(frozen=True)
class Answer:
    """What a method said of the test samples of a part.

    Attributes:
        scores: (n, C). named: (n,) labels, empty for none.
        calls: runs of ICP beyond the one that it explains, mean.
        seconds: of explaining, for each registration; of depth frames and scans, learning counts too.
    """

    scores: np.ndarray
    named: np.ndarray
    calls: float
    seconds: float

    @classmethod
    def of(cls, attribution: Attribution, rows: np.ndarray, seconds: float) -> Answer:
        """Return the answer in rows of an attribution."""
        named_N = attribution.predicted_N[rows]
        return cls(attribution.scores_N_C[rows], named_N, float(attribution.icp_calls_N[rows].mean()), seconds)


def try_method(samples: Samples, name: str, settings: Mapping[str, Any], lesson: str = "") -> tuple[Method, float]:
    """Return what an explainer says of all test samples of a track, and its seconds for each registration.

    What it reads is measured beforehand, and its time is not counted.

    Args:
        lesson: where it learns, of a track that has a choice.

    Raises:
        InputError: unknown settings, samples that cannot be made, or a fault in the method.
    """
    track, rows = samples.track, samples.published.rows
    require_settings(name, settings, track.kind)
    entry = explainer_entry(name, track.kind)
    parts = samples.parts()
    samples.files([track.file(source, seed) for source, seed, _ in parts])  # together, for some at a time
    number = {label: place for place, label in enumerate(track.labels)}
    scores_N_C, named_N = np.full((len(rows), len(track.labels)), np.nan), np.full(len(rows), NOTHING_NAMED)
    answers = list(_answers(samples, name, entry, dict(settings), lesson))
    for (_, _, own), answer in zip(parts, answers, strict=True):
        if answer.scores.shape != (len(own), len(track.labels)) or not np.isfinite(answer.scores).all():
            fault = f"gives scores of shape {answer.scores.shape}, or such as are no finite numbers"
            remedy = f"give one of {', '.join(track.labels)} for each of the {len(own)} registrations"
            raise InputError(f"explainer '{name}'", fault, remedy)
        scores_N_C[own] = answer.scores
        named_N[own] = [number.get(label, NOTHING_NAMED) for label in answer.named]
    calls = round(float(np.mean([answer.calls for answer in answers])))
    seconds = float(np.mean([answer.seconds for answer in answers]))
    name, title = (track.with_lesson(text, lesson) for text in (name, entry.title))
    return Method(name, title, entry.sight, calls, scores_N_C, named_N), seconds


def _answers(samples: Samples, name: str, entry: ExplainerEntry, settings: dict, lesson: str) -> Iterator[Answer]:
    """Yield the answer of each part."""
    if samples.track.name == SCANS_TRACK:
        yield from _scans(samples, name, entry, settings, lesson)
        return
    try_part = {CAUSES_TRACK: _causes, FRAMES_TRACK: _frames}.get(samples.track.name, _hard)
    for source, seed, _ in samples.parts():
        yield try_part(samples, name, entry, settings, source, seed)


def _causes(samples: Samples, name: str, entry: ExplainerEntry, settings: dict, source: str, seed: int) -> Answer:
    [path] = samples.files([samples.track.file(source, seed)])
    causes, diagnosis = Causes.load(path, (source, seed)), samples.config["diagnosis"]
    registrations = labeled(causes)
    if entry.reads != BARE:
        folder = {EMBEDDED: "cause_embeddings", REENACTED: "reenactments"}.get(entry.reads, "descriptors")
        [read] = samples.files([f"{folder}/{source}/seed{seed}.npz"])
        registrations = with_what_it_reads(registrations, entry, read)
    remedies, reenactment = DescriptorSettings(**diagnosis["descriptors"]), diagnosis["reenactment"]
    explainer = entry.make(source, seed, **settings)
    attribution = explained(
        explainer, entry, registrations, causes, remedies, path, read_settings(ReenactmentSettings, reenactment)
    )
    return Answer.of(attribution, causes.rows("test"), float(attribution.seconds_N.mean()))


def _hard(samples: Samples, name: str, entry: ExplainerEntry, settings: dict, source: str, seed: int) -> Answer:
    [path] = samples.files([samples.track.file(source, seed)])
    config = samples.config
    hard = Registrations.load(path, (source, seed))
    embeddings: dict[str, np.ndarray] = {}
    if entry.reads == EMBEDDED:
        [read] = samples.files([f"control_embeddings/{HARD}/{source}/seed{seed}.npz"])
        embeddings = read_embedding(read, hard, logits=True)
    own = {key: value for key, value in config["controls"].items() if key not in ("explainers", "hard")}
    runs = {key: value for key, value in config["uncertainty"].get("removal", {}).items() if key != "samples"}
    run = ControlRun(
        source=source,
        seed=seed,
        settings=read_settings(ControlSettings, own | {"controls": [HARD]}),
        backbone=EncoderSettings(**config["encoders"][config["embedding"]["encoder"]]).backbone,
        uncertainty=UncertaintySettings(**runs, icp=ICPSettings(**config["registrations"]["icp"])),
        rivals=make_rivals({name: settings}, source, seed),
        embed=_never,
        embeddings={HARD: embeddings},
        hard=hard,
    )
    attribution, seconds = run.of_hard(name)
    return Answer.of(attribution, np.arange(len(attribution.scores_N_C)), seconds)


def _never(_registrations: Registrations, _source: str) -> tuple[np.ndarray, np.ndarray]:
    raise AssertionError("hard samples are embedded by an encoder of their own")


def _frames(samples: Samples, name: str, entry: ExplainerEntry, settings: dict, source: str, seed: int) -> Answer:
    config, track = samples.config, samples.track
    [path] = samples.files([track.file(source, seed)])
    kinds = {"causes": "causes", "descriptors": "descriptors"}
    kinds |= {"encoders": "cause_encoders", EMBEDDED: "cause_embeddings"} if entry.reads == EMBEDDED else {}
    kinds |= {REENACTED: "reenactments"} if entry.reads == REENACTED else {}
    lessons: dict[str, list[Path]] = {
        kind: samples.files(
            f"{folder}/{of}/seed{seed}.{'pt' if kind == 'encoders' else 'npz'}" for of in config["sources"]
        )
        for kind, folder in kinds.items()
    }
    enacted = None
    if entry.reads == REENACTED:
        [enacted] = samples.files([f"reenactments/{REAL_WORLD}/seed{seed}.npz"])
    job = Job(source=source, seed=seed, settings={**config["diagnosis"], "icp": config["registrations"]["icp"]})
    causes = Causes.load(path, (source, seed))
    asked = FramesToExplain(job, causes, enacted, lessons)
    asked.prepare(name)
    started = perf_counter()
    attribution = asked.attribution(name, settings)
    seconds = (perf_counter() - started) / len(causes)
    return Answer.of(attribution, np.arange(len(causes)), seconds)


def _scans(samples: Samples, name: str, entry: ExplainerEntry, settings: dict, lesson: str) -> Iterator[Answer]:
    """Yield the answer for each data set; all of a seed are asked about, and learned from, together."""
    parts = samples.parts()
    said = {
        seed: ask(samples, name, entry, settings, lesson, seed, [source for source, of, _ in parts if of == seed])
        for seed in dict.fromkeys(seed for _, seed, _ in parts)
    }
    for source, seed, _ in parts:
        rows = said[seed].by_set[source]
        scores_n_4 = rows[[f"score_{label}" for label in samples.track.labels]].to_numpy(float)
        named_n = np.where(rows["abstained"], "", rows["concept_predicted"].to_numpy(str))
        yield Answer(scores_n_4, named_n, float(rows["icp_calls"].mean()), said[seed].seconds)
