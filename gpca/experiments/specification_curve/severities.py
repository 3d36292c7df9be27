"""GP-CA by severity: on test samples that were perturbed weakly or strongly, and retrained on such ranges."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.stats import rankdata

from gpca.attribution.predictions import read_predictions
from gpca.classifier.gpc import GPC
from gpca.classifier.settings import GPCSettings
from gpca.experiments.specification_curve.diagnostics import accuracies, accuracies_of_named
from gpca.experiments.specification_curve.run_files import Row, RunFiles, like_the_training
from gpca.experiments.specification_curve.settings import Reading, ReadingSizes
from gpca.pairs.dataset import Registrations
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.shifted_sets import ShiftedSets

PARTS = ("weakest", "middle", "strongest")
CLASSIFIERS = {"paper": "gpca_paper", "converged": "gpca"}


def run(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies under each reading, of all samples and of each concept."""
    for (source, seed), path in run_files.registrations.items():
        registrations = Registrations.load(path, (source, seed))
        test = registrations.subset(registrations.rows("test"))
        part_S = dict(zip(test.sample.astype(str), parts(test), strict=True))
        for reading in readings:
            of_classifier = run_files.predictions.get((source, CLASSIFIERS[reading["classifier"]], seed))
            if of_classifier is None:
                continue
            rows = read_predictions(of_classifier)
            rows = rows[rows["split"] == "test"]
            if reading["part"] != "all":
                rows = rows[rows["sample"].map(part_S) == reading["part"]]
            values = accuracies_of_named(rows["concept_true"].to_numpy(), rows["concept_predicted"].to_numpy())
            for (metric, concept), value in values.items():
                yield reading, source, "gpca_paper", metric, concept, seed, value


def retrained(run_files: RunFiles, readings: Sequence[Reading], _sizes: ReadingSizes) -> Iterator[Row]:
    """Yield the accuracies of encoder and classifier that learned from other severities, on test samples of these."""
    for (severities, source, seed), path in run_files.retrained.items():
        samples = like_the_training(ShiftedSets.load(path, (source, seed)))
        train, test = (samples.subset(samples.rows(split)) for split in ("train", "test"))
        for reading in (reading for reading in readings if reading["range"] == severities):
            settings = GPCSettings(**run_files.section(CLASSIFIERS[reading["classifier"]]))
            gpc = GPC(CONCEPTS, settings, source, seed).fit(train.embedding, train.concept)
            for (metric, concept), value in accuracies(test.concept, gpc.attribute(test.embedding)[0]).items():
                yield reading, source, "gpca_paper", metric, concept, seed, value


def parts(registrations: Registrations) -> np.ndarray:
    """Return for each sample the third of its concept's samples in which its severity lies.

    That of a pose error is the mean of the ranks of its angle and its length.
    """
    names_S = np.empty(len(registrations), object)
    pose_S = rankdata(registrations.severity_rotation_rad) + rankdata(registrations.severity_translation)
    severities = {"noise": registrations.severity_noise, "pose": pose_S, "overlap": registrations.severity_crop}
    for concept, severity_S in severities.items():
        rows = np.flatnonzero(registrations.concept == concept)
        ranks = np.argsort(np.argsort(severity_S[rows], kind="stable"))
        names_S[rows] = np.array(PARTS)[len(PARTS) * ranks // max(len(rows), 1)]
    return names_S
