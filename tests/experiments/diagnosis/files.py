"""Files of a run with an explainer that is always right and one that always says the same."""

from dataclasses import replace

import numpy as np

from gpca.attribution.predictions import write_predictions
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS, labels_of


def write_run(folder, causes, source="four", seed=100):
    """Return prediction files and files of causes."""
    label = labels_of(causes.truth)
    right = np.array([[name == each for name in LABELS] for each in label], float) + 0.01
    files = {"right": right, "always_pose": np.tile([0.1, 0.1, 0.7, 0.1], (len(label), 1))}
    truth = folder / "causes" / source / f"seed{seed}.npz"
    replace(causes, registrations=replace(causes.registrations, axes=(source, seed))).save(truth)
    paths = []
    for name, scores in files.items():
        paths.append(folder / "diagnoses" / source / name / f"seed{seed}.csv")
        attribution = Attribution.of_scores(LABELS, scores / scores.sum(axis=1, keepdims=True), seconds=0.0)
        write_predictions(paths[-1], causes.registrations, attribution)
    return paths, [truth]
