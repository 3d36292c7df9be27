"""What explainers said under the controls, judged: one row per control, explainer and test sample."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.attribution.metrics import source_method_seed
from gpca.attribution.predictions import read_predictions
from gpca.errors import InputError
from gpca.experiments.controls.protocol import LABELS
from gpca.io.csv_file import numbers
from gpca.objects.surface import instance_of

if TYPE_CHECKING:
    import pandas as pd

KEYS = ("control", "source", "trained_on", "explainer", "seed")


def read_controls(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the columns `KEYS`, sample, instance, concept, right, entropy and bald (NaN where there is none).

    ``source`` is what was tested; ``instance`` names the object with its source, views of one instance together. An
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
        instances = rows["tested"] + "/" + rows["object"].map(instance_of)
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
