"""Scores of methods on the test samples of a track, with intervals over clusters and seeds, and paired differences.

Every method is measured on the same samples and the same draws, so the difference of two is paired.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.confidence import bounds, pigeonhole_weights
from gpca.attribution.scores import Attribution
from gpca.causes.dataset import LABELS
from gpca.causes.truth import BORDERLINE, NOMINAL
from gpca.experiments.diagnosis.judged import CEILING, POOLED, Judged, ceiling_of, joined, judged_of
from gpca.experiments.diagnosis.measures import SHARES, counted, measure, ranking
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator
from gpca.tracks.published import Method, Published
from gpca.tracks.track import CAUSES_TRACK, FRAMES_TRACK, HARD_TRACK

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("group", "method", "metric", "samples", "seeds", "value", "low", "high")
AGAINST = ("against", "difference", "difference_low", "difference_high")  # of one method's headline minus another's
OF_HARD = ("accuracy", *(f"recall_{concept}" for concept in CONCEPTS), "auroc_error")
Measured = Mapping[str, np.ndarray]  # metric -> values on the samples as they are, and then on every draw


def score(published: Published, mine: Mapping[str, Method]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Score the published methods and others.

    Args:
        mine: further methods by their names, which differ from those of the published ones.

    Returns:
        a row of `COLUMNS` for each group of samples, method and measure; and a row of group, method and `AGAINST` for
        each further method (``against``) and each other one: the method's headline minus the further one's.
    """
    import pandas as pd

    track = published.track
    rows: list[tuple] = []
    differences: list[tuple] = []
    methods = {method.name: method for method in published.methods} | dict(mine)
    for group, chosen, drawn_B_N, once_N in groups_of(published):
        weights_B_N = np.vstack([np.ones(len(chosen)), drawn_B_N])
        values: dict[str, Measured] = {}
        counts: dict[str, dict[str, np.ndarray]] = {}
        for name, measured in _measured(published, methods, chosen):
            values[name], counts[name] = measured(weights_B_N * once_N)
        seeds = len(set(published.rows.seed[chosen].tolist()))
        for name, of_method in values.items():
            for metric, value_B in of_method.items():
                if np.isfinite(value_B[0]):
                    counted_N = counts[name][metric]
                    drawn = drawn_B_N[:, counted_N] if metric in (*SHARES, *OF_HARD) else None
                    own = (group, name, metric, int(counted_N.sum()), seeds)
                    rows.append((*own, value_B[0], *bounds(value_B[1:], drawn)))
        headline = track.headline
        known = [name for name, of_method in values.items() if headline in of_method]
        for against in (name for name in mine if name in known):
            for name in (name for name in known if name not in (against, CEILING)):
                apart_B = values[name][headline] - values[against][headline]
                drawn = drawn_B_N[:, counts[name][headline]]
                differences.append((group, name, against, apart_B[0], *bounds(apart_B[1:], drawn, difference=True)))
    return (
        pd.DataFrame(rows, columns=list(COLUMNS)),
        pd.DataFrame(differences, columns=["group", "method", *AGAINST]),
    )


def groups_of(published: Published) -> Iterator[tuple[str, np.ndarray, np.ndarray, np.ndarray]]:
    """Yield each group of samples that is scored by itself: name, rows, bootstrap's weights, weight of each sample.

    Of depth frames these are the kinds of starts, in which an instance counts once, however many starts it has. Draws
    are those of the tables that have the published rows, where these are of the same samples.
    """
    rows = published.rows
    if published.track.name != FRAMES_TRACK:
        all_N = np.arange(len(rows))
        name = {CAUSES_TRACK: "cause intervals", HARD_TRACK: "control intervals"}[published.track.name]
        cluster_N = rows.cluster
        if published.track.name == HARD_TRACK:
            cluster_N = np.array(
                [f"{source}/{cluster}" for source, cluster in zip(rows.source, cluster_N, strict=True)]
            )
        yield POOLED, all_N, pigeonhole_weights(generator(name, POOLED), rows.seed, cluster_N), np.ones(len(all_N))
        return
    for kind in dict.fromkeys(rows.start[rows.counted].tolist()):
        chosen = np.flatnonzero((rows.start == kind) & rows.counted)
        drawn_B_N = pigeonhole_weights(generator("frame cause intervals", kind), rows.scene[chosen])
        _, place, count = np.unique(rows.instance[chosen], return_inverse=True, return_counts=True)
        yield kind, chosen, drawn_B_N, 1 / count[place]


Measure = Callable[[np.ndarray], tuple[Measured, dict[str, np.ndarray]]]


def _measured(published: Published, methods: Mapping[str, Method], chosen: np.ndarray) -> Iterator[tuple[str, Measure]]:
    """Yield each method's name and a function from weights to its measures and the samples that each counts."""
    if published.track.name == HARD_TRACK:
        for name, method in methods.items():
            yield name, _hard(published, method)
        return
    judged = {name: judged_by_method(published, method).subset(chosen) for name, method in methods.items()}
    judged[CEILING] = ceiling(published).subset(chosen)
    for name, samples in judged.items():
        yield name, partial(_of_causes, samples)


def _of_causes(samples: Judged, weights_B_N: np.ndarray) -> tuple[Measured, dict[str, np.ndarray]]:
    values = measure(samples, weights_B_N)
    return values, {metric: counted(samples, metric) for metric in values}


def _hard(published: Published, method: Method) -> Measure:
    concept_N, named_N = published.rows.concept, method.labels_named(CONCEPTS)
    right_N = concept_N == named_N
    entropy_N = Attribution.of_scores(CONCEPTS, method.scores, seconds=0.0).entropy_N
    of = {f"recall_{concept}": concept_N == concept for concept in CONCEPTS} | {"accuracy": np.ones(len(right_N), bool)}

    def measured(weights_B_N: np.ndarray) -> tuple[Measured, dict[str, np.ndarray]]:
        with np.errstate(divide="ignore", invalid="ignore"):
            values = {
                name: (weights_B_N[:, of_N] * right_N[of_N]).sum(axis=1) / weights_B_N[:, of_N].sum(axis=1)
                for name, of_N in of.items()
            }
        values["auroc_error"] = ranking(entropy_N, ~right_N, weights_B_N)["area"]
        return values, of | {"auroc_error": of["accuracy"]}

    return measured


def judged_by_method(published: Published, method: Method) -> Judged:
    """Return all test samples with what a method said of them."""
    named_N = method.labels_named(LABELS)
    return joined(
        judged_of(published.truth_of(rows), seed, method.scores[rows], named_N[rows])
        for _, seed, rows in published.rows.parts()
    )


def ceiling(published: Published) -> Judged:
    """Return all test samples with the truth measured from other starts as predictions."""
    return joined(ceiling_of(published.truth_of(rows), seed) for _, seed, rows in published.rows.parts())


def failures(published: Published) -> dict[str, int]:
    """Return how many samples of each kind of start of depth frames have failed; none for other tracks."""
    if published.track.name != FRAMES_TRACK:
        return {}
    label_N = ceiling(published).label
    failed_N = (label_N != BORDERLINE) & (label_N != NOMINAL)
    return {kind: int(failed_N[chosen].sum()) for kind, chosen, _, _ in groups_of(published)}
