"""The files of a run that readings read, the values that they give, and the step that runs a group of readings."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.attribution.diagnostics import aurc, calibration_error, rank_correlation
from gpca.attribution.metrics import concept_accuracy
from gpca.attribution.predictions import read_predictions
from gpca.errors import InputError
from gpca.evaluation.measures import ALL, TIDY_COLUMNS, read_all_metrics, source_method_seed, write_metrics
from gpca.jobs.job import Job
from gpca.jobs.provenance import record_provenance
from gpca.pairs.dataset import Registrations, read_embedding
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.shifted_sets import ShiftedSets
from gpca.process.registry import load
from gpca.seeds import seed_of_file
from gpca.settings import fields_of
from gpca.steps.readings.groups import GROUPS, Reading, ReadingSizes, name_of, readings_of
from gpca.uncertainty.settings import UncertaintySettings

Values = dict[tuple[str, str], float]  # (metric, concept) -> value, named as in published.csv
Row = tuple[Reading, str, str, int, Values]  # reading, source, method, seed, values
Files = Mapping[tuple, Path]


@dataclass(frozen=True)
class RunFiles:
    """Paths of a run's files."""

    registrations: Files = field(default_factory=dict)  # by source and seed
    sets: Files = field(default_factory=dict)
    predictions: Files = field(default_factory=dict)  # by source, method and seed
    embeddings: Files = field(default_factory=dict)
    retrained: Files = field(default_factory=dict)  # by severities, source and seed
    settings: Mapping[str, dict] = field(default_factory=dict)  # sections of the config by name
    sizes: ReadingSizes = field(default_factory=ReadingSizes)

    def section(self, name: str) -> dict:
        """A section of the settings; an absent one is empty."""
        return self.settings.get(name) or {}

    def uncertainty(self) -> UncertaintySettings:
        runs = fields_of(self.section("uncertainty"), UncertaintySettings)
        return UncertaintySettings(**runs, icp=ICPSettings(**self.section("icp")))

    def loaded(self) -> Iterator[tuple[str, int, Registrations]]:
        """Source, seed and registrations of each file of these."""
        for (source, seed), path in self.registrations.items():
            yield source, seed, Registrations.load(path, (source, seed))

    def in_distribution(self) -> Iterator[tuple[str, int, Registrations, np.ndarray]]:
        """Source, seed, samples like those of the training with their embeddings, and distances (S,) of the test's."""
        for (source, seed), path in self.sets.items():
            sets = ShiftedSets.load(path, (source, seed))
            yield source, seed, like_the_training(sets), sets.distance[sets.rows("in_distribution", "test"), 0]

    def embedded(self, source: str, method: str, seed: int) -> Registrations:
        """Registrations with the embeddings of a ``{backbone}-{reduction}``."""
        registrations = Registrations.load(self.registrations[source, seed], (source, seed))
        return replace(registrations, attached=read_embedding(self.embeddings[source, method, seed], registrations))

    def predicted(self, source: str, method: str, seed: int) -> np.ndarray:
        """Concepts (S,) that a method names for the test samples."""
        rows = read_predictions(self.predictions[source, method, seed])
        return rows.loc[rows["split"] == "test", "concept_predicted"].to_numpy()


KEYS: dict[str, Callable[[Path], tuple]] = {  # kind of file -> its key in RunFiles
    "registrations": lambda path: source_method_seed(path)[1:],
    "sets": lambda path: source_method_seed(path)[1:],
    "predictions": source_method_seed,
    "embeddings": lambda path: (path.parts[-4], "-".join(path.parts[-3:-1]), seed_of_file(path)),
    "retrained": source_method_seed,
}


def run(job: Job) -> None:
    """Values of the printed numbers' counterparts under every reading of one group."""
    import pandas as pd

    group, choices = GROUPS[job.group], job.section("choices")
    files: dict[str, Any] = {kind: {KEYS[kind](path): path for path in job.files(kind)} for kind in group.reads}
    inputs = [path for paths in files.values() for path in paths.values()]
    with record_provenance([job.out], inputs, job.settings):
        readings = readings_of({name: choices[name] for name in group.choices})
        run_files = RunFiles(**files, settings=job.settings, sizes=ReadingSizes(**job.section("sizes")))
        records = [
            (name_of(job.group, reading), source, method, metric, concept, seed, value)
            for reading, source, method, seed, values in load(group.code)(run_files, readings)
            for (metric, concept), value in values.items()
        ]
        if not records:
            remedy = f"raise registrations.train, or real_world.train, or set readings.groups.{job.group} to false"
            raise InputError(f"readings of {job.group}", "need more training samples than the run has", remedy)
        write_metrics(pd.DataFrame(records, columns=list(TIDY_COLUMNS)), job.out)


def join(job: Job) -> None:
    """Join the files of a group that has a job for each of its parts."""
    with record_provenance([job.out], job.paths, job.settings):
        write_metrics(read_all_metrics(job.paths), job.out)


def like_the_training(sets: ShiftedSets) -> Registrations:
    """Training samples of the source's encoder and the test samples like them, with their embeddings."""
    return sets.registrations((sets.set == "in_distribution").nonzero()[0])


def train_and_test(registrations: Registrations) -> list[Registrations]:
    return [registrations.subset(registrations.rows(split)) for split in ("train", "test")]


def accuracies(true_S: np.ndarray, scores_S_C: np.ndarray) -> Values:
    """Accuracy over all samples, and over those of each concept."""
    return accuracies_of_named(true_S, np.array(CONCEPTS)[scores_S_C.argmax(axis=1)])


def accuracies_of_named(true_S: np.ndarray, named_S: np.ndarray) -> Values:
    by_concept = concept_accuracy(true_S, named_S, np.zeros(len(true_S), bool), CONCEPTS)
    return {("accuracy", concept): value for concept, value in by_concept.items()}


def table5(true_S: np.ndarray, scores_S_C: np.ndarray, distance_S: np.ndarray) -> Values:
    return accuracies(true_S, scores_S_C) | diagnostics_of_scores(true_S, scores_S_C, distance_S)


def diagnostics_of_scores(true_S: np.ndarray, scores_S_C: np.ndarray, distance_S: np.ndarray) -> Values:
    """ρ, AUC and ECE of the uncertainty 1 - max ŝ."""
    target_S = np.array([CONCEPTS.index(concept) for concept in true_S])
    confidence_S = scores_S_C.max(axis=1)
    return {
        ("rho_max_score_knn_analytical", ALL): rank_correlation(1 - confidence_S, distance_S),
        ("aurc_max_score", ALL): aurc(confidence_S, scores_S_C.argmax(axis=1) != target_S),
        ("ece", ALL): calibration_error(scores_S_C, target_S),
    }
