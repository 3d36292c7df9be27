"""Accuracies on depth frames over all seeds, with intervals over scenes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.predictions import read_predictions
from gpca.errors import InputError
from gpca.evaluation.intervals import Clustered, Estimate
from gpca.evaluation.measures import ALL, intervals, source_method_seed
from gpca.experiments.real_world.metrics import TOGETHER, parts_of_frames

if TYPE_CHECKING:
    import pandas as pd

SAMPLE = ["seed", "sample"]


def collect_intervals(
    prediction_files: Iterable[str | Path], pose_files: Iterable[str | Path], first: str
) -> pd.DataFrame:
    """Return accuracies of `real_world.csv` over all seeds, with 95 % intervals (:mod:`gpca.evaluation.measures`).

    - accuracy: of every part of the test samples that the column `table` names; of all of them by concept as well.
    - difference: of that of all from the first method's in the same seeds, on the same draws, where both have the same
      samples.

    Clusters are scenes; the draws of a source are the same for all methods.

    Args:
        prediction_files, pose_files: as for :func:`gpca.experiments.real_world.metrics.collect`.
        first: the method that the others of its source are compared with.

    Raises:
        InputError: see there.
    """
    import pandas as pd

    poses = {(Path(path).parts[-2], Path(path).stem): path for path in pose_files}
    frames: dict[tuple[str, str], list[pd.DataFrame]] = {}
    for path in prediction_files:
        source, method, seed = source_method_seed(path)
        if (of_source := poses.get((source, f"seed{seed}"))) is None:
            raise InputError(path, "has no pose file beside it", "regenerate both from the same config")
        rows = read_predictions(path)
        parts = dict(parts_of_frames(path, rows[rows["split"] == "test"], of_source))
        test = parts.pop(TOGETHER)
        is_in = {name: test.index.isin(part.index) for name, part in parts.items()}
        right = (test["concept_true"] == test["concept_predicted"]) & ~test["abstained"]
        frames.setdefault((source, method), []).append(test.assign(seed=seed, right=right, **is_in))
    together = {key: pd.concat(of_seeds, ignore_index=True) for key, of_seeds in frames.items()}
    records = []
    for (source, method), rows in together.items():
        samples = Clustered.drawn(rows["seed"], rows["cluster"], "frame intervals", source)
        for table, metric, concept, own, estimate in _estimates(rows, samples):
            records.append(own.record((table, source, method, metric, concept), estimate))
        other = together.get((source, first), rows.iloc[:0])
        other = other[other["seed"].isin(rows["seed"])].reset_index(drop=True)  # some methods have fewer seeds
        if method != first and rows[SAMPLE].equals(other[SAMPLE]):
            apart = samples.difference(rows["right"].to_numpy(), other["right"].to_numpy())
            records.append(samples.record((TOGETHER, source, method, "difference", ALL), apart))
    return intervals(records, "predictions")


def _estimates(rows: pd.DataFrame, samples: Clustered) -> Iterator[tuple[str, str, str, Clustered, Estimate]]:
    """Yield table, metric, concept, the samples that it is over, and the estimate of each accuracy."""
    right_N = rows["right"].to_numpy(bool)
    of_parts = {(TOGETHER, ALL): np.ones(len(rows), bool)}
    of_parts |= {(TOGETHER, name): rows["concept_true"].eq(name).to_numpy() for name in rows["concept_true"].unique()}
    parts = rows.columns[rows.columns.get_loc("right") + 1 :]
    of_parts |= {(name, ALL): rows[name].eq(True).to_numpy() for name in parts}
    for (table, concept), of_N in of_parts.items():
        own = samples.subset(of_N)
        yield table, "accuracy", concept, own, own.share(right_N[of_N])
