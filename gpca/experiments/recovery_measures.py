"""Measures of policies of recovery: by seed, over all seeds with intervals, and their paired differences."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gpca.causes.policy import NOTHING, QUEUE
from gpca.declarations import Frame, Paths, Run, Series, numbers
from gpca.evaluation.measures import ALL, Clustered, Measure, by_value, intervals, over_seeds, tidy
from gpca.io.csv_file import numbers as number_column
from gpca.io.csv_file import read_csv
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.policies import ERROR_ONLY, is_fixed, policy_entry
from gpca.seeds import seed_of_file

TABLE = "recovery"  # `table` and `source` of the rows
ERRORS = ("error_before", "error_after")
RECOVERY_COLUMNS = ("episode", "cause", "table", "policy", "step", "action", "failed", *ERRORS, "recovered", "tries")
CASE = ["seed", "cluster", "episode"]  # a cluster is a rendered table of a seed
SEQUENCE, ERROR = "sequence", "error"  # kinds of rivals
FILES = "recovery/seed{seed}.csv"


def read_recovery(path: str | Path) -> Frame:
    """Read a file of the step ``recover``: numbers as numbers, `failed` and `recovered` as booleans, and its seed."""
    rows = read_csv(path, RECOVERY_COLUMNS, ("object", "symmetric", "concept", "score_*", "bald"))
    for name, kind in {"episode": int, "table": int, "step": int, "tries": int, **dict.fromkeys(ERRORS, float)}.items():
        rows[name] = number_column(path, rows, name).astype(kind)
    booleans = {name: rows[name] == "True" for name in ("failed", "recovered")}
    return rows.assign(**booleans, seed=seed_of_file(path))


def is_action(rows: Frame) -> Series:
    return ~rows["action"].isin((QUEUE, NOTHING))


@numbers("recovery.csv", files=FILES)
def collect(run: Run, files: Paths) -> Frame:
    """Measures by policy, cause and seed; results/README.md lists them."""
    recovery, records = run.config["recovery"], []
    costs, budget = dict(recovery["costs"]), recovery["loop"]["budget"]
    for rows in map(read_recovery, files):
        for (policy, seed), episodes in rows.groupby(["policy", "seed"], sort=False):
            for cause, of_cause in by_value(episodes, "cause", CONCEPTS).items():
                if (subset := episodes[of_cause])["failed"].any():
                    values = policy_metrics(subset, costs, budget)
                    keys = TABLE, TABLE, policy
                    records += [(*keys, metric, cause, seed, float(value)) for metric, value in values.items()]
    return tidy(records, "recovery")


def policy_metrics(rows: Frame, costs: Mapping[str, float], budget: int) -> dict[str, float]:
    """Measures of one policy on the failures among the rows, and how often it acts on the others."""
    fine, rows = rows[~rows["failed"]], rows[rows["failed"]]
    first = rows[rows["step"] == 1]
    episodes = first["episode"].nunique()
    values = {
        f"recovered_within_{k}": rows[rows["recovered"] & (rows["step"] <= k)]["episode"].nunique() / episodes
        for k in range(1, budget + 1)
    }
    values |= {"episodes": episodes, "tries": first.groupby("cause")["tries"].first().sum()}
    values["queued"] = rows[rows["action"] == QUEUE]["episode"].nunique() / episodes
    values["left_alone"] = float((first["action"] == NOTHING).mean())
    values |= {"cost": float(rows["action"].map(costs).sum() / episodes), "nominal": len(fine)}
    return values | ({"acted_nominal": float(is_action(fine).mean())} if len(fine) else {})


@numbers("recovery_intervals.csv", files=FILES)
def collect_intervals(run: Run, files: Paths) -> Frame:
    """Shares of failures, by cause too, and ``acted_nominal`` of good ones; a cluster is a seed's rendered table."""
    import pandas as pd

    def over_all(cases: Frame, causes: Sequence[str], measures: Mapping[str, Measure]) -> Frame:
        draws = Clustered.drawn(cases["seed"], cases["cluster"], "recovery intervals")
        return over_seeds(cases, lambda rows: by_value(rows, "cause", causes), measures, draws)

    rows = _read_all(files).rename(columns={"policy": "method"}).assign(table=TABLE, source=TABLE)
    within = {
        f"recovered_within_{k}": Measure(lambda cases, k=k: cases["step"] <= k)  # type: ignore[misc]
        for k in range(1, run.config["recovery"]["loop"]["budget"] + 1)
    }
    left_alone = Measure(lambda cases: cases["first"] == NOTHING)
    shares = {"queued": Measure("queued"), **within, "left_alone": left_alone}
    failures, good = rows[rows["failed"]], rows[~rows["failed"]].reset_index(drop=True)
    cases = failures.assign(step=steps_taken(failures), queued=failures["action"] == QUEUE)
    cases = cases.groupby(["table", "source", "method", *CASE, "cause"], sort=False)
    cases = cases.agg(step=("step", "min"), queued=("queued", "any"), first=("action", "first")).reset_index()
    parts = [over_all(cases, CONCEPTS, shares)]
    if len(good):
        parts.append(over_all(good, (), {"acted_nominal": Measure(is_action)}))
    order = list(rows["method"].unique())
    return pd.concat(parts).sort_values("method", key=lambda names: names.map(order.index), kind="stable")


@numbers("recovery_differences.csv", files=FILES)
def collect_differences(run: Run, files: Paths) -> Frame:
    """Paired differences of the shares that policies recover: `against` the best ``sequence``, or ``error`` only.

    The first is the best fixed one on the same failures, in hindsight; the second the best order of the rehearsals,
    gated for a policy that has to recognize failures itself.
    """
    recovery = run.config["recovery"]
    actions = list(recovery["actions"])
    rows = _read_all(files)
    failures = rows[rows["failed"]]
    # After how many actions each failure was recovered, or inf, by policy in columns.
    named = [failures[name] for name in (*CASE, "policy")]
    steps = steps_taken(failures).groupby(named, sort=False).min().unstack()
    seeds, clusters, _ = zip(*steps.index, strict=True)
    draws = Clustered.drawn(seeds, clusters, "recovery differences")
    fixed = [name for name in steps.columns if is_fixed(name, actions)]
    records = []
    for k in range(1, recovery["loop"]["budget"] + 1):
        solved = {name: (steps[name] <= k).to_numpy(float) for name in steps.columns}
        best = max(fixed, key=lambda name: solved[name].sum(), default="")
        for name in solved:
            rivals = {SEQUENCE: best, ERROR: ERROR_ONLY[policy_entry(name, actions).informed]}
            for against, other in rivals.items():
                if other in solved and other != name:
                    keys = (TABLE, TABLE, name, f"recovered_within_{k}", ALL, against, other)
                    records.append(draws.record(keys, draws.difference(solved[name], solved[other])))
    return intervals(records, "recovery", most=1.0)


def steps_taken(failures: Frame) -> Series:
    """Number of actions after which a row's failure was recovered, or inf."""
    return failures["step"].where(failures["recovered"], np.inf)


def _read_all(files: Paths) -> Frame:
    import pandas as pd

    if not (parts := [read_recovery(path) for path in files]):
        return intervals([], "recovery")
    rows = pd.concat(parts, ignore_index=True)
    return rows.assign(cluster=rows["seed"].astype(str) + "/" + rows["table"].astype(str))
