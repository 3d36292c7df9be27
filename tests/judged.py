"""Samples judged at random, but better than by chance, and files of a run with two explainers."""

from dataclasses import replace

import numpy as np

from gpca.attribution.predictions import write_predictions
from gpca.causes.dataset import LABELS, labels_of
from gpca.causes.judged import Judged
from gpca.causes.truth import BORDERLINE, FAILED, NOMINAL
from gpca.classifier.scores import Attribution


def random_judged(n=60, seed=0, skill=1.0):
    random = np.random.default_rng(seed)
    label = random.choice([*LABELS, BORDERLINE], size=n)
    error = random.uniform(0.03, 0.4, size=(n, 8))
    error[:, 0] = 0.01
    phi = random.uniform(-0.01, 0.2, size=(n, 3))
    for i, concept in enumerate(LABELS[1:]):
        phi[label == concept, i] = 0.3
    scores = random.dirichlet(np.ones(4), size=n)
    for i, name in enumerate(LABELS):
        scores[label == name, i] += skill
    scores = np.round(scores / scores.sum(axis=1, keepdims=True), 2)  # some of them equal
    return Judged(
        label=label,
        instance=random.choice(["cup", "can", "drill", "box", "bowl", "lamp"], size=n),
        seed=random.choice([100, 101], size=n),
        error=error,
        phi=phi,
        causes=phi > 0.01,
        tied=phi >= phi.max(axis=1, keepdims=True) - 0.01,
        margin=np.diff(np.sort(phi, axis=1), axis=1)[:, -1],
        shown=random.choice([NOMINAL, BORDERLINE, FAILED], size=n),
        symmetric=random.random(n) < 0.3,
        alarm=1 - scores[:, 0],
        scores=scores[:, 1:],
        named=np.array(LABELS)[scores.argmax(axis=1)],
        nominal=scores[:, 0],
    )


def write_run(folder, causes, source="four", seed=100):
    """Prediction files of an explainer that is always right and of one that names pose, and the file of causes."""
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
