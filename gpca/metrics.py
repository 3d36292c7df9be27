"""From predictions to numbers: accuracy over the test rows of every source, explainer and seed, as one tidy table.

An abstained sample counts as wrong, so that an explainer cannot gain by staying silent.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

ALL = "all"  # stands for every concept together in the column `concept`
COLUMNS = ("table", "source", "method", "metric", "concept", "seed", "value")
_PREDICTION_COLUMNS = ("sample", "split", "object", "concept_true", "concept_predicted", "abstained")
_TIMING_COLUMNS = ("sample", "seconds", "icp_seconds")
_TRUTH = {"true": True, "1": True, "false": False, "0": False}


def accuracy(concept_true_S: np.ndarray, concept_predicted_S: np.ndarray, abstained_S: np.ndarray) -> float:
    """Return the share in [0, 1] of the S samples whose concept was named and right; S = 0 raises ValueError."""
    if len(concept_true_S) == 0:
        raise ValueError("accuracy of no samples")
    return float(np.mean((concept_true_S == concept_predicted_S) & ~abstained_S))


def concept_accuracy(
    concept_true_S: np.ndarray, concept_predicted_S: np.ndarray, abstained_S: np.ndarray, concepts: Iterable[str]
) -> dict[str, float]:
    """Return for each concept the accuracy over the samples that truly are of it (its recall).

    A concept without samples is left out: its accuracy is not defined.
    """
    of_concept = {concept: concept_true_S == concept for concept in concepts}
    return {
        concept: accuracy(concept_true_S[mask], concept_predicted_S[mask], abstained_S[mask])
        for concept, mask in of_concept.items()
        if mask.any()
    }


def mean_interval(values_R: Iterable[float], level: float = 0.95) -> tuple[float, float, float]:
    """Return the mean of R repeats and the bounds of its Student t-interval, mean ± t_{R-1} s / √R.

    The bounds are symmetric about the mean and not clipped, as the function does not know what the values are.
    One repeat has NaN bounds; none raises ValueError. No repeat is ever dropped: a NaN makes all three NaN.
    """
    from scipy.stats import t as student_t

    values_R = np.asarray(list(values_R), dtype=float)
    if values_R.size == 0:
        raise ValueError("interval of no repeats")
    mean = float(values_R.mean())
    if values_R.size == 1:
        return mean, np.nan, np.nan
    standard_error = values_R.std(ddof=1) / np.sqrt(values_R.size)
    half_width = float(student_t.ppf((1 + level) / 2, values_R.size - 1) * standard_error)
    return mean, mean - half_width, mean + half_width


def read_predictions(path: str | Path) -> pd.DataFrame:
    """Read a prediction file as it is: text, numbers in `score_…` and `variance_…`, `abstained` as bool.

    Raises:
        InputError: missing, empty or unreadable file; missing column; a concept without a score column; a sample
            twice in one split; a split other than train and test; a score that is not a finite number; a variance
            that is neither that nor empty.
    """
    rows = _read_csv(path, _PREDICTION_COLUMNS)
    concepts = concepts_of(rows)
    if not concepts:
        raise InputError(path, "has no column score_<concept>", "make it anew")
    rows["abstained"] = rows["abstained"].str.lower().map(_TRUTH)
    if rows["abstained"].isna().any():
        raise InputError(path, "column 'abstained' holds something other than True and False", "make it anew")
    rows["abstained"] = rows["abstained"].astype(bool)
    for column in ("concept_true", "concept_predicted"):
        known = rows[column].isin(concepts)
        if column == "concept_predicted":
            known |= rows["abstained"] & (rows[column] == "")
        if not known.all():
            unknown = rows.loc[~known, column].iloc[0]
            raise InputError(
                path, f"unknown concept '{unknown}' in '{column}'", f"its concepts are {', '.join(concepts)}"
            )
    if not rows["split"].isin(["train", "test"]).all():
        raise InputError(path, "column 'split' holds something other than train and test", "make it anew")
    if rows.duplicated(["split", "sample"]).any():
        raise InputError(path, "holds a sample twice", "make it anew")
    for column in (name for name in rows.columns if name.startswith(("score_", "variance_"))):
        # Every explainer that does not abstain has scores; one without variances leaves them empty.
        needed = ~rows["abstained"] if column.startswith("score_") else rows[column] != ""
        rows[column] = _numbers(path, rows, column, needed)
    return rows


def concepts_of(predictions: pd.DataFrame) -> list[str]:
    """Return the concepts that predictions score, in the order of their columns."""
    return [name.removeprefix("score_") for name in predictions.columns if name.startswith("score_")]


def collect(prediction_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return the tidy metrics (`COLUMNS`) of prediction files named `…/{source}/{explainer}/seed{seed}.csv`.

    Over the test rows of each: `accuracy` and `test_samples` of all concepts and of each, and `abstention_rate`;
    the column `table` is "attribution". Values are shares in [0, 1] or counts. Rows follow the order of the files.

    Raises:
        InputError: no files, a name of another form, or a file that :func:`read_predictions` refuses or that has
            no test rows.
    """
    records = []
    for path in prediction_files:
        source, method, seed = _key(path)
        rows = read_predictions(path)
        concepts = concepts_of(rows)
        test = rows[rows["split"] == "test"]
        if test.empty:
            raise InputError(path, "holds no test rows", "make it anew")
        true_S, predicted_S = test["concept_true"].to_numpy(), test["concept_predicted"].to_numpy()
        abstained_S = test["abstained"].to_numpy()
        accuracies = {ALL: accuracy(true_S, predicted_S, abstained_S)}
        accuracies |= concept_accuracy(true_S, predicted_S, abstained_S, concepts)
        samples = {concept: len(test) if concept == ALL else int(np.sum(true_S == concept)) for concept in accuracies}
        for metric, of_concept in (
            ("accuracy", accuracies),
            ("test_samples", samples),
            ("abstention_rate", {ALL: float(abstained_S.mean())}),
        ):
            records += [("attribution", source, method, metric, c, seed, float(v)) for c, v in of_concept.items()]
    return _tidy(records, "predictions")


