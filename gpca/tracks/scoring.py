"""Scores of methods on the test samples of a track, with intervals over clusters and seeds, and paired differences.

All methods are measured on the same samples and the same bootstrap draws.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS
from gpca.causes.judged import CEILING, SHARES, Judged, ceiling_of, counted, joined, judged_of, measure, ranking
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.evaluation.intervals import interval, pigeonhole_weights
from gpca.evaluation.measures import POOLED
from gpca.experiments.scan_causes import CAUSES as SCAN_MEASURE
from gpca.experiments.scan_causes import EVERY, NATURAL, counted_of_scans, scan_measures
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator
from gpca.tracks.published import Method, Published
from gpca.tracks.track import FRAMES_TRACK, HARD_TRACK, SCANS_TRACK

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("group", "method", "metric", "samples", "seeds", "value", "low", "high")
AGAINST = ("against", "difference", "difference_low", "difference_high")  # of two methods' headlines
HARD_MEASURES = ("accuracy", *(f"recall_{concept}" for concept in CONCEPTS), "auroc_error")
SHARES_OF_SAMPLES = (*SHARES, *HARD_MEASURES, SCAN_MEASURE)  # Wilson's interval in the place of one without width
Measured = Mapping[str, np.ndarray]  # metric -> values: of the samples as they are, then of every draw
Measure = Callable[[np.ndarray], tuple[Measured, dict[str, np.ndarray]]]
Group = tuple[str, np.ndarray, np.ndarray, np.ndarray]


def score(published: Published, submitted: Mapping[str, Method]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Score the published methods and submitted ones.

    Args:
        submitted: by name, different from the names of the published methods.

    Returns:
        `COLUMNS` for each group of samples, method and measure; and group, method and `AGAINST` for each pair of a
        submitted method (``against``) and another: the other's headline minus the submitted one's. A method that lacks
        scores for samples of a group has no row of it.
    """
    import pandas as pd

    headline = published.track.headline
    rows: list[tuple] = []
    differences: list[tuple] = []
    methods = {method.name: method for method in published.methods} | dict(submitted)
    for group, chosen, drawn_B_N, once_N in groups_of(published):
        weights_B_N = np.vstack([np.ones(len(chosen)), drawn_B_N]) * once_N
        complete = {name: method for name, method in methods.items() if np.isfinite(method.scores[chosen]).all()}
        measured = {name: of(weights_B_N) for name, of in _measures(published, complete, chosen)}
        seeds = len(set(published.rows.seed[chosen].tolist()))
        for name, (values, counts) in measured.items():
            for metric, value_B in values.items():
                if np.isfinite(value_B[0]):
                    samples = drawn_B_N[:, counts[metric]] if metric in SHARES_OF_SAMPLES else None
                    keys = (group, name, metric, int(counts[metric].sum()), seeds)
                    rows.append((*keys, *interval(value_B, samples)))
        ranked = [name for name, (values, _) in measured.items() if headline in values]
        for against in (name for name in submitted if name in ranked):
            for name in (name for name in ranked if name not in (against, CEILING)):
                values, counts = measured[name]
                difference_B = values[headline] - measured[against][0][headline]
                estimate = interval(difference_B, drawn_B_N[:, counts[headline]], difference=True)
                differences.append((group, name, against, *estimate))
    return (pd.DataFrame(rows, columns=list(COLUMNS)), pd.DataFrame(differences, columns=["group", "method", *AGAINST]))


