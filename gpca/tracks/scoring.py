"""Scores of methods on the test samples of a track, with intervals over clusters and seeds, and paired differences."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from gpca.attribution.diagnostics import augrc
from gpca.causes.dataset import LABELS
from gpca.causes.judged import CEILING, SHARES, Judged, ceiling_of, counted, joined, judged_of, measure, ranking
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.classifier.scores import Attribution
from gpca.evaluation.intervals import Clustered, interval, weighted_mean
from gpca.evaluation.measures import POOLED
from gpca.experiments.scan_causes import CAUSES as SCAN_MEASURE
from gpca.experiments.scan_causes import EVERY, NATURAL, counted_of_scans, scan_measures
from gpca.io.frame import Frame
from gpca.pairs.perturbation import CONCEPTS
from gpca.tracks.published import Method, Published
from gpca.tracks.track import FRAMES_TRACK, HARD_TRACK, SCANS_TRACK

COLUMNS = ("group", "method", "metric", "samples", "seeds", "value", "low", "high")
AGAINST = ("against", "difference", "difference_low", "difference_high")  # of two methods' headlines
AREA = "augrc"  # under the curve of generalized risk over coverage
HARD_MEASURES = ("accuracy", *(f"recall_{concept}" for concept in CONCEPTS), "auroc_error")
SHARES_OF_SAMPLES = (*SHARES, *HARD_MEASURES, SCAN_MEASURE)  # Wilson's interval in the place of one without width
Arrays = dict[str, np.ndarray]
Group = tuple[str, np.ndarray, Clustered]


def score(published: Published, submitted: Mapping[str, Method]) -> tuple[Frame, Frame]:
    """Score the published methods and submitted ones, whose names differ.

    Returns `COLUMNS` for each group of samples, method with scores for all of them, and measure; and group, method and
    `AGAINST` for each pair of a submitted method and another: the other's headline minus the submitted one's.
    """
    import pandas as pd

    headline = published.track.headline
    rows: list[tuple] = []
    differences: list[tuple] = []
    methods = {method.name: method for method in published.methods} | dict(submitted)
    for group, chosen, draws in groups_of(published):
        measured = measured_of(published, methods, chosen, draws)
        for name, (values, masks) in measured.items():
            for metric, value_B in values.items():
                if np.isfinite(value_B[0]):
                    subset = draws.subset(masks[metric])
                    drawn_B_n = subset.weights[1:] if metric in SHARES_OF_SAMPLES else None
                    estimate = interval(value_B, drawn_B_n, samples=subset.independent)
                    rows.append((group, name, metric, len(subset), draws.counts[0], *estimate))
        ranked = [name for name, (values, _) in measured.items() if headline in values]
        for against in (name for name in submitted if name in ranked):
            for name in (name for name in ranked if name not in (against, CEILING)):
                values, masks = measured[name]
                difference_B = values[headline] - measured[against][0][headline]
                estimate = interval(difference_B, draws.weights[1:, masks[headline]], difference=True)
                differences.append((group, name, against, *estimate))
    return (pd.DataFrame(rows, columns=list(COLUMNS)), pd.DataFrame(differences, columns=["group", "method", *AGAINST]))


def groups_of(published: Published) -> Iterator[Group]:
    """Yield each separately scored group: name, rows, and their draws, which are those of the run's tables."""
    rows, track = published.rows, published.track

    def group(name: str, mask_N: np.ndarray, cluster_N: np.ndarray, *axes: str) -> Group:
        chosen = np.flatnonzero(mask_N)
        return name, chosen, Clustered.drawn(rows.seed[chosen], cluster_N[chosen], track.draws, name, *axes)

    if track.name == FRAMES_TRACK:
        for kind in dict.fromkeys(rows.start[rows.counted].tolist()):
            name, chosen, draws = group(kind, (rows.start == kind) & rows.counted, rows.scene)
            yield name, chosen, replace(draws, instance=rows.instance[chosen])
    elif track.name == SCANS_TRACK:
        names = list(dict.fromkeys(rows.source.tolist()))
        for name in [POOLED, *names] if len(names) > 1 else names:
            mask_N = rows.counted & ((rows.source == name) | (name == POOLED))
            yield group(name, mask_N, rows.cluster, NATURAL, EVERY)
    else:
        cluster_N = rows.cluster
        if track.name == HARD_TRACK:
            pairs = zip(rows.source, cluster_N, strict=True)
            cluster_N = np.array([f"{source}/{cluster}" for source, cluster in pairs])
        yield group(POOLED, np.ones(len(rows), bool), cluster_N)


def measured_of(
    published: Published, methods: Mapping[str, Method], chosen: np.ndarray, draws: Clustered
) -> dict[str, tuple[Arrays, Arrays]]:
    """Return each method's measures (1 + B,) of rows by name, and masks of the samples that each counts."""
    methods = {name: method for name, method in methods.items() if np.isfinite(method.scores[chosen]).all()}
    weights_B_N = draws.weights * draws.once
    if published.track.name == HARD_TRACK:
        concept_N, measured = published.rows.concept, {}
        masks = {f"recall_{concept}": concept_N == concept for concept in CONCEPTS}
        masks["accuracy"] = np.ones(len(concept_N), bool)
        for name, method in methods.items():
            right_N = concept_N == method.labels_named(CONCEPTS)
            values = {each: weighted_mean(right_N[mask_N], weights_B_N[:, mask_N]) for each, mask_N in masks.items()}
            entropy_N = Attribution.of_scores(CONCEPTS, method.scores, seconds=0.0).entropy_N
            values["auroc_error"] = ranking(entropy_N, ~right_N, weights_B_N)["area"]
            values[AREA] = augrc(method.scores.max(axis=1), ~right_N, weights_B_N)
            measured[name] = values, masks | dict.fromkeys(("auroc_error", AREA), masks["accuracy"])
        return measured
    judged, parts = {}, [(published.truth_of(rows), seed, rows) for _, seed, rows in published.rows.parts()]
    for name, method in methods.items():
        named_N = method.labels_named(LABELS)
        judged[name] = joined(judged_of(truth, seed, method.scores[rows], named_N[rows]) for truth, seed, rows in parts)
    judged[CEILING] = ceiling(published)
    on_scans = published.track.name == SCANS_TRACK
    measures, counts_in = (scan_measures, counted_of_scans) if on_scans else (measure, counted)
    measured = {}
    for name, every in judged.items():
        samples = every.subset(chosen)
        values = measures(samples, weights_B_N)
        measured[name] = values, {metric: counts_in(samples, metric) for metric in values}
    return measured


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
        for name, chosen, *_ in groups_of(published)
    }
