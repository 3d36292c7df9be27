"""Turns registrations into metrics of every source, method, cause and severity, in one tidy table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpca.alignment.pose_error import SuccessSettings, success_within
from gpca.evaluation.measures import ALL, source_method_seed, tidy
from gpca.io.csv_file import numbers, read_csv
from gpca.pairs.perturbation import CONCEPTS, SEVERITIES

if TYPE_CHECKING:
    import pandas as pd

INITIAL, NO_START = "initial", "none"  # where a registration starts, or the name of a global method
SEVERITY_COLUMNS = tuple(f"severity_{name}" for name in SEVERITIES)
MEASURED = ("add_relative", "rotation_error_rad", "translation_error")
POINTS = "points"  # of a cloud: the mean of source and target
COLUMNS = ("sample", "concept", "start", "failure", *SEVERITY_COLUMNS, *MEASURED, POINTS)
TABLE = "registration_methods"  # `table` of the tidy rows reads this
TIMED = "method_"  # with a method behind it, the folder of its seconds
BINS = ("low", "middle", "high")  # thirds of what is drawn
# Which severities a concept has: the column, the config's range, and the factor from that to the column's unit.
DRAWN = {
    "noise": (("severity_noise", "noise", 1.0),),
    "pose": (("severity_rotation_rad", "rotation_deg", np.pi / 180), ("severity_translation", "translation", 1.0)),
    "overlap": (("severity_crop", "crop", 1.0),),
}


def row_name(method: str, start: str) -> str:
    """Return e.g. ``gicp``, from its own initial pose, or ``fgr+gicp``, from that of another method."""
    return method if start in (INITIAL, NO_START) else f"{start}+{method}"


def read_trials(path: str | Path) -> pd.DataFrame:
    """Read a file of the step ``register_methods``: numbers as numbers, the rest as text."""
    rows = read_csv(path, COLUMNS, others=("object", "symmetric", "fitness", "inlier_rmse"))
    for name in (*SEVERITY_COLUMNS, *MEASURED, POINTS):
        rows[name] = numbers(path, rows, name)
    return rows


def collect_trials(
    files: Iterable[str | Path], severities: Mapping[str, Iterable[float]], success: Mapping[str, Any]
) -> pd.DataFrame:
    """Return the tidy metrics of files named `…/{source}/{method}/seed{seed}.csv`; results/README.md lists them.

    Their `method` is named by :func:`row_name`; their `concept` is a cause, a cause and a bin, or all.

    Args:
        severities: the config's ranges, from which the registrations were drawn.
        success: the config's section.

    Raises:
        InputError: no files, a name of another form, a missing column, no rows, an unknown cause.
    """
    limits = SuccessSettings(**success)
    records = []
    for path in files:
        source, method, seed = source_method_seed(path)
        rows = read_trials(path)
        groups = _groups(rows, severities)
        for start, of_start in rows.groupby("start", sort=False):
            for concept, chosen in groups.items():
                of_concept = of_start[chosen[of_start.index]]
                if of_concept.empty:
                    continue
                values = _metrics(of_concept, limits.error)
                if concept == ALL:
                    values |= {success_within(limit): _success(of_concept, limit) for limit in limits.curve}
                    values[POINTS] = of_concept[POINTS].mean()
                row = (TABLE, source, row_name(method, start))
                records += [(*row, metric, concept, seed, float(value)) for metric, value in values.items()]
    return tidy(records, "registration methods")


def collect_seconds(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return mean `seconds`, tidy as :func:`collect_trials`, of files `…/{source}/method_{method}/seed{seed}.csv`.

    Apart from the metrics, because times differ from run to run and metrics must not.
    """
    records = []
    for path in files:
        source, folder, seed = source_method_seed(path)
        rows = read_csv(path, ("sample", "start", "seconds"))
        rows["seconds"] = numbers(path, rows, "seconds", least=0)
        for start, mean in rows.groupby("start", sort=False)["seconds"].mean().items():
            name = row_name(folder.removeprefix(TIMED), start)
            records.append((TABLE, source, name, "seconds", ALL, seed, float(mean)))
    return tidy(records, "seconds of registration methods")


def bin_name(concept: str, severity: str) -> str:
    """Return e.g. ``noise_low``."""
    return f"{concept}_{severity}"


def _groups(rows: pd.DataFrame, severities: Mapping[str, Iterable[float]]) -> dict[str, pd.Series]:
    """Return which rows are of each cause, and of each bin of it."""
    groups = {ALL: rows["concept"].notna()}
    for concept in CONCEPTS:
        of_concept = rows["concept"] == concept
        bin_S = np.minimum(3 * share_of_milder(rows, concept, severities), 2).astype(int)
        groups[concept] = of_concept
        groups |= {bin_name(concept, name): of_concept & (bin_S == i) for i, name in enumerate(BINS)}
    return groups


def share_of_milder(rows: pd.DataFrame, concept: str, severities: Mapping[str, Iterable[float]]) -> np.ndarray:
    """Return the share of a cause's drawn severities that is milder than each row, in [0, 1].

    A pose error has two severities, each uniform in its range; it is as severe as the mean of its places in the two.
    """
    places = []
    for column, name, factor in DRAWN[concept]:
        low, high = severities[name]
        width = max(high - low, 1e-12)  # a range of one value: all are alike
        places.append(np.clip((rows[column].to_numpy() / factor - low) / width, 0, 1))
    mean_S = np.mean(places, axis=0)
    if len(places) == 1:
        return mean_S
    return np.where(mean_S < 0.5, 2 * mean_S**2, 1 - 2 * (1 - mean_S) ** 2)  # of the mean of two uniform numbers


def _success(rows: pd.DataFrame, limit: float) -> float:
    """Return the share with an error below a limit; a method that gave up has no success."""
    return ((rows["failure"] == "") & (rows["add_relative"] < limit)).mean()


def _metrics(rows: pd.DataFrame, limit: float) -> dict[str, float]:
    return {
        "success": _success(rows, limit),
        "failed": (rows["failure"] != "").mean(),
        "add": rows["add_relative"].mean(),
        "rotation_deg": np.rad2deg(rows["rotation_error_rad"].mean()),
        "translation": rows["translation_error"].mean(),
        "test_samples": len(rows),
    }