def groups_of(published: Published) -> Iterator[Group]:
    """Yield each separately scored group: name, rows, bootstrap's weights (B, N), weights of the samples (N,).

    Groups are the kinds of starts of depth frames, in which an instance counts once whatever its number of starts, and
    the data sets of scans, also pooled. Draws are those of the tables of the published rows.
    """
    rows, track = published.rows, published.track

    def group(name: str, chosen: np.ndarray, cluster_N: np.ndarray, *axes: str) -> Group:
        random = generator(track.draws, name, *axes)
        return name, chosen, pigeonhole_weights(random, rows.seed[chosen], cluster_N[chosen]), np.ones(len(chosen))

    if track.name == FRAMES_TRACK:
        for kind in dict.fromkeys(rows.start[rows.counted].tolist()):
            name, chosen, drawn_B_N, _ = group(kind, np.flatnonzero((rows.start == kind) & rows.counted), rows.scene)
            _, instance_N, count = np.unique(rows.instance[chosen], return_inverse=True, return_counts=True)
            yield name, chosen, drawn_B_N, 1 / count[instance_N]
    elif track.name == SCANS_TRACK:
        names = list(dict.fromkeys(rows.source.tolist()))
        for name in [POOLED, *names] if len(names) > 1 else names:
            chosen = np.flatnonzero(rows.counted & ((rows.source == name) | (name == POOLED)))
            yield group(name, chosen, rows.cluster, NATURAL, EVERY)
    else:
        cluster_N = rows.cluster
        if track.name == HARD_TRACK:
            pairs = zip(rows.source, cluster_N, strict=True)
            cluster_N = np.array([f"{source}/{cluster}" for source, cluster in pairs])
        yield group(POOLED, np.arange(len(rows)), cluster_N)


def _measures(published: Published, methods: Mapping[str, Method], chosen: np.ndarray) -> Iterator[tuple[str, Measure]]:
    """Yield each method's name and a function from weights to its measures and the samples that each counts."""
    if published.track.name == HARD_TRACK:
        for name, method in methods.items():
            yield name, partial(_hard_measures, published, method)
        return
    judged = {name: judged_by_method(published, method).subset(chosen) for name, method in methods.items()}
    judged[CEILING] = ceiling(published).subset(chosen)
    measures, counts = (scan_measures, counted_of_scans) if published.track.name == SCANS_TRACK else (measure, counted)
    for name, samples in judged.items():
        yield name, partial(_judged_measures, measures, counts, samples)


def _judged_measures(measures, counts, samples: Judged, weights_B_N: np.ndarray):
    values = measures(samples, weights_B_N)
    return values, {metric: counts(samples, metric) for metric in values}


def _hard_measures(published: Published, method: Method, weights_B_N: np.ndarray):
    concept_N = published.rows.concept
    right_N = concept_N == method.labels_named(CONCEPTS)
    masks = {f"recall_{concept}": concept_N == concept for concept in CONCEPTS}
    masks["accuracy"] = np.ones(len(right_N), bool)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = {
            name: (weights_B_N[:, mask_N] * right_N[mask_N]).sum(axis=1) / weights_B_N[:, mask_N].sum(axis=1)
            for name, mask_N in masks.items()
        }
    entropy_N = Attribution.of_scores(CONCEPTS, method.scores, seconds=0.0).entropy_N
    values["auroc_error"] = ranking(entropy_N, ~right_N, weights_B_N)["area"]
    return values, masks | {"auroc_error": masks["accuracy"]}


def judged_by_method(published: Published, method: Method) -> Judged:
    """Return all test samples with a method's predictions."""
    named_N = method.labels_named(LABELS)
    return joined(
        judged_of(published.truth_of(rows), seed, method.scores[rows], named_N[rows])
        for _, seed, rows in published.rows.parts()
    )


def ceiling(published: Published) -> Judged:
    """Return all test samples with the truth measured from other starts as predictions."""
    return joined(ceiling_of(published.truth_of(rows), seed) for _, seed, rows in published.rows.parts())


def counts(published: Published) -> dict[str, dict[str, int]]:
    """Return how many samples of each group are ``failed`` and ``nominal``; empty for tracks of one group."""
    if not published.track.groups:
        return {}
    label_N = ceiling(published).label
    states = {"failed": (label_N != BORDERLINE) & (label_N != NOMINAL), NOMINAL: label_N == NOMINAL}
    return {
        name: {state: int(mask_N[chosen].sum()) for state, mask_N in states.items()}
        for name, chosen, _, _ in groups_of(published)
    }
