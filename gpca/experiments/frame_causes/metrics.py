"""How well explainers name what is wrong with registrations of depth frames, and how many of these there are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.confidence import pigeonhole_weights
from gpca.attribution.paired import Difference
from gpca.attribution.predictions import read_predictions
from gpca.causes.dataset import LABELS, Causes, labels_of
from gpca.causes.truth import BORDERLINE, FAILED, GEOMETRY
from gpca.errors import InputError
from gpca.experiments.diagnosis.judged import CEILING, Judged, ceiling_of, joined, judged_by
from gpca.experiments.diagnosis.measures import MEASURES, measure
from gpca.experiments.diagnosis.metrics import COLUMNS, rows_of
from gpca.frames.source import REAL_WORLD
from gpca.io.csv_file import ANY, read_csv
from gpca.seeds import generator, seed_of_file

if TYPE_CHECKING:
    import pandas as pd

SAMPLE_COLUMNS = ("sample", "dataset", "scene")
SAMPLES = "test_samples"
STATE = "state_accuracy"
TRUTH = "truth"  # in the place of an explainer: how many there are of a kind, ``count_<kind>``
KINDS = (*LABELS, GEOMETRY, BORDERLINE, "scenes", "objects")


def collect(
    causes_files: Iterable[str | Path], sample_files: Iterable[str | Path], prediction_files: Iterable[str | Path]
) -> pd.DataFrame:
    """Return the intervals of the diagnosis for explainers that learned from no frame.

    The columns are those of :func:`gpca.experiments.diagnosis.metrics.collect_intervals`. Beside its measures
    stands the number of `SAMPLES`; what has no value, as there are no samples for it, has no row.
    Intervals are over scenes, objects and seeds, which are drawn with replacement each. The counts of `KINDS` are those
    of all frames, and of each dataset alone, ``real_rgbd/{dataset}``.

    Args:
        causes_files, sample_files, prediction_files: one of each seed, in the same order, named ``…/seed{seed}.…``.

    Raises:
        InputError: files that cannot be read, or are of different samples.
    """
    import pandas as pd

    samples_of: dict[str, list[Judged]] = {}
    seen: list[pd.DataFrame] = []
    for seed, causes, samples, predictions in _seeds(causes_files, sample_files, prediction_files):
        for explainer, rows in predictions.groupby("explainer", sort=False):
            samples_of.setdefault(str(explainer), []).append(judged_by(rows, causes, seed))
        samples_of.setdefault(CEILING, []).append(ceiling_of(causes, seed))
        truth = causes.truth
        kind = np.where((truth.state == FAILED) & (truth.dominant == GEOMETRY), GEOMETRY, labels_of(truth))
        seen.append(samples.assign(kind=kind, seed=seed, object=causes.registrations.object_name))
    judged = {explainer: joined(parts) for explainer, parts in samples_of.items()}
    of_all = pd.concat(seen)
    scene_N = (of_all["dataset"] + " " + of_all["scene"]).to_numpy(str)
    factors = of_all["seed"].to_numpy(), scene_N, of_all["object"].to_numpy(str)
    drawn_B_N = pigeonhole_weights(generator("frame cause intervals"), *factors)
    rows = _counts(REAL_WORLD, of_all)
    for dataset, of_dataset in of_all.groupby("dataset"):
        rows += _counts(f"{REAL_WORLD}/{dataset}", of_dataset)
    rows += rows_of(REAL_WORLD, judged, drawn_B_N, _measured, (SAMPLES, *MEASURES))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _seeds(*file_lists: Iterable[str | Path]) -> Iterator[tuple[int, Causes, pd.DataFrame, pd.DataFrame]]:
    files = [list(paths) for paths in file_lists]
    if not files[0] or len({len(paths) for paths in files}) > 1:
        raise InputError("causes of frames", "need files of every seed", "give the same number of each kind")
    for causes_file, sample_file, prediction_file in zip(*files, strict=True):
        causes = Causes.load(causes_file)
        numbers = [str(number) for number in causes.registrations.sample]
        samples = read_csv(sample_file, SAMPLE_COLUMNS, others=ANY)
        predictions = read_predictions(prediction_file, labels=("explainer",))
        of_explainers = [rows for _, rows in predictions.groupby("explainer")]
        for path, of_path in ((sample_file, [samples]), (prediction_file, of_explainers)):
            if any(rows["sample"].tolist() != numbers for rows in of_path):
                raise InputError(
                    path, "its samples differ from those of the causes", "regenerate both from the same config"
                )
        yield seed_of_file(causes_file), causes, samples[list(SAMPLE_COLUMNS)], predictions


def _measured(samples: Judged, weights_B_N: np.ndarray) -> dict[str, np.ndarray]:
    measures = measure(samples, weights_B_N)
    measures[SAMPLES] = np.full(len(weights_B_N), float(len(samples)))  # also where nothing else can be measured
    return measures


def _counts(source: str, rows: pd.DataFrame) -> list[tuple]:
    """Return how many there are of each kind, with no interval and no rival."""
    counts = Counter(rows["kind"].tolist())
    counts["scenes"] = len(set(zip(rows["dataset"], rows["scene"], strict=True)))
    counts["objects"] = rows["object"].nunique()
    own, nothing = (len(rows), rows["seed"].nunique()), (np.nan, np.nan, *Difference().cells, *Difference().cells)
    return [(source, TRUTH, f"count_{kind}", *own, float(counts[kind]), *nothing) for kind in KINDS]
