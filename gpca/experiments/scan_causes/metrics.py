"""How well explainers tell failed registrations of scans, and name their causes; and how many there are of each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.judged import (
    CEILING,
    SHARES,
    SMALLER_IS_BETTER,
    Judged,
    ceiling_of,
    counted,
    joined,
    judged_by,
    measure,
)
from gpca.causes.scans import KINDS
from gpca.causes.truth import BORDERLINE, FAILED, GEOMETRY
from gpca.errors import InputError
from gpca.evaluation.intervals import Difference, best_of, difference, interval, pigeonhole_weights
from gpca.evaluation.measures import POOLED
from gpca.experiments.scan_causes.settings import SCANS
from gpca.io.container import require_same_samples
from gpca.io.csv_file import ANY, numbers, read_csv, read_numbers
from gpca.pairs.perturbation import CONCEPTS
from gpca.scans.scene import stratum_of
from gpca.seeds import generator, seed_of_file

if TYPE_CHECKING:
    import pandas as pd

SAMPLE_COLUMNS = ("sample", "cluster", "overlap", "start", "times", "missed")
COLUMNS = (
    *("source", "condition", "stratum", "learned", "method", "metric", "samples", "clusters", "seeds"),
    *("value", "low", "high", "gate", "difference", "difference_low", "difference_high"),
)
NUMBERS = tuple(name for name in COLUMNS[6:] if name != "gate")
TRUTH = "truth"  # in the place of an explainer: how many there are of a kind, ``count_<kind>``
EVERY = "all"  # strata
NATURAL, ADDED = "natural", "noise_added"  # conditions of what is measured; counts are of kinds of start as well
COUNTED = ("registrations", "pairs", "clusters", *LABELS, BORDERLINE, GEOMETRY, "missed")
GATE = "gate_"  # how the names of gates begin
CAUSES = "cause_accuracy"
SAMPLES = "test_samples"  # that are nominal or failed; also where nothing else can be measured
MEASURED = (SAMPLES, "auroc_failed", "false_alarm_rate", "state_accuracy", CAUSES, "regret")
FEWEST_OF_A_CAUSE = 5  # failures, or the cause counts in no mean over causes


def collect(
    causes_files: Iterable[str | Path],
    sample_files: Iterable[str | Path],
    prediction_files: Iterable[str | Path],
    overlaps: Sequence[float],
) -> pd.DataFrame:
    """Return values with 95 % intervals of a bootstrap over clusters of scenes and seeds, and counts.

    Sources are data sets of scans, and all of them together. ``difference`` is how far an explainer lies above the best
    gate, on the same draws.

    Args:
        causes_files, sample_files: of each data set and seed, in the same order, named ``…/{scans}/seed{seed}.…``.
        prediction_files: one of each seed.
        overlaps: edges of the strata.

    Raises:
        InputError: files that cannot be read, or are of different samples.
    """
    import pandas as pd

    seen, judged = _read(causes_files, sample_files, prediction_files)
    seen["stratum"] = [stratum_of(overlap, overlaps) or "" for overlap in seen["overlap"]]
    rows: list[tuple] = []
    for source in _sources(seen):
        of_source = np.ones(len(seen), bool) if source == POOLED else (seen["scans"] == source).to_numpy()
        for condition, rows_N in _conditions(seen).items():
            of_N = of_source & rows_N
            for stratum in (EVERY, *sorted(set(seen["stratum"]))):
                in_stratum = of_N if stratum == EVERY else of_N & (seen["stratum"] == stratum).to_numpy()
                if in_stratum.any():
                    rows += _counts((source, condition, stratum), seen[in_stratum])
            if condition in (NATURAL, ADDED) and of_N.any():
                parts = {key: every.subset(of_N) for key, every in judged.items()}
                rows += _measures((source, condition, EVERY), parts, seen["cluster"][of_N].to_numpy(str))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def read_scan_causes(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect` returned; a value may lack an interval, and a distance from a gate.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a value that is no finite number.
    """
    return read_numbers(path, COLUMNS, NUMBERS, optional=NUMBERS[4:])


def _sources(seen: pd.DataFrame) -> list[str]:
    sources = list(dict.fromkeys(seen["scans"]))
    return [POOLED, *sources] if len(sources) > 1 else sources


def _conditions(seen: pd.DataFrame) -> dict[str, np.ndarray]:
    """Return which registrations (N,) each condition has: natural ones of all starts or of a kind, and the noisy."""
    added_N = seen["times"].to_numpy() > 0
    of_kind = {f"{NATURAL}_{kind}": ~added_N & (seen["start"] == kind).to_numpy() for kind in KINDS}
    of_times = {
        f"{ADDED}_{times:g}": seen["times"].to_numpy() == times for times in sorted(set(seen["times"])) if times
    }
    return {NATURAL: ~added_N, ADDED: added_N} | of_kind | of_times


