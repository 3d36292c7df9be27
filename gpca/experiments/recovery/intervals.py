"""Shares of cases that each policy recovers, acts on, queues or leaves alone, with intervals over tables and seeds."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gpca.evaluation.intervals import Clustered
from gpca.evaluation.measures import ALL, intervals
from gpca.experiments.recovery.metrics import TABLE, is_action, read_recovery
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.policy import NOTHING, QUEUE
from gpca.seeds import seed_of_file

if TYPE_CHECKING:
    import pandas as pd

CASE = ["seed", "table", "episode"]


def collect_intervals(files: Iterable[str | Path], budget: int) -> pd.DataFrame:
    """Return shares of `recovery.csv` over all seeds with 95 % intervals (:mod:`gpca.evaluation.measures`).

    - recovered_within_1 …, queued, left_alone: shares of the failures, of all and by cause.
    - acted_nominal: share of the registrations that did not fail, of all.

    A cluster is a rendered table of a seed; the draws are the same for all policies.

    Args:
        files: named `…/seed{seed}.csv`, of the step ``recover``.
        budget: actions per failure.

    Raises:
        InputError: no files, a name of another form, a missing column, no rows.
    """
    import pandas as pd

    parts = [read_recovery(path).assign(seed=seed_of_file(path)) for path in files]
    records: list[tuple] = []
    for policy, rows in pd.concat(parts).groupby("policy", sort=False) if parts else ():
        failures, fine = _answers(rows[rows["failed"]], budget), rows[~rows["failed"]]
        samples = _clustered(failures)
        for cause in (ALL, *CONCEPTS):
            of_cause = np.flatnonzero((cause == ALL) | (failures["cause"] == cause))
            for metric in failures.columns.drop([*CASE, "cause"]) if len(of_cause) else ():
                own = samples.subset(of_cause)
                share = own.share(failures[metric].to_numpy()[of_cause])
                records.append(own.record((TABLE, TABLE, str(policy), metric, cause), share))
        if len(fine):
            own = _clustered(fine)
            share = own.share(is_action(fine).to_numpy())
            records.append(own.record((TABLE, TABLE, str(policy), "acted_nominal", ALL), share))
    return intervals(records, "recovery")


def _answers(rows: pd.DataFrame, budget: int) -> pd.DataFrame:
    """Return a row for each failure: its `CASE` and cause, and whether each of the shares counts it."""
    recovered = rows["step"].where(rows["recovered"], np.inf)
    told = rows.assign(recovered=recovered, queued=rows["action"] == QUEUE)
    cases = told.groupby([*CASE, "cause"], sort=False).agg(
        step=("recovered", "min"), queued=("queued", "any"), first=("action", "first")
    )
    within = {f"recovered_within_{k}": cases["step"] <= k for k in range(1, budget + 1)}
    return cases.assign(**within, left_alone=cases["first"] == NOTHING).drop(columns=["step", "first"]).reset_index()


def _clustered(cases: pd.DataFrame) -> Clustered:
    tables = [f"{seed}/{table}" for seed, table in zip(cases["seed"], cases["table"], strict=True)]
    return Clustered.drawn(cases["seed"], tables, "recovery intervals")