def collect_timings(timing_files: Iterable[str | Path]) -> pd.DataFrame:
    """Return mean `seconds_per_sample` and `icp_seconds_per_sample`, tidy as :func:`collect`, with table "runtime".

    Apart from the metrics, because times differ from run to run and metrics must not.
    """
    records = []
    for path in timing_files:
        source, method, seed = _key(path)
        rows = _read_csv(path, _TIMING_COLUMNS)
        for column in ("seconds", "icp_seconds"):
            mean = float(_numbers(path, rows, column).mean())
            records.append(("runtime", source, method, f"{column}_per_sample", ALL, seed, mean))
    return _tidy(records, "timings")


def read_metrics(path: str | Path) -> pd.DataFrame:
    """Read a tidy file that :func:`collect` or :func:`collect_timings` made.

    Raises:
        InputError: missing, empty or unreadable file, missing column, a seed or value that is not a finite number.
    """
    rows = _read_csv(path, COLUMNS)
    rows["seed"] = _numbers(path, rows, "seed").astype(int)
    rows["value"] = _numbers(path, rows, "value")
    return rows


def write_metrics(metrics: pd.DataFrame, path: str | Path) -> None:
    """Write tidy metrics as CSV; floats keep every digit, so that equal metrics give equal bytes."""
    from gpca.files import whole_file

    with whole_file(path) as partial:
        metrics.to_csv(partial, index=False, lineterminator="\n")


def _key(path: str | Path) -> tuple[str, str, int]:
    parts = Path(path).with_suffix("").parts
    seed = parts[-1].removeprefix("seed") if parts else ""
    if len(parts) < 3 or not parts[-1].startswith("seed") or not seed.isdecimal():
        raise InputError(path, "is not named …/{source}/{explainer}/seed{number}.csv", "rename it")
    return parts[-3], parts[-2], int(seed)


def _read_csv(path: str | Path, columns: Iterable[str]) -> pd.DataFrame:
    import pandas as pd

    try:
        rows = pd.read_csv(path, dtype=str, keep_default_na=False)
    except FileNotFoundError as fault:
        raise InputError(path, "no such file", "make it with snakemake") from fault
    except pd.errors.EmptyDataError as fault:
        raise InputError(path, "is empty", "make it anew") from fault
    except (pd.errors.ParserError, UnicodeDecodeError, OSError) as fault:
        raise InputError(path, f"is not a readable CSV file ({fault})", "make it anew") from fault
    missing = [column for column in columns if column not in rows.columns]
    if missing:
        raise InputError(path, f"column '{missing[0]}' is missing", "make it anew")
    if rows.empty:
        raise InputError(path, "holds no rows", "make it anew")
    return rows


def _numbers(path: str | Path, rows: pd.DataFrame, column: str, needed=True) -> pd.Series:
    import pandas as pd

    numbers = pd.to_numeric(rows[column], errors="coerce").astype(float)
    if (~np.isfinite(numbers) & needed).any():
        raise InputError(path, f"column '{column}' holds something that is not a finite number", "make it anew")
    return numbers


def _tidy(records: list[tuple], name: str) -> pd.DataFrame:
    import pandas as pd

    if not records:
        raise InputError(name, "no files were given", "name at least one explainer in the config")
    return pd.DataFrame(records, columns=list(COLUMNS))
