"""Makes Table VIII: policies of recovery on the same failures with the same number of actions."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.evaluation.measures import ALL
from gpca.experiments.recovery.differences import ERROR, SEQUENCE
from gpca.experiments.recovery.metrics import pool_share
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder, over_clusters
from gpca.reporting.tables.cells import clustered_cell, interval_cell, plain_cell, rows_where
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

AT_FIRST = ("acted_nominal", "queued", "left_alone")
AGAINST = {SEQUENCE: "best sequence", ERROR: "error only"}


def table8_recovery(
    metrics: pd.DataFrame,
    intervals: pd.DataFrame,
    differences: pd.DataFrame,
    seconds: Mapping[str, float],
    title: str,
    policies: Mapping[str, str],
    budget: int,
    success: float,
) -> Table:
    """Return recovery within 1 to `budget` actions, alone and against rivals, and the good ones acted on, by policy.

    Args:
        metrics: The tidy metrics that :func:`gpca.experiments.recovery.metrics.collect_recovery` makes.
        intervals: What :func:`gpca.experiments.recovery.intervals.collect_intervals` makes.
        differences: What :func:`gpca.experiments.recovery.differences.collect_differences` makes.
        seconds: The mean seconds of a failure, by policy.
        budget: The number of actions that a policy may take.
        success: The error of the pose from which a registration failed, in diameters.
    """
    seeds = metrics["seed"].nunique()
    within = [f"recovered_within_{k}" for k in range(1, budget + 1)]
    by_cause = {f"{within[-1]}_{cause}": cause for cause in CONCEPTS}
    leads = {f"{metric}_{against}": (metric, against) for against in AGAINST for metric in (within[0], within[-1])}
    table = TableBuilder("table8_recovery", {"policy": "Policy"})
    for policy, words in policies.items():
        shares = rows_where(intervals, method=policy)
        if shares.empty:
            continue
        cells = {key: clustered_cell(shares, metric=key, concept=ALL) for key in (*within, *AT_FIRST)}
        cells |= {key: clustered_cell(shares, metric=within[-1], concept=cause) for key, cause in by_cause.items()}
        for key, (metric, against) in leads.items():
            for _, row in rows_where(differences, policy=policy, metric=metric, against=against).iterrows():
                cells[key] = interval_cell(row, "difference")
        failures = int(rows_where(shares, metric=within[0], concept=ALL)["samples"].iloc[0])
        if mean := pool_share(metrics, policy, "cost"):
            cells["cost"] = plain_cell(mean[0], seeds, failures)
        if policy in seconds:
            cells["seconds"] = plain_cell(seconds[policy], seeds, failures)
        table.add_row([(policy, words)], cells)
    table.compare_down(within)
    failures = table.first_cell(within[0]).test_samples
    good = max((cell.test_samples for (_, key), cell in table.cells.items() if key == "acted_nominal"), default=0)
    return table.build(
        caption=f"Failed registrations recovered (%): {title}",
        column_head="metric",
        columns={
            **{key: Column(f"Within {k} (%)") for k, key in enumerate(within, start=1)},
            "acted_nominal": Column("Acts on good (%)", decimals=0, least_is_best=True),
            **{
                key: Column(f"{metric.rpartition('_')[2]}: to {AGAINST[against]} (points)", limits=(-100, 100))
                for key, (metric, against) in leads.items()
            },
            **{key: Column(f"{cause.capitalize()} (%)", decimals=0, interval=False) for key, cause in by_cause.items()},
            "queued": Column("Queued (%)", decimals=0, interval=False),
            "left_alone": Column("Taken for good (%)", decimals=0, interval=False, least_is_best=True),
            "cost": Column("Cost", decimals=3, interval=False, limits=(0, inf)),
            "seconds": Column("Seconds", decimals=2, interval=False, limits=(0, inf)),
        },
        footnotes=(
            f"{failures} failures over {plural(seeds, 'seed')}: {failure_counts(metrics)}. A failure is a pose off by "
            f"{100 * success:g} % of the diameter or more (ADD; ADD-S for symmetric objects) that is not off without "
            f"its cause. {over_clusters(seeds, clusters=('rendered tables', 'table'))}. Bold: best of a column.",
            f"Acts on good: of {good} registrations on the same tables whose pose is right, those that the policy "
            "would change. Policies that are told that a pose is wrong change all; the oracle is told of these too.",
            f"To best sequence, to error only: paired differences of the shares within 1 and within {budget} actions, "
            "with the 95 % interval of a bootstrap over tables and seeds that draws each failure for both. The best "
            "sequence is the fixed one, repeats of one action included, that does best on these very failures. "
            "Error only is the order that was best on the rehearsals: it knows that the pose is wrong, not why. "
            "Policies that recognize failures themselves are compared with its gated form, which has to as well.",
            f"Noise, Pose, Overlap: by cause, within {budget} actions. Queued: left to a person instead. Taken for "
            "good: failures that the policy leaves as they are. Cost: of all actions on a failure, mean; the config "
            "sets that of each action, and a repaired pose is worth 1. Seconds: of explaining, acting and registering, "
            "per failure; the camera's and the robot's own times are not in them.",
        ),
    )


def failure_counts(metrics: pd.DataFrame) -> str:
    """Return how many failures of how many registrations there are by cause, in words."""
    policy = metrics["method"].iloc[0]
    of_policy = metrics[metrics["method"] == policy]
    parts = []
    for cause in CONCEPTS:
        of_cause = of_policy[of_policy["concept"] == cause]
        failures, tries = (of_cause[of_cause["metric"] == m]["value"].sum() for m in ("episodes", "tries"))
        parts.append(f"{failures:.0f} by {cause} among {tries:.0f} registrations")
    return ", ".join(parts)