def _read(causes_files, sample_files, prediction_files) -> tuple[pd.DataFrame, dict[tuple[str, str], Judged]]:
    """Return a row for each registration, and what each explainer said of all, by where it learned and its name."""
    import pandas as pd

    said_of = {seed_of_file(path): _by_explainer(path) for path in prediction_files}
    seen: list[pd.DataFrame] = []
    judged: dict[tuple[str, str], list[Judged]] = {}
    for causes_file, sample_file in zip(causes_files, sample_files, strict=True):
        source, seed = Path(causes_file).parent.name, seed_of_file(causes_file)
        causes = Causes.load(causes_file, (source, seed))
        samples = read_csv(sample_file, SAMPLE_COLUMNS, others=ANY)
        samples = samples.assign(**{name: numbers(sample_file, samples, name) for name in ("overlap", "times")})
        said = {key: rows[rows["scans"] == source] for key, rows in said_of.get(seed, {}).items()}
        for path, rows in ((sample_file, samples), *((causes_file, rows) for rows in said.values())):
            require_same_samples(path, rows, causes.registrations.arrays, "causes or the predictions", ("sample",))
        for key, rows in said.items():
            judged.setdefault(key, []).append(judged_by(rows, causes, seed))
        judged.setdefault(("", CEILING), []).append(ceiling_of(causes, seed))
        truth = causes.truth
        label = np.where((truth.state == FAILED) & (truth.dominant == GEOMETRY), GEOMETRY, labels_of(truth))
        pair = [f"{source} {name}" for name in causes.registrations.object_name]
        seen.append(samples[list(SAMPLE_COLUMNS)].assign(scans=source, seed=seed, label=label, pair=pair))
    if not seen:
        raise InputError("causes of scans", "no files were given", "name a data set of scans in the config")
    if short := [key for key, parts in judged.items() if len(parts) != len(seen)]:
        fault = f"explainer '{short[0][1]}' has no predictions of some data set or seed"
        raise InputError("predictions of scans", fault, "regenerate them")
    return pd.concat(seen, ignore_index=True), {key: joined(parts) for key, parts in judged.items()}


def _by_explainer(path: str | Path) -> dict[tuple[str, str], pd.DataFrame]:
    rows = read_predictions(path, labels=("scans", "learned", "explainer"))
    groups = rows.groupby(["learned", "explainer"], sort=False)
    return {(str(learned), str(name)): of_name for (learned, name), of_name in groups}


def _measures(
    place: tuple[str, str, str], judged: dict[tuple[str, str], Judged], cluster_N: np.ndarray
) -> Iterator[tuple]:
    any_samples = next(iter(judged.values()))
    drawn_B_N = pigeonhole_weights(generator("scan cause intervals", *place), any_samples.seed, cluster_N)
    weights_B_N = np.vstack([np.ones(len(any_samples)), drawn_B_N])
    values = {key: scan_measures(samples, weights_B_N) for key, samples in judged.items()}
    names = {key: "/".join(key).strip("/") for key in judged}
    for metric, key in product(MEASURED, judged):
        of_metric = {names[other]: of_other[metric] for other, of_other in values.items() if metric in of_other}
        if names[key] not in of_metric or not np.isfinite(of_metric[names[key]][0]):
            continue
        counted_N = counted_of_scans(any_samples, metric)
        drawn_B_n = drawn_B_N[:, counted_N] if metric in (*SHARES, CAUSES) else None
        gates = [names[other] for other in judged if other[1].startswith(GATE) and other != key]
        lead = Difference()
        if key[1] != CEILING and metric != SAMPLES:
            gate = best_of(of_metric, gates, metric in SMALLER_IS_BETTER)
            lead = difference(of_metric, names[key], gate, drawn_B_n)
        value_B = of_metric[names[key]]
        counts = int(counted_N.sum()), len(set(cluster_N[counted_N])), len(set(any_samples.seed[counted_N].tolist()))
        yield (*place, *key, metric, *counts, *interval(value_B, drawn_B_n), *lead.cells)


def scan_measures(samples: Judged, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    """Return the measures (B,) of a diagnosis, those of scans alone among them, by weights of the samples (B, N)."""
    measures = measure(samples, weights_B_N)
    measures[SAMPLES] = np.full(len(weights_B_N), float((samples.label != BORDERLINE).sum()))
    if samples.names_causes:
        measures[CAUSES] = _cause_accuracy(samples, weights_B_N)
    return measures


def _cause_accuracy(samples: Judged, weights_B_N: np.ndarray) -> np.ndarray:
    """Return (B,) the mean, over the causes by which enough failed, of the share whose cause has the largest score."""
    named_N = np.array(CONCEPTS)[samples.scores.argmax(axis=1)]
    recalls = []
    for concept in _frequent(samples):
        of_N = samples.label == concept
        with np.errstate(divide="ignore", invalid="ignore"):
            right_B = (weights_B_N[:, of_N] * (named_N[of_N] == concept)).sum(axis=1)
            recalls.append(right_B / weights_B_N[:, of_N].sum(axis=1))
    return np.mean(recalls, axis=0) if recalls else np.full(len(weights_B_N), np.nan)


def _frequent(samples: Judged) -> list[str]:
    return [concept for concept in CONCEPTS if (samples.label == concept).sum() >= FEWEST_OF_A_CAUSE]


def counted_of_scans(samples: Judged, metric: str) -> np.ndarray:
    """Return which samples (N,) a measure is taken over."""
    return np.isin(samples.label, _frequent(samples)) if metric == CAUSES else counted(samples, metric)


def _counts(place: tuple[str, str, str], samples: pd.DataFrame) -> list[tuple]:
    """Return how many there are of each of `COUNTED`, with no interval."""
    counts = Counter(samples["label"].tolist())
    counts |= Counter({f"{name}s": samples[name].nunique() for name in ("pair", "cluster")})
    counts |= Counter(registrations=len(samples), missed=int((samples["missed"] == "True").sum()))
    own = (len(samples), samples["cluster"].nunique(), samples["seed"].nunique())
    nothing = (np.nan, np.nan, *Difference().cells)
    return [(*place, SCANS, TRUTH, f"count_{kind}", *own, float(counts[kind]), *nothing) for kind in COUNTED]
