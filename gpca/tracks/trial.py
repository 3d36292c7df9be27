"""Lets a method learn from the training samples of a track and explain the test samples, as a run does."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any, NamedTuple, Self

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import Causes
from gpca.causes.settings import SCANS, DescriptorSettings
from gpca.classifier.scores import Attribution
from gpca.encoders.registry import EncoderSettings
from gpca.experiments.scan_causes import diagnosis_settings
from gpca.explainers.interface import BARE, EMBEDDINGS, REENACTED, ExplainerEntry
from gpca.explainers.registry import explainer_entry, make_rivals, require_settings
from gpca.frames.source import REAL_WORLD
from gpca.jobs.job import Job
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.process.progress import progress
from gpca.reenactment.settings import ReenactmentSettings
from gpca.settings import read_settings
from gpca.steps.control_samples import HARD, HARD_REENACTMENTS, ControlSettings
from gpca.steps.controls import ControlRun, read_hard
from gpca.steps.diagnosis import DESCRIBED, explained, frames_to_explain
from gpca.steps.learning_curve import CurveSettings
from gpca.steps.scan_causes import diagnose as diagnose_scans
from gpca.tracks.published import NOTHING_NAMED, Method, label_numbers, predicted
from gpca.tracks.samples import TrackSamples
from gpca.tracks.track import CAUSES_TRACK, FRAMES_TRACK, HARD_TRACK, SCANS_TRACK, TRACKS
from gpca.uncertainty.settings import UncertaintySettings

# Changes of the samples on which a method is tried before all are made: enough of each label, at little cost.
TEN = 10
FEW = {"train": 30, "test": TEN, "several": [0, 1], "clean_pairs": 20, "candidates": 200, "points": [128, 256]}
# By an explainer's reads.
FOLDERS = {REENACTED: "reenactments", EMBEDDINGS: "cause_embeddings", DESCRIBED: "descriptors"}


class PartPredictions(NamedTuple):
    """A method's predictions for the n test samples of a part."""

    scores: np.ndarray  # (n, C)
    named: np.ndarray  # (n,) numbers of the predicted labels
    calls: float  # mean runs of ICP beyond the explained one
    seconds: float  # of explaining, per registration; for depth frames and scans with learning

    @classmethod
    def of(cls, attribution: Attribution, labels: Sequence[str], seconds: float, rows: Any = slice(None)) -> Self:
        """Return those in rows of an attribution."""
        calls = float(attribution.icp_calls_N[rows].mean())
        return cls(attribution.scores_N_C[rows], label_numbers(attribution.predicted_N[rows], labels), calls, seconds)


class MethodTrial(NamedTuple):
    """A method on a track."""

    samples: TrackSamples
    name: str
    entry: ExplainerEntry
    settings: dict[str, Any]


@dataclass(frozen=True)
class FewSamples(TrackSamples):
    """Forty small samples of the last source and the first seed, ten of them to be answered."""

    whole: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def config(self) -> dict[str, Any]:
        """The config of the track's run with `FEW` samples, of `hard` as well, which need not be matched."""
        controls, causes = self.whole["controls"], self.whole["causes"] | FEW
        hard = {key: value for key, value in controls["hard"].items() if key not in (*FEW, "matched")}
        return {**self.whole, "causes": causes, "controls": controls | {"hard": hard}}

    def parts(self) -> list[tuple[str, int, np.ndarray]]:
        """Return the only part."""
        return [(list(self.whole["sources"])[-1], self.whole["seeds"][0], np.arange(TEN))]


def try_on_few(samples: TrackSamples, name: str, entry: ExplainerEntry, settings: Mapping[str, Any]) -> None:
    """Let a method learn and answer before all samples are made; on frames and scans, those of the track of causes."""
    track, explain = (samples.track, _hard) if samples.track.name == HARD_TRACK else (TRACKS[CAUSES_TRACK], _causes)
    if entry.further:  # which takes thousands of samples
        return
    print(f"{name}: a first try on ten samples", file=sys.stderr)
    with TemporaryDirectory() as folder:
        published = replace(samples.published, hashes={})
        few = FewSamples(track, published, Path(folder), samples.processes, whole=samples.config)
        [(source, seed, _)] = few.parts()
        explain(MethodTrial(few, name, entry, dict(settings)), source, seed)


