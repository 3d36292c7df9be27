"""Table VI under other readings of the part that varies between repeats and of the objects in test samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.evaluation.measures import ALL
from gpca.experiments.specification_curve.diagnostics import Values, accuracies_of_named
from gpca.experiments.specification_curve.run_files import Row, RunFiles
from gpca.experiments.specification_curve.settings import Reading, ReadingSizes
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.process.progress import progress
from gpca.seeds import generator


def run(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of every backbone and reduction, repeat by repeat, and how concepts are confused."""
    of_seeds: dict[int, Registrations] = {}
    for source, seed in run_files.registrations:
        of_seeds[seed] = Registrations.load(run_files.registrations[source, seed], (source, seed))
    methods = list(dict.fromkeys(method for _, method, _ in run_files.predictions))
    first = next(iter(of_seeds))
    for repeats in dict.fromkeys(reading["repeats"] for reading in readings):
        wanted = [reading for reading in readings if reading["repeats"] == repeats]
        for method in progress(methods, f"repeats on depth frames: {repeats}"):
            for seed in of_seeds:
                if repeats == "everything":
                    shown = of_seeds[seed]
                    named_S = _predicted(run_files, source, method, seed)
                else:
                    shown = run_files.embedded(source, method, first)
                    named_S = refitted(shown, run_files.section("gpca"), repeats == "samples", source, seed)
                for reading in wanted:
                    chosen_S = of_objects(shown, reading["objects"])
                    if not chosen_S.any():
                        continue
                    true_S = shown.concept[shown.rows("test")][chosen_S]
                    for (metric, concept), value in values(true_S, named_S[chosen_S]).items():
                        yield reading, source, method, metric, concept, seed, value


def refitted(registrations: Registrations, settings: dict, drawn: bool, *axes: object) -> np.ndarray:
    """Return the concepts (S,) that a new classifier names, fitted to the training samples or to a draw of them.

    A draw is with replacement, of as many samples as there are (Efron 1979).
    """
    rows = registrations.rows("train")
    if drawn:
        rows = generator(*axes, "drawn samples").choice(rows, len(rows))
    gpc = GPC(CONCEPTS, GPCSettings(**settings), *axes, "repeat")
    gpc.fit(registrations.embedding[rows], registrations.concept[rows])
    scores_S_C, _, _ = gpc.attribute(registrations.embedding[registrations.rows("test")])
    return np.array(CONCEPTS)[scores_S_C.argmax(axis=1)]


def of_objects(registrations: Registrations, which: str) -> np.ndarray:
    """Return whether each test sample (S,) shows an object that the training has seen, or has not, or any."""
    train, test = (registrations.object_name[registrations.rows(split)] for split in ("train", "test"))
    seen_S = np.isin(test, train)
    return {"all": np.ones(len(test), bool), "seen": seen_S, "unseen": ~seen_S}[which]


def values(true_S: np.ndarray, named_S: np.ndarray) -> Values:
    """Return the accuracies, and how often pose errors and missing overlap are taken for each other."""
    metrics = accuracies_of_named(true_S, named_S)
    for concept, other in (("pose", "overlap"), ("overlap", "pose")):
        of_concept_S = true_S == concept
        metrics["test_samples", concept] = float(of_concept_S.sum())
        metrics[f"predicted_as_{other}", concept] = float((named_S[of_concept_S] == other).sum())
    return metrics | {("test_samples", ALL): float(len(true_S))}


def _predicted(run_files: RunFiles, source: str, method: str, seed: int) -> np.ndarray:
    rows = read_predictions(run_files.predictions[source, method, seed])
    return rows.loc[rows["split"] == "test", "concept_predicted"].to_numpy()
