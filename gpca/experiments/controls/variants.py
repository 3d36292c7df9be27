"""Registrations as the controls change them: each variant is made of registrations of the paper's protocol."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gpca.alignment.icp import ICPSettings
from gpca.encoders.registry import OF_ANY_SIZE
from gpca.experiments.controls.settings import TRAININGS, UNSEEN, WRONG_LABELS, ControlSettings
from gpca.objects.canonical import unseen
from gpca.objects.surface import instance_of
from gpca.pairs.dataset import Registrations, ragged
from gpca.pairs.perturbation import CONCEPTS
from gpca.pairs.synthesis import registered_backwards
from gpca.seeds import generator

FEWEST_OBJECTS = 5  # instances; with fewer, too few objects are left to learn from


def left_out(control: str, registrations: Registrations, settings: ControlSettings, backbone: str) -> str | None:
    """Return why these registrations, or the backbone of their encoder, do not admit a control; None where they do."""
    if control in (UNSEEN, *TRAININGS):
        objects = len({instance_of(name) for name in registrations.object_name.tolist()})
        if objects < FEWEST_OBJECTS:
            return f"it needs at least {FEWEST_OBJECTS} objects, but there are {objects}"
    if control in ("density", "random_draws"):
        fewest, least = int(np.diff(registrations.offsets).min()), settings.draw_points[0]
        if fewest < least:
            return f"its smallest draw has {least} points, but a cloud has only {fewest}"
        if backbone not in OF_ANY_SIZE:
            return f"backbone '{backbone}' accepts clouds of one size only"
    return None


def variant(
    control: str, registrations: Registrations, source: str, seed: int, settings: ControlSettings, icp: ICPSettings
) -> Registrations:
    """Return the samples that explainers learn from (split ``train``) and explain (``test``) under a control.

    Controls of the labels and transfer leave the registrations as they are.
    """
    if control == "density":
        return thinned(registrations, settings.draw_points, source, seed)
    if control in (UNSEEN, *TRAININGS):
        return of_unseen_objects(registrations, settings.folds, source, seed)
    if control == "reversed":
        return registered_backwards(registrations, icp)
    return registrations


def thinned(registrations: Registrations, points: tuple[int, int], *axes: object) -> Registrations:
    """Return the same with a random number of points of each source cloud, whatever its concept.

    A fixed number of points makes a cropped cloud denser than the others, and all points make it the smallest; a random
    number drowns both. The clouds of the models stay.
    """
    clouds = []
    for row in range(len(registrations)):
        cloud = registrations.cloud(row)
        random = generator(*axes, "thinned", registrations.split[row], registrations.sample[row])
        count = min(int(random.integers(points[0], points[1] + 1)), len(cloud))
        clouds.append(cloud[np.sort(random.permutation(len(cloud))[:count])])
    targets = [registrations.target(row) for row in range(len(registrations))]
    thin: dict[str, Any] = ragged(clouds, targets)
    return replace(registrations, **thin)


def of_unseen_objects(registrations: Registrations, folds: int, source: str, seed: int) -> Registrations:
    """Return training samples of most objects; test samples are those of the same objects, and all of the others.

    The families of a source's objects are in folds that a file names, or are dealt into `folds` once for all seeds. A
    seed leaves out the fold of its number: so many seeds as there are folds test every object once.
    """
    is_unseen = unseen(registrations.fold, seed)
    if is_unseen is None:
        families = generator(source, "folds").permutation(np.unique(registrations.cluster))
        is_unseen = np.isin(registrations.cluster, families[seed % folds :: folds])
    train = np.flatnonzero(~is_unseen & (registrations.split == "train"))
    test = np.concatenate([np.flatnonzero(~is_unseen & (registrations.split == "test")), np.flatnonzero(is_unseen)])
    chosen = registrations.subset(np.concatenate([train, test]))
    # Numbered anew, since the test samples come from both splits.
    split = np.repeat(["train", "test"], [len(train), len(test)])
    sample = np.concatenate([chosen.sample[: len(train)], np.arange(len(test))])
    return replace(chosen, split=split, sample=sample)


def shows_known_object(registrations: Registrations) -> np.ndarray:
    """Return which samples (S,) show an object of a family that the training samples show."""
    return np.isin(registrations.cluster, registrations.cluster[registrations.split == "train"])


def relabeled(control: str, train: Registrations, *axes: object) -> Registrations:
    """Return training samples with labels that a control changes.

    Of label noise, that share of the labels names one of the other concepts. Where they are shuffled, each concept's
    samples get every label equally often, so that labels tell nothing at all: what is learned from them is chance,
    while of labels shuffled freely a cluster of samples would keep a most frequent one.
    """
    random = generator(*axes, "labels", control)
    concept = train.concept.copy()
    if control == "shuffled":
        for name in CONCEPTS:
            rows = random.permutation(np.flatnonzero(train.concept == name))
            concept[rows] = np.resize(random.permutation(CONCEPTS), len(rows))
    else:
        rows = random.permutation(len(train))[: round(WRONG_LABELS[control] * len(train))]
        steps = random.integers(1, len(CONCEPTS), size=len(rows))
        numbers = np.array([CONCEPTS.index(name) for name in concept[rows]], int)
        concept[rows] = np.array(CONCEPTS)[(numbers + steps) % len(CONCEPTS)]
    return replace(train, concept=concept)
