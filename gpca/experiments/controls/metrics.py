"""Turns the explainers' predictions under the controls into one tidy table of metrics."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.attribution.metrics import ALL, source_method_seed, tidy
from gpca.attribution.predictions import read_predictions
from gpca.errors import InputError
from gpca.experiments.controls.protocol import LABELS
from gpca.experiments.controls.settings import TRANSFER
from gpca.experiments.diagnosis.measures import ranking
from gpca.io.csv_file import numbers

if TYPE_CHECKING:
    import pandas as pd

KEYS = ("control", "source", "trained_on", "explainer", "seed")


def read_controls(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the columns `KEYS`, sample, instance, concept, right, entropy and bald (NaN where there is none).

    ``source`` is the one tested; ``instance`` names the object with its source, views of one instance together. An
    abstained sample is wrong.

    Args:
        prediction_files: named ``…/{source trained on}/seed{seed}.csv``.

    Raises:
        InputError: no files, or a file that cannot be read.
    """
    import pandas as pd

    frames = []
    for path in prediction_files:
        _, trained_on, seed = source_method_seed(path)
        rows = read_predictions(path, LABELS)
        instances = rows["tested"] + "/" + rows["cluster"]
        frames.append(
            pd.DataFrame(
                {
                    "control": rows["control"],
                    "source": rows["tested"],
                    "trained_on": trained_on,
                    "explainer": rows["explainer"],
                    "seed": seed,
                    "sample": rows["sample"],
                    "instance": instances,
                    "concept": rows["concept_true"],
                    "right": (rows["concept_true"] == rows["concept_predicted"]) & ~rows["abstained"],
                    "entropy": numbers(path, rows, "entropy"),
                    "bald": numbers(path, rows, "bald", needed=rows["bald"] != ""),
                }
            )
        )
    if not frames:
        raise InputError("controls", "no files were given", "name at least one explainer in controls.explainers")
    return pd.concat(frames, ignore_index=True)


def collect(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return tidy metrics of every control, source tested, explainer and seed; the column ``table`` is the control.

    - accuracy: share of the test samples that are named rightly.
    - auroc_error, auroc_error_bald: how well entropy, and BALD where there is one, tell wrong from right. Where nothing
      is wrong, or everything, there is none.
    - test_samples: their number.

    The column ``concept`` is ``all``, and for transfer the source that was trained on.

    Raises:
        InputError: see :func:`gpca.experiments.controls.metrics.read_controls`.
    """
    records = []
    judged = read_controls(prediction_files)
    for (control, source, trained_on, explainer, seed), rows in judged.groupby(list(KEYS), sort=False):
        concept = trained_on if control == TRANSFER else ALL
        found = {"accuracy": rows["right"].mean(), "test_samples": len(rows)}
        one_1_N = np.ones((1, len(rows)))
        for metric, score in (("auroc_error", "entropy"), ("auroc_error_bald", "bald")):
            found[metric] = auroc_error(rows, score, one_1_N)[0]
        records += [
            (control, source, explainer, metric, concept, seed, float(value))
            for metric, value in found.items()
            if np.isfinite(value)
        ]
    return tidy(records, "controls")


def auroc_error(rows: pd.DataFrame, score: str, weights_B_N: np.ndarray) -> np.ndarray:
    """Return the area (B,) under the ROC curve by which a score tells wrong from right; NaN where it cannot."""
    if rows[score].isna().any():
        return np.full(len(weights_B_N), np.nan)
    return ranking(rows[score].to_numpy(), ~rows["right"].to_numpy(), weights_B_N)["area"]
