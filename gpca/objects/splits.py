"""Which objects and scenes are alike, and which of them are tested together: read from files, or drawn.

Samples that show objects of one family of shapes, or one scene, form a *cluster*. Clusters are never split between
training and test where objects or scenes are unseen, and intervals are over clusters. The clusters of a source are
dealt into *folds*; each seed leaves one fold unseen. Columns of the files:

    objects: source, object, name, family, role, fold
    scenes:  dataset, scene, role, fold[, truth, estimates]

The role is ``development`` (settings are chosen on it), ``evaluation`` or, of objects, ``unused``. The true poses of a
scene were ``annotated`` or made by ``icp``; poses of estimators are from the same ``image`` or were ``carried`` over
from another one of the sequence.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gpca.errors import InputError
from gpca.io.csv_file import read_csv
from gpca.objects.surface import Surface
from gpca.seeds import generator

DRAWN = -1  # the fold of what no file deals into folds
TRAINING = -2  # the fold of scenes for development, which are never tested but may be trained on
DEVELOPMENT, EVALUATION, UNUSED = ROLES = ("development", "evaluation", "unused")
ANNOTATED, BY_ICP = TRUTHS = ("annotated", "icp")
ON_IMAGE, CARRIED = ESTIMATES = ("image", "carried")
WORTH = {"truth": TRUTHS, "estimates": ESTIMATES}  # columns of scenes that may be missing


class Place(NamedTuple):
    """The cluster, role and fold of an object or a scene, and where the poses of a scene are from."""

    cluster: str
    role: str
    fold: int
    truth: str = ANNOTATED
    estimates: str = ON_IMAGE


def read_object_splits(path: str | Path, source: str) -> dict[str, Place]:
    """Return the place of each object of a source by name; none where the file does not name the source.

    Raises:
        InputError: a damaged file, an object twice, an unknown role, a fold that is no whole number, a family in two
            folds or roles.
    """
    rows = read_csv(path, ("source", "object", "name", "family", "role", "fold"), remedy="restore it")
    of_source = rows[rows["source"] == source]
    return _places(path, of_source["object"], of_source["family"], of_source["role"], of_source["fold"])


def read_scene_splits(path: str | Path, dataset: str) -> dict[int, Place]:
    """Return the place of each scene of a dataset by number; none where the file does not name the dataset.

    InputError as in :func:`read_object_splits`, and for an unknown word for truth or estimates.
    """
    rows = read_csv(path, ("dataset", "scene", "role", "fold"), others=tuple(WORTH), remedy="restore it")
    of_dataset = rows[rows["dataset"] == dataset]
    clusters = [f"{dataset} {scene}" for scene in of_dataset["scene"]]
    places = _places(path, of_dataset["scene"], clusters, of_dataset["role"], of_dataset["fold"])
    for column, words in WORTH.items():
        for scene, word in zip(of_dataset["scene"], of_dataset.get(column, ()), strict=False):
            if word not in words:
                fault = f"scene {scene} of {dataset} has '{word}' as {column}"
                raise InputError(path, fault, f"choose one of {', '.join(words)}")
            places[scene] = places[scene]._replace(**{column: word})
    return {int(scene): place for scene, place in places.items()}


def _places(path, names, clusters, roles, folds) -> dict[str, Place]:
    places: dict[str, Place] = {}
    of_cluster: dict[str, Place] = {}
    for name, cluster, role, fold in zip(names, clusters, roles, folds, strict=True):
        if name in places:
            raise InputError(path, f"'{name}' occurs twice", "keep one of its rows")
        if role not in ROLES:
            raise InputError(path, f"'{name}' has the role '{role}'", f"choose one of {', '.join(ROLES)}")
        if not fold.isdecimal() and role != UNUSED:
            raise InputError(path, f"'{name}' has the fold '{fold}'", "number the folds from 0")
        place = Place(cluster, role, int(fold) if role != UNUSED else DRAWN)
        if place != of_cluster.setdefault(cluster, place):
            raise InputError(path, f"'{cluster}' has two roles or is in two folds", "give all of it one of each")
        places[name] = place
    return places


def without_unused(surfaces: Iterable[Surface], places: Mapping[str, Place]) -> Iterator[Surface]:
    """Yield the surfaces that are not unused; InputError for an object that the given places lack."""
    for surface in surfaces:
        if places and surface.name not in places:
            remedy = "add it to the file of objects, or set splits.objects: null"
            raise InputError(f"object '{surface.name}'", "is in no split", remedy)
        if not places or places[surface.name].role != UNUSED:
            yield surface


def families_and_folds(names: Iterable[str], places: Mapping[str, Place]) -> dict[str, Any]:
    """Return ``families`` and ``folds`` of objects; nothing where there are no places."""
    if not places:
        return {}
    of_objects = [places[name] for name in names]
    return {"families": tuple(of.cluster for of in of_objects), "folds": tuple(of.fold for of in of_objects)}


def unseen(fold_N: np.ndarray, seed: int) -> np.ndarray | None:
    """Return the rows (N,) of the fold that a seed leaves unseen, by turns; None for fewer than two folds."""
    folds = np.unique(fold_N[fold_N >= 0])
    if len(folds) < 2:
        return None
    return fold_N == folds[seed % len(folds)]


def drawn(cluster_N: np.ndarray, share: float, *axes: object) -> np.ndarray:
    """Return the rows (N,) of a share of the clusters, drawn with the seed axes: at least one cluster, never all."""
    clusters = np.unique(cluster_N)
    count = min(max(1, round(share * len(clusters))), len(clusters) - 1)
    return np.isin(cluster_N, generator(*axes).permutation(clusters)[:count])
