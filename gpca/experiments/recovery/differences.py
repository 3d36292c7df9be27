"""Paired differences between policies: on the same failures, from the best fixed sequence, and from "error only"."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.evaluation.intervals import interval, pigeonhole_weights
from gpca.experiments.recovery.metrics import read_recovery
from gpca.io.csv_file import read_numbers
from gpca.recovery.policies import ERROR_ONLY, is_fixed, policy_entry
from gpca.seeds import generator, seed_of_file

if TYPE_CHECKING:
    import pandas as pd

SEQUENCE, ERROR = "sequence", "error"  # what a policy is compared with
COLUMNS = ("policy", "metric", "against", "rival", "seeds", "samples", "difference", "low", "high")


def collect_differences(files: Iterable[str | Path], actions: Sequence[str], budget: int) -> pd.DataFrame:
    """Return for every policy, number of actions and rival the difference of the shares that they recover.

    Its 95 % interval is that of a bootstrap over tables and seeds, which draws each case for both policies at once.

    The rivals are the best fixed sequence, repeats of one action included, by the same number on the same failures, in
    hindsight; and the order that was best on the rehearsals: gated for a policy that has to recognize failures itself.

    Args:
        files: named `…/seed{seed}.csv`, of the step ``recover``.
        actions: the names of all.
        budget: actions per failure.

    Raises:
        InputError: a name of another form, a missing column, no rows.
    """
    import pandas as pd

    parts = [read_recovery(path).assign(seed=seed_of_file(path)) for path in files]
    rows = pd.concat(parts, ignore_index=True)
    steps = steps_of(rows[rows["failed"]])
    clusters = (np.array([seed for seed, _, _ in steps.index]), np.array([f"{s}/{t}" for s, t, _ in steps.index]))
    weights_B_N = pigeonhole_weights(generator("recovery differences"), *clusters)
    names = [str(name) for name in steps.columns]
    fixed = [name for name in names if is_fixed(name, actions)]
    records = []
    for k in range(1, budget + 1):
        solved = {name: (steps[name] <= k).to_numpy(float) for name in names}
        best = max(fixed, key=lambda name: solved[name].sum(), default="")
        for name in names:
            rivals = {SEQUENCE: best, ERROR: ERROR_ONLY[policy_entry(name, actions).told]}
            for against, rival in rivals.items():
                if rival in solved and rival != name:
                    counts = (len(set(clusters[0].tolist())), len(steps))
                    difference = _difference(solved[name] - solved[rival], weights_B_N)
                    records.append((name, f"recovered_within_{k}", against, rival, *counts, *difference))
    return pd.DataFrame(records, columns=[*COLUMNS])


def steps_of(failures: pd.DataFrame) -> pd.DataFrame:
    """Return for every failure (seed, table, episode) and policy after how many actions it was recovered, or inf."""
    case = ["seed", "table", "episode"]
    step = failures["step"].where(failures["recovered"], np.inf)
    return step.groupby([*(failures[name] for name in case), failures["policy"]], sort=False).min().unstack()


def read_differences(path: str | Path) -> pd.DataFrame:
    """Read what :func:`collect_differences` returned.

    Raises:
        InputError: missing or unreadable file, missing column, no rows, a value that is no finite number.
    """
    return read_numbers(path, COLUMNS, COLUMNS[4:])


def _difference(difference_N: np.ndarray, weights_B_N: np.ndarray) -> tuple[float, float, float]:
    with np.errstate(invalid="ignore"):  # a draw of tables without failures has no share
        differences_B = weights_B_N @ difference_N / weights_B_N.sum(axis=1)
    return interval(np.append(difference_N.mean(), differences_B), weights_B_N, difference=True)
