"""Table VI under other readings: what varies between repeats, the cloud that the encoder sees, and other rows.

The run trains encoders that see other clouds as that of the protocol, pretrained on all sources and then on the frames
of each seed. It has the predictions of encoders as published and of ICP from estimators' poses
(``real_world.published`` and ``conditions`` of the config).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache

import numpy as np

from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.errors import InputError
from gpca.evaluation.measures import ALL
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.seeds import generator
from gpca.steps.readings.files import Row, RunFiles, Values, accuracies_of_named, rows_of, train_and_test
from gpca.steps.readings.gpc_start import gpc_scores
from gpca.steps.readings.groups import ALIGNED, Reading, ReadingSizes

Shown = tuple[np.ndarray, dict[str, np.ndarray]]  # concepts (S,) of test samples; kind of objects -> mask (S,)
SourceAndMethod = tuple[str, str]


def repeats(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of every backbone and reduction, repeat by repeat, and how concepts are confused."""
    by_seed: dict[int, Registrations] = {}
    for source, seed in run_files.registrations:
        by_seed[seed] = Registrations.load(run_files.registrations[source, seed], (source, seed))
    methods = list(dict.fromkeys(method for _, method, _ in run_files.predictions))
    first = next(iter(by_seed))
    for varied in dict.fromkeys(reading["repeats"] for reading in readings):
        wanted = [reading for reading in readings if reading["repeats"] == varied]
        for method in progress(methods, f"repeats on depth frames: {varied}"):
            for seed in by_seed:
                if varied == "everything":
                    samples = by_seed[seed]
                    named_S = run_files.predicted(source, method, seed)
                else:
                    samples = run_files.embedded(source, method, first)
                    named_S = refitted(samples, run_files.section("gpca"), varied == "samples", source, seed)
                shown = shown_samples(samples)
                for reading in wanted:
                    yield from _rows(reading, shown, named_S, source, method, seed)


def refitted(registrations: Registrations, settings: dict, drawn: bool, *axes: object) -> np.ndarray:
    """Concepts (S,) that a new classifier names, fitted to the training samples or to a draw of them.

    A draw is with replacement, of as many samples as there are (Efron 1979).
    """
    rows = registrations.rows("train")
    if drawn:
        rows = generator(*axes, "drawn samples").choice(rows, len(rows))
    gpc = GPC(CONCEPTS, GPCSettings(**settings), *axes, "repeat")
    gpc.fit(registrations.embedding[rows], registrations.concept[rows])
    scores_S_C, _, _ = gpc.attribute(registrations.embedding[registrations.rows("test")])
    return np.array(CONCEPTS)[scores_S_C.argmax(axis=1)]


def inputs(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of the backbone whose predictions are given, by the cloud that its encoder sees.

    Of the embeddings, ``{backbone}-{cloud}`` are those of its encoder that sees another cloud.
    """
    for source, method, seed in run_files.predictions:
        shown = shown_samples(Registrations.load(run_files.registrations[source, seed], (source, seed)))
        for cloud in dict.fromkeys(reading["input"] for reading in readings):
            if cloud == ALIGNED:
                named_S = run_files.predicted(source, method, seed)
            else:
                named_S = _named_from(run_files, source, f"{method.split('-')[0]}-{cloud}", seed)
            for reading in (reading for reading in readings if reading["input"] == cloud):
                yield from _rows(reading, shown, named_S, source, method, seed)


def _named_from(run_files: RunFiles, source: str, embedded: str, seed: int) -> np.ndarray:
    """Concepts (S,) that GP-CA names for test samples, from embeddings of that name."""
    if (source, embedded, seed) not in run_files.embeddings:
        raise InputError("readings of frame_input", f"lack embeddings {embedded} of {source}, seed {seed}", "give them")
    train, test = train_and_test(run_files.embedded(source, embedded, seed))
    scores_S_C = gpc_scores(run_files.section("gpca"), train, test.embedding, source, seed)
    return np.array(CONCEPTS)[scores_S_C.argmax(axis=1)]


def encoders(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of the judged rows, and of the rows whose encoders are as published in their place."""
    published = run_files.section("published")

    def replaced(architecture: str, source: str, method: str) -> SourceAndMethod | None:
        encoder, reduction = method.split("-")
        if architecture == "judged":
            return source, method
        return (source, f"{published[encoder]}-{reduction}") if encoder in published else None

    yield from _other_rows(run_files, readings, "architecture", replaced)


def starts(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of the judged rows, and of the rows whose ICP starts at estimators' poses."""
    estimated = run_files.section("frames")["estimated"]

    def replaced(initial_pose: str, source: str, method: str) -> SourceAndMethod | None:
        return (source if initial_pose == "true_pose" else estimated), method

    yield from _other_rows(run_files, readings, "initial_pose", replaced)


def _other_rows(
    run_files: RunFiles,
    readings: Sequence[Reading],
    choice: str,
    replaced: Callable[[str, str, str], SourceAndMethod | None],
) -> Iterator[Row]:
    """Yield the values of each reading's rows as those of the judged ones; rows that the run lacks are left out."""

    @cache
    def shown(source: str, seed: int) -> Shown:
        return shown_samples(Registrations.load(run_files.registrations[source, seed], (source, seed)))

    frames = run_files.section("frames")
    for method in frames["methods"]:
        for reading in readings:
            other = replaced(reading[choice], frames["source"], method)
            for source, name, seed in run_files.predictions:
                if (source, name) == other:
                    named_S = run_files.predicted(source, name, seed)
                    yield from _rows(reading, shown(source, seed), named_S, frames["source"], method, seed)


def shown_samples(registrations: Registrations) -> Shown:
    """Concepts of the test samples, and which of them show objects that the training has seen, has not, or any."""
    train, test = (registrations.rows(split) for split in ("train", "test"))
    seen_S = np.isin(registrations.object_name[test], registrations.object_name[train])
    return registrations.concept[test], {"all": np.ones(len(test), bool), "seen": seen_S, "unseen": ~seen_S}


def _rows(reading: Reading, shown: Shown, named_S: np.ndarray, source: str, method: str, seed: int) -> Iterator[Row]:
    """Yield the values of the test samples that show the reading's objects."""
    true_S, masks = shown
    chosen_S = masks[reading["objects"]]
    if chosen_S.any():
        yield from rows_of(confusions(true_S[chosen_S], named_S[chosen_S]), reading, source, method, seed)


def confusions(true_S: np.ndarray, named_S: np.ndarray) -> Values:
    """Accuracies, and how often pose errors and missing overlap are taken for each other."""
    values = accuracies_of_named(true_S, named_S)
    for concept, other in (("pose", "overlap"), ("overlap", "pose")):
        concept_S = true_S == concept
        values["test_samples", concept] = float(concept_S.sum())
        values[f"predicted_as_{other}", concept] = float((named_S[concept_S] == other).sum())
    return values | {("test_samples", ALL): float(len(true_S))}
