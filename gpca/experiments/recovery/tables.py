"""Makes Table VIII: policies of recovery on the same failures with the same number of actions."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING

from gpca.experiments.recovery.metrics import pool_share
from gpca.pairs.perturbation import CONCEPTS
from gpca.reporting.tables.builder import TableBuilder
from gpca.reporting.tables.cells import WILSON, plain_cell, share_cell
from gpca.reporting.tables.table import Column, Table
from gpca.reporting.words import plural

if TYPE_CHECKING:
    import pandas as pd

AT_FIRST = ("wrong_first", "queued", "left_alone", "acted_nominal")


def table8_recovery(
    metrics: pd.DataFrame, seconds: Mapping[str, float], title: str, policies: Mapping[str, str], budget: int
) -> Table:
    """Return recovery within 1 to `budget` actions, wrong first actions, queued cases and seconds, by policy.

    Args:
        metrics: The tidy metrics that :func:`gpca.experiments.recovery.metrics.collect_recovery` makes.
        seconds: The mean seconds of a failure, by policy.
        budget: The number of actions that a policy may take.
    """
    seeds = metrics["seed"].nunique()
    within = [f"recovered_within_{k}" for k in range(1, budget + 1)]
    by_cause = {f"{within[-1]}_{cause}": cause for cause in CONCEPTS}
    table = TableBuilder("table8_recovery", {"policy": "Policy"})
    for policy, words in policies.items():
        if pool_share(metrics, policy, within[0]) is None:
            continue
        shares = {key: pool_share(metrics, policy, key) for key in (*within, *AT_FIRST)}
        shares |= {key: pool_share(metrics, policy, within[-1], cause) for key, cause in by_cause.items()}
        cells = {key: share_cell(*share, seeds) for key, share in shares.items() if share is not None}
        failures = cells[within[0]].test_samples
        for key in ("actions", "cost"):
            if mean := pool_share(metrics, policy, key):
                cells[key] = plain_cell(mean[0], seeds, failures)
        if policy in seconds:
            cells["seconds"] = plain_cell(seconds[policy], seeds, failures)
        table.add_row([(policy, words)], cells)
    table.compare_down(within)
    failures = table.first_cell(within[0]).test_samples
    return table.build(
        caption=f"Failed registrations recovered (%): {title}",
        column_head="metric",
        columns={
            **{key: Column(f"Within {k} (%)") for k, key in enumerate(within, start=1)},
            **{key: Column(f"{cause.capitalize()} (%)", decimals=0, interval=False) for key, cause in by_cause.items()},
            "wrong_first": Column("Wrong first (%)", decimals=0, interval=False, least_is_best=True),
            "queued": Column("Queued (%)", decimals=0, interval=False),
            "left_alone": Column("Taken for fine (%)", decimals=0, interval=False, least_is_best=True),
            "acted_nominal": Column("Acts on fine (%)", decimals=0, interval=False, least_is_best=True),
            "cost": Column("Cost", decimals=3, interval=False, limits=(0, inf)),
            "actions": Column("Actions", decimals=2, interval=False, limits=(0, inf)),
            "seconds": Column("Seconds", decimals=2, interval=False, limits=(0, inf)),
        },
        footnotes=(
            f"{failures} failures over {plural(seeds, 'seed')}: {failure_counts(metrics)}. A failure is a pose off by "
            "more than 10 % of the diameter (ADD; ADD-S for symmetric objects) that is not off without its cause. "
            f"{WILSON}, as if all failures were independent; those on one rendered table are alike, so that it is "
            "somewhat too narrow. Bold: best of a column.",
            f"Noise, Pose, Overlap: by cause, within {budget} actions. Wrong first: of the first actions, those that "
            "are not the cause's own; fixed by design where the action is always the same one. Queued: left to a "
            "person instead. Taken for fine: failures that the policy leaves as they are. Acts on fine: of "
            "registrations on the same tables whose pose is right, those that it would change. Cost: of all actions on "
            "a failure, mean; the config sets that of each action, and a repaired pose is worth 1. Actions: their "
            "number, mean. Seconds: of explaining, acting and registering, per failure; the camera's and the robot's "
            "own times are not in them.",
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