def try_method(samples: TrackSamples, name: str, settings: Mapping[str, Any]) -> tuple[Method, float]:
    """Return an explainer's predictions for all test samples of a track, and its seconds for each without inputs."""
    track, rows = samples.track, samples.published.rows
    require_settings(name, settings, track.kind, reenacted=track.name == HARD_TRACK)
    entry = explainer_entry(name, track.kind)
    parts = samples.parts()
    files = [track.file(source, seed) for source, seed, _ in parts]
    if not all((samples.folder / file).is_file() for file in files):
        try_on_few(samples, name, entry, settings)
    samples.files(files)  # together, so that several are made at once
    trial = MethodTrial(samples, name, entry, dict(settings))
    if track.name == SCANS_TRACK:
        answers = _scans(trial)
    else:
        explain = {CAUSES_TRACK: _causes, FRAMES_TRACK: _frames}.get(track.name, _hard)
        answers = [explain(trial, source, seed) for source, seed, _ in progress(parts, name)]
    scores_N_C, named_N = np.full((len(rows), len(track.labels)), np.nan), np.full(len(rows), NOTHING_NAMED)
    for (_, _, part_rows), answer in zip(parts, answers, strict=True):
        scores_N_C[part_rows], named_N[part_rows] = answer.scores, answer.named
    calls = round(float(np.mean([answer.calls for answer in answers])))
    seconds = float(np.mean([answer.seconds for answer in answers]))
    return Method(name, entry.title, entry.sight, calls, scores_N_C, named_N), seconds


def _causes(trial: MethodTrial, source: str, seed: int) -> PartPredictions:
    samples, entry = trial.samples, trial.entry
    [path] = samples.files([samples.track.file(source, seed)])
    causes, diagnosis = Causes.load(path, (source, seed)), samples.config["diagnosis"]

    def read_of(each: str) -> Path:
        folder = "causes" if entry.reads == BARE else FOLDERS.get(entry.reads, FOLDERS[DESCRIBED])
        return samples.files([f"{folder}/{each}/seed{seed}.npz"])[0]

    descriptors = DescriptorSettings(**diagnosis["descriptors"])
    reenactment = read_settings(ReenactmentSettings, diagnosis["reenactment"])
    sources = dict.fromkeys(part for part, _, _ in samples.parts() if part != source and entry.reads != EMBEDDINGS)
    others = [(samples.files([f"causes/{each}/seed{seed}.npz"])[0], read_of(each)) for each in sources]
    learned = others, _further(samples) if entry.further else []
    attribution = explained(entry, trial.settings, causes, path, read_of(source), descriptors, reenactment, *learned)
    seconds = float(attribution.seconds_N.mean())
    return PartPredictions.of(attribution, samples.track.labels, seconds, causes.rows("test"))


def _hard(trial: MethodTrial, source: str, seed: int) -> PartPredictions:
    samples, config = trial.samples, trial.samples.config
    reads = trial.entry.reads
    sources = [source] if reads == EMBEDDINGS else dict.fromkeys(part for part, _, _ in samples.parts())
    paths = samples.files([samples.track.file(each, seed) for each in sources])
    enacted = [f"{HARD_REENACTMENTS}/{each}/seed{seed}.npz" for each in sources] if reads == REENACTED else []
    all_hard = read_hard(paths, samples.files(enacted), seed)
    hard, embeddings = all_hard.pop(source), {}
    if reads == EMBEDDINGS:
        [read] = samples.files([f"control_embeddings/{HARD}/{source}/seed{seed}.npz"])
        embeddings = read_embedding(read, hard, logits=True)
    controls = {key: value for key, value in config["controls"].items() if key not in ("explainers", "hard")}
    runs = {key: value for key, value in config["uncertainty"].get("removal", {}).items() if key != "samples"}
    run = ControlRun(
        source=source,
        seed=seed,
        settings=read_settings(ControlSettings, controls | {"controls": [HARD]}),
        backbone=EncoderSettings(**config["encoders"][config["embedding"]["encoder"]]).backbone,
        uncertainty=UncertaintySettings(**runs, icp=ICPSettings(**config["registrations"]["icp"])),
        rivals=make_rivals({trial.name: trial.settings}, source, seed),
        embed=_never,
        embeddings={HARD: embeddings},
        hard=hard,
        other_hard=list(all_hard.values()),
    )
    attribution, seconds = run.explain_hard(trial.name)
    return PartPredictions.of(attribution, samples.track.labels, seconds)


