"""How well explainers name what is wrong with registrations of depth frames, and how many of these there are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.judged import CEILING, MEASURES, Judged, ceiling_of, joined, judged_by, measure
from gpca.causes.truth import BORDERLINE, FAILED, GEOMETRY
from gpca.errors import InputError
from gpca.evaluation.intervals import Difference, pigeonhole_weights
from gpca.experiments.diagnosis.metrics import COLUMNS, rows_of
from gpca.frames.source import REAL_WORLD
from gpca.frames.starts import KINDS
from gpca.io.container import require_same_samples
from gpca.io.csv_file import ANY, read_csv
from gpca.objects.canonical import BY_ICP
from gpca.seeds import generator, seed_of_file

if TYPE_CHECKING:
    import pandas as pd

SAMPLE_COLUMNS = ("sample", "instance", "start", "dataset", "scene", "truth", "missed")
SAMPLES = "test_samples"
STATE = "state_accuracy"
TRUTH = "truth"  # in the place of an explainer: how many there are of a kind, ``count_<kind>``
PSEUDO = "pseudo_truth"  # in the place of a kind of start: those whose true pose was made by ICP
COUNTED = ("starts", "instances", "scenes", "objects", *LABELS, BORDERLINE, GEOMETRY, "missed")


def collect(
    causes_files: Iterable[str | Path],
    sample_files: Iterable[str | Path],
    prediction_files: Iterable[str | Path],
    outside_files: Iterable[str | Path] = (),
) -> pd.DataFrame:
    """Return the intervals of the diagnosis for explainers that learned from no frame.

    The columns are those of :func:`gpca.experiments.diagnosis.metrics.collect_intervals`; the source is
    ``real_rgbd/{kind}`` of the kind of start, each a condition by itself. Beside its measures
    stands the number of `SAMPLES`; what has no value, as there are no samples for it, has no row.

    An instance counts once in a measure, however many starts and seeds it has, and intervals are over scenes, since
    frames of one scene are alike. Counts, of `COUNTED`, are of starts, and also those of each dataset,
    ``real_rgbd/{kind}/{dataset}``. Scenes whose truth was made by ICP are counted as `PSEUDO` and measure nothing.

    Args:
        causes_files, sample_files, prediction_files: one of each seed, in the same order, named ``…/seed{seed}.…``.
        outside_files: predictions of explainers from outside, each of one seed and named so too.

    Raises:
        InputError: files that cannot be read, or are of different samples.
    """
    import pandas as pd

    samples_of: dict[str, list[Judged]] = {}
    seen: list[pd.DataFrame] = []
    outside = list(outside_files)
    for seed, causes, samples, own in _seeds(causes_files, sample_files, prediction_files):
        further = [_predictions(path, causes) for path in outside if seed_of_file(path) == seed]
        predictions = pd.concat([own, *further])
        for explainer, said in predictions.groupby("explainer", sort=False):
            samples_of.setdefault(str(explainer), []).append(judged_by(said, causes, seed))
        samples_of.setdefault(CEILING, []).append(ceiling_of(causes, seed))
        truth = causes.truth
        state = np.where((truth.state == FAILED) & (truth.dominant == GEOMETRY), GEOMETRY, labels_of(truth))
        seen.append(samples.assign(state=state, seed=seed, object=causes.registrations.object_name))
    judged = {explainer: joined(parts) for explainer, parts in samples_of.items()}
    of_all = pd.concat(seen, ignore_index=True)
    of_all["scene"] = of_all["dataset"] + " " + of_all["scene"]
    rows: list[tuple] = []
    for kind, of_kind in _by_kind(of_all):
        rows += _counts(f"{REAL_WORLD}/{kind}", of_kind)
        for dataset, of_dataset in of_kind.groupby("dataset"):
            rows += _counts(f"{REAL_WORLD}/{kind}/{dataset}", of_dataset)
        if kind != PSEUDO:
            rows += _measures(kind, of_kind, {name: every.subset(of_kind.index) for name, every in judged.items()})
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _by_kind(samples: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield the samples of each kind of start that there are, and those that say nothing of ICP."""
    pseudo_N = samples["truth"] == BY_ICP
    chosen = {kind: (samples["start"] == kind) & ~pseudo_N for kind in KINDS} | {PSEUDO: pseudo_N}
    yield from ((kind, samples[rows]) for kind, rows in chosen.items() if rows.any())


def _measures(kind: str, samples: pd.DataFrame, judged: dict[str, Judged]) -> list[tuple]:
    random = generator("frame cause intervals", kind)
    drawn_B_N = pigeonhole_weights(random, samples["scene"].to_numpy(str))
    once_N = 1 / samples.groupby("instance")["instance"].transform("size").to_numpy(float)

    def measured(of_explainer: Judged, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
        return _measured(of_explainer, weights_B_N * once_N)

    return rows_of(f"{REAL_WORLD}/{kind}", judged, drawn_B_N, measured, (SAMPLES, *MEASURES))


def _seeds(*file_lists: Iterable[str | Path]) -> Iterator[tuple[int, Causes, pd.DataFrame, pd.DataFrame]]:
    files = [list(paths) for paths in file_lists]
    if not files[0] or len({len(paths) for paths in files}) > 1:
        raise InputError("causes of frames", "need files of every seed", "give the same number of each kind")
    for causes_file, sample_file, prediction_file in zip(*files, strict=True):
        causes = Causes.load(causes_file)
        samples = read_csv(sample_file, SAMPLE_COLUMNS, others=ANY)
        _require_same(sample_file, samples, causes)
        yield seed_of_file(causes_file), causes, samples[list(SAMPLE_COLUMNS)], _predictions(prediction_file, causes)


def _predictions(path: str | Path, causes: Causes) -> pd.DataFrame:
    predictions = read_predictions(path, labels=("explainer",))
    for _, rows in predictions.groupby("explainer"):
        _require_same(path, rows, causes)
    return predictions


def _require_same(path: str | Path, rows: pd.DataFrame, causes: Causes) -> None:
    require_same_samples(path, rows, causes.registrations.arrays, "causes", ("sample",))


def _measured(samples: Judged, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    measures = measure(samples, weights_B_N)
    measures[SAMPLES] = np.full(len(weights_B_N), float(len(samples)))  # also where nothing else can be measured
    return measures


def _counts(source: str, samples: pd.DataFrame) -> list[tuple]:
    """Return how many there are of each of `COUNTED`, with no interval and no rival."""
    counts = Counter(samples["state"].tolist())
    counts |= Counter({f"{name}s": samples[name].nunique() for name in ("instance", "scene", "object")})
    counts |= Counter(starts=len(samples), missed=int((samples["missed"] == "True").sum()))
    own, nothing = (len(samples), samples["seed"].nunique()), (np.nan, np.nan, *Difference().cells, *Difference().cells)
    return [(source, TRUTH, f"count_{kind}", *own, float(counts[kind]), *nothing) for kind in COUNTED]
