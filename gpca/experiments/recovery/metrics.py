"""Turns the actions of the policies, and the labels of queued cases, into metrics over causes and seeds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.evaluation.measures import ALL, tidy
from gpca.io.csv_file import numbers, read_csv, read_numbers
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.policy import NOTHING, QUEUE
from gpca.seeds import seed_of_file

if TYPE_CHECKING:
    import pandas as pd

TABLE = "recovery"  # `table` and `source` of the tidy rows read this
ERRORS = ("error_before", "error_after")
RECOVERY_COLUMNS = ("episode", "cause", "table", "policy", "step", "action", "failed", *ERRORS, "recovered", "tries")
_OTHERS = ("object", "symmetric", "concept", "score_*", "bald")
SECONDS = ("explanation_seconds", "action_seconds")
FIRST = "first_"  # with an action or the queue behind it, a metric of the confusion
AT = "_at_"  # with a limit in % of the diameter behind it, by which a pose is right in place of the run's own
WEIGHTS = {"wrong_first": "acted_first", "acted_nominal": "nominal", "cost_nominal": "nominal"}
DOUBTED, DRAWN = "queued", "random"  # which cases are labeled next: those in doubt, or any
QUEUE_COLUMNS = ("policy", "order", "draw", "labels", "failures", "unsolved")


def collect_recovery(
    files: Iterable[str | Path],
    treatments: Mapping[str, str],
    costs: Mapping[str, float],
    budget: int,
    curve: Iterable[float],
) -> pd.DataFrame:
    """Return the tidy metrics of files named `…/seed{seed}.csv`; results/README.md lists them.

    Args:
        treatments: concept -> the action of its own.
        costs: action -> what it costs, in right poses.
        budget: actions per failure.
        curve: other errors below which a pose may be right.

    Raises:
        InputError: no files, a name of another form, a missing column, no rows.
    """
    records = []
    for path in files:
        seed = seed_of_file(path)
        rows = read_recovery(path)
        for policy, of_policy in rows.groupby("policy", sort=False):
            for cause in (ALL, *CONCEPTS):
                of_cause = of_policy if cause == ALL else of_policy[of_policy["cause"] == cause]
                if not of_cause["failed"].any():
                    continue
                values = policy_metrics(of_cause, treatments, costs, budget)
                values |= metrics_at(of_cause, budget, curve) if cause == ALL else {}
                records += [(TABLE, TABLE, policy, metric, cause, seed, float(v)) for metric, v in values.items()]
    return tidy(records, "recovery")


def policy_metrics(
    rows: pd.DataFrame, treatments: Mapping[str, str], costs: Mapping[str, float], budget: int
) -> dict[str, float]:
    """Return the metrics of one policy on the failures among the rows, and how often it acts on the others."""
    fine, rows = rows[~rows["failed"]], rows[rows["failed"]]
    first = rows[rows["step"] == 1]
    acted = first[is_action(first)]
    episodes = first["episode"].nunique()
    values = {
        f"recovered_within_{k}": rows[rows["recovered"] & (rows["step"] <= k)]["episode"].nunique() / episodes
        for k in range(1, budget + 1)
    }
    values |= {"episodes": episodes, "acted_first": len(acted), "tries": first.groupby("cause")["tries"].first().sum()}
    if len(acted):
        values["wrong_first"] = float((acted["action"] != acted["cause"].map(dict(treatments))).mean())
    values["queued"] = rows[rows["action"] == QUEUE]["episode"].nunique() / episodes
    values["left_alone"] = float((first["action"] == NOTHING).mean())
    values["actions"] = float(is_action(rows).sum() / episodes)
    values["cost"] = _mean_cost(rows, costs, episodes)
    values["nominal"] = len(fine)
    if len(fine):
        values |= {"acted_nominal": float(is_action(fine).mean()), "cost_nominal": _mean_cost(fine, costs, len(fine))}
    counts = first["action"].value_counts()
    return values | {FIRST + action: counts.get(action, 0) for action in (*treatments.values(), QUEUE)}


def metrics_at(rows: pd.DataFrame, budget: int, curve: Iterable[float]) -> dict[str, float]:
    """Return the shares recovered by other limits of a right pose, each of the failures that are failures by it too.

    A policy that stopped at a pose that is right by the run's own limit would have stopped there, or before, by a wider
    one; by a narrower one it might have gone on, so that its share is a lower bound.
    """
    of_failures = rows[rows["failed"]]
    values: dict[str, float] = {}
    for limit in curve:
        first = of_failures[of_failures["step"] == 1]
        failures = first[first["error_before"] >= limit]["episode"]
        values[at("failures", limit)] = len(failures)
        if not len(failures):
            continue
        right = of_failures[of_failures["episode"].isin(failures) & (of_failures["error_after"] < limit)]
        for k in range(1, budget + 1):
            solved = right[right["step"] <= k]["episode"].nunique()
            values[at(f"recovered_within_{k}", limit)] = solved / len(failures)
    return values


def at(metric: str, limit: float) -> str:
    """Return the name of a metric by another limit of a right pose, such as ``failures_at_5`` for 5 %."""
    return f"{metric}{AT}{100 * limit:g}"


def _mean_cost(rows: pd.DataFrame, costs: Mapping[str, float], registrations: int) -> float:
    return float(rows["action"].map(dict(costs)).sum() / registrations)


def is_action(rows: pd.DataFrame) -> pd.Series:
    """Return which rows are of an action, as booleans."""
    return ~rows["action"].isin((QUEUE, NOTHING))


def mean_seconds(files: Iterable[str | Path]) -> dict[str, float]:
    """Return policy -> mean seconds of a failure, of explaining and acting, over all files of seconds."""
    import pandas as pd

    parts = []
    for path in files:
        rows = read_csv(path, ("episode", "failed", "policy", *SECONDS), others=("step",))
        rows = rows[rows["failed"] == "True"]
        rows["seconds"] = sum(numbers(path, rows, name) for name in SECONDS)
        parts.append(rows.groupby(["policy", "episode"])["seconds"].sum())
    if not parts:
        raise InputError("recovery", "no timing files were given", "run the step recover")
    return pd.concat(parts).groupby(level="policy").mean().to_dict()


def read_recovery(path: str | Path) -> pd.DataFrame:
    """Read a file of the step ``recover``: `recovered` as booleans, numbers as numbers, the rest as text."""
    rows = read_csv(path, RECOVERY_COLUMNS, _OTHERS)
    for name in ("episode", "table", "step", "tries"):
        rows[name] = numbers(path, rows, name).astype(int)
    for name in ERRORS:
        rows[name] = numbers(path, rows, name)
    return rows.assign(**{name: rows[name] == "True" for name in ("failed", "recovered")})


def pool_share(metrics: pd.DataFrame, policy: str, metric: str, concept: str = ALL) -> tuple[float, int] | None:
    """Return a share over the failures of all seeds, and their number; None where the metrics hold none.

    A wrong first action is a share of the failures that were acted on at all, an action on what did not fail one of
    those registrations, and a share by another limit one of the failures by that limit.
    """
    of_limit = metric.partition(AT)[2]
    weight = f"failures{AT}{of_limit}" if of_limit else WEIGHTS.get(metric, "episodes")
    of_policy = metrics[(metrics["method"] == policy) & (metrics["concept"] == concept)]
    share_R, count_R = (of_policy[of_policy["metric"] == m].set_index("seed")["value"] for m in (metric, weight))
    if share_R.empty:
        return None
    weight_R = count_R[share_R.index]
    return float((share_R * weight_R).sum() / weight_R.sum()), int(weight_R.sum())


def read_queues(files: Iterable[str | Path]) -> pd.DataFrame:
    """Return ``policy, order, labels, failures, error, low, high``: shares of the failures of all seeds.

    Only numbers of labels that every seed has are kept. Of random orders it is the mean; the bounds are Wilson's, as if
    each failure were judged once.

    Raises:
        InputError: a missing column, or no rows.
    """
    import pandas as pd

    parts = []
    for path in files:
        rows = read_numbers(path, QUEUE_COLUMNS, QUEUE_COLUMNS[2:])
        mean = rows.groupby(["policy", "order", "labels"], sort=False)[["failures", "unsolved"]].mean()
        parts.append(mean.reset_index())
    grouped = pd.concat(parts).groupby(["policy", "order", "labels"], sort=False)
    together = grouped[["failures", "unsolved"]].sum()[grouped.size() == len(parts)].reset_index()
    shares = [wilson_interval(row.unsolved, int(row.failures)) for row in together.itertuples()]
    together[["low", "high"]] = pd.DataFrame(shares, index=together.index)
    return together.assign(error=together["unsolved"] / together["failures"]).drop(columns="unsolved")