def _never(_registrations: Registrations, _source: str) -> tuple[np.ndarray, np.ndarray]:
    raise AssertionError("hard samples are embedded by an encoder of their own")


def _frames(trial: MethodTrial, source: str, seed: int) -> PartPredictions:
    samples, config, reads = trial.samples, trial.samples.config, trial.entry.reads
    [path] = samples.files([samples.track.file(source, seed)])
    folders, enacted = {"causes": "causes", "descriptors": "descriptors"}, None
    if reads == EMBEDDINGS:
        folders |= {"encoders": "cause_encoders", EMBEDDINGS: FOLDERS[EMBEDDINGS]}
    if reads == REENACTED:
        folders |= {REENACTED: FOLDERS[REENACTED]}
        [enacted] = samples.files([f"reenactments/{REAL_WORLD}/seed{seed}.npz"])
    job = Job(source=source, seed=seed, settings={**config["diagnosis"], "icp": config["registrations"]["icp"]})
    causes = Causes.load(path, (source, seed))
    learned = _training_files(samples, folders, seed)
    learned["further"] = _further(samples) if trial.entry.further else []
    frames = frames_to_explain(job, causes, enacted, learned)
    frames.prepare(trial.name)
    started = perf_counter()
    attribution = frames.attribution(trial.name, trial.settings)
    assert attribution is not None  # objects have all labels
    return PartPredictions.of(attribution, samples.track.labels, (perf_counter() - started) / len(causes))


def _scans(trial: MethodTrial) -> list[PartPredictions]:
    """Return those for each data set; the data sets of a seed are learned and explained together, by a run's step."""
    samples, reads, parts = trial.samples, trial.entry.reads, trial.samples.parts()
    settings = diagnosis_settings(samples.config, {trial.name: [SCANS]}, {trial.name: trial.settings})
    folders = {"encoders": "cause_encoders"} if reads == EMBEDDINGS else {}
    answers = {}
    for seed in dict.fromkeys(seed for _, seed, _ in parts):
        sets = [source for source, of, _ in parts if of == seed]
        kinds = ("scan_causes", "scan_descriptors", "scan_reenactments")
        files = {kind: samples.files(f"{kind}/{each}/seed{seed}.npz" for each in sets) for kind in kinds}
        files |= _training_files(samples, folders, seed)
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"seed{seed}.csv"
            job = Job(source="scans", seed=seed, settings=settings, predictions=path, **files)
            started = perf_counter()
            diagnose_scans(job)
            seconds = perf_counter() - started
            all_rows = read_predictions(path, labels=samples.track.labeled_by)
        for source in sets:
            rows = all_rows[all_rows["scans"] == source]
            scores_and_names, calls = predicted(rows, samples.track.labels), float(rows["icp_calls"].mean())
            answers[source, seed] = PartPredictions(*scores_and_names, calls, seconds / len(all_rows))
    return [answers[source, seed] for source, seed, _ in parts]


def _further(samples: TrackSamples) -> list[Path]:
    """Return the files of further training samples of all sources."""
    chunks = len(read_settings(CurveSettings, samples.config["learning_curve"]).chunks())
    parts = product(samples.config["sources"], range(chunks))
    return samples.files(f"learning_samples/{source}/chunk{chunk}.npz" for source, chunk in parts)


def _training_files(samples: TrackSamples, folders: Mapping[str, str], seed: int) -> dict[str, list[Path]]:
    """Return the files of all sources of objects that a method learns from, by kind."""
    files = {}
    for kind, folder in folders.items():
        name = f"seed{seed}.{'pt' if kind == 'encoders' else 'npz'}"
        files[kind] = samples.files(f"{folder}/{source}/{name}" for source in samples.config["sources"])
    return files
