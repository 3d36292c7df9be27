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
from gpca.experiments.scan_causes.metrics import CAUSES as OF_SCANS
from gpca.experiments.scan_causes.metrics import EVERY, NATURAL, counted_of_scans, scan_measures
from gpca.pairs.perturbation import CONCEPTS
from gpca.seeds import generator
from gpca.tracks.published import Method, Published
from gpca.tracks.track import FRAMES_TRACK, HARD_TRACK, SCANS_TRACK

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("group", "method", "metric", "samples", "seeds", "value", "low", "high")
AGAINST = ("against", "difference", "difference_low", "difference_high")  # of one method's headline minus another's
OF_HARD = ("accuracy", *(f"recall_{concept}" for concept in CONCEPTS), "auroc_error")
SHARED = (*SHARES, *OF_HARD, OF_SCANS)  # an interval of these is never of no width
Measured = Mapping[str, np.ndarray]  # metric -> values on the samples as they are, and then on every draw


def score(published: Published, mine: Mapping[str, Method]) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Score the published methods and others.

    Args:
        mine: further methods by their names, which differ from those of the published ones.

    Returns:
        a row of `COLUMNS` for each group of samples, method and measure; and a row of group, method and `AGAINST` for
        each further method (``against``) and each other one: the method's headline minus the further one's. A method
        that was not asked about all samples of a group has no row of it.
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
        asked = {name: method for name, method in methods.items() if np.isfinite(method.scores[chosen]).all()}
        for name, measured in _measured(published, asked, chosen):
            values[name], counts[name] = measured(weights_B_N * once_N)
        seeds = len(set(published.rows.seed[chosen].tolist()))
        for name, of_method in values.items():
            for metric, value_B in of_method.items():
                if np.isfinite(value_B[0]):
                    counted_N = counts[name][metric]
                    drawn = drawn_B_N[:, counted_N] if metric in SHARED else None
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


Group = tuple[str, np.ndarray, np.ndarray, np.ndarray]


def groups_of(published: Published) -> Iterator[Group]:
    """Yield each group of samples that is scored by itself: name, rows, bootstrap's weights, weight of each sample.

    Of depth frames these are the kinds of starts, in which an instance counts once, however many starts it has; of
    scans the data sets, and all together where there are several. Draws are those of the tables that have the published
    rows, where these are of the same samples.
    """
    return {FRAMES_TRACK: _kinds_of_starts, SCANS_TRACK: _data_sets}.get(published.track.name, _one_group)(published)


def _one_group(published: Published) -> Iterator[Group]:
    rows, cluster_N = published.rows, published.rows.cluster
    if published.track.name == HARD_TRACK:
        cluster_N = np.array([f"{source}/{cluster}" for source, cluster in zip(rows.source, cluster_N, strict=True)])
    drawn_B_N = pigeonhole_weights(generator(published.track.draws, POOLED), rows.seed, cluster_N)
    yield POOLED, np.arange(len(rows)), drawn_B_N, np.ones(len(rows))


def _kinds_of_starts(published: Published) -> Iterator[Group]:
    rows = published.rows
    for kind in dict.fromkeys(rows.start[rows.counted].tolist()):
        chosen = np.flatnonzero((rows.start == kind) & rows.counted)
        drawn_B_N = pigeonhole_weights(generator(published.track.draws, kind), rows.seed[chosen], rows.scene[chosen])
        _, place, count = np.unique(rows.instance[chosen], return_inverse=True, return_counts=True)
        yield kind, chosen, drawn_B_N, 1 / count[place]


def _data_sets(published: Published) -> Iterator[Group]:
    rows, names = published.rows, list(dict.fromkeys(published.rows.source.tolist()))
    for name in [POOLED, *names] if len(names) > 1 else names:
        chosen = np.flatnonzero(rows.counted & ((rows.source == name) | (name == POOLED)))
        random = generator(published.track.draws, name, NATURAL, EVERY)
        yield name, chosen, pigeonhole_weights(random, rows.seed[chosen], rows.cluster[chosen]), np.ones(len(chosen))


Measure = Callable[[np.ndarray], tuple[Measured, dict[str, np.ndarray]]]


def _measured(published: Published, methods: Mapping[str, Method], chosen: np.ndarray) -> Iterator[tuple[str, Measure]]:
    """Yield each method's name and a function from weights to its measures and the samples that each counts."""
    if published.track.name == HARD_TRACK:
        for name, method in methods.items():
            yield name, _hard(published, method)
        return
    judged = {name: judged_by_method(published, method).subset(chosen) for name, method in methods.items()}
    judged[CEILING] = ceiling(published).subset(chosen)
    of_samples = _of_scans if published.track.name == SCANS_TRACK else _of_causes
    for name, samples in judged.items():
        yield name, partial(of_samples, samples)


def _of_causes(samples: Judged, weights_B_N: np.ndarray) -> tuple[Measured, dict[str, np.ndarray]]:
    values = measure(samples, weights_B_N)
    return values, {metric: counted(samples, metric) for metric in values}


def _of_scans(samples: Judged, weights_B_N: np.ndarray) -> tuple[Measured, dict[str, np.ndarray]]:
    values = scan_measures(samples, weights_B_N)
    return values, {metric: counted_of_scans(samples, metric) for metric in values}


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


def counts(published: Published) -> dict[str, dict[str, int]]:
    """Return how many samples of each group are ``failed`` and ``nominal``; none for tracks of one group."""
    if not published.track.groups:
        return {}
    label_N = ceiling(published).label
    states = {"failed": (label_N != BORDERLINE) & (label_N != NOMINAL), NOMINAL: label_N == NOMINAL}
    return {
        name: {state: int(of_N[chosen].sum()) for state, of_N in states.items()}
        for name, chosen, _, _ in groups_of(published)
    }
