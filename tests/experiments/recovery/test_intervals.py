"""Shares of cases with intervals over tables and seeds."""

import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.evaluation.intervals import wilson_interval
from gpca.evaluation.measures import read_clustered
from gpca.experiments.recovery.intervals import collect_intervals
from gpca.experiments.recovery.metrics import collect_recovery, pool_share
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS

BUDGET = 2
TREATMENTS = dict(zip(CONCEPTS, ("denoise", "reinitialize", "new_view"), strict=True))
COSTS = dict.fromkeys((*TREATMENTS.values(), "queue", "nothing"), 0.1)
ACTIONS = {  # policy -> of nine failures, its actions; one that ends with "!" recovers the pose
    "gpca": [["denoise!"], ["queue"], ["nothing"], ["denoise", "new_view!"], *[["denoise!"]] * 5],
    "always": [["denoise!"]] * 9,
}


def rows_of(actions):
    rows = []
    for policy, of_cases in actions.items():
        for episode, taken in enumerate(of_cases):
            known = {"episode": episode, "cause": CONCEPTS[episode % 3], "table": episode // 3, "policy": policy}
            for step, action in enumerate(taken, start=1):
                told = {"step": step, "action": action.rstrip("!"), "failed": True, "recovered": action.endswith("!")}
                rows.append(known | told)
        for good in range(4):
            known = {"episode": 9 + good, "cause": "", "table": good, "policy": policy, "step": 1}
            action = "nothing" if policy == "gpca" and good else "denoise"
            rows.append(known | {"action": action, "failed": False, "recovered": False})
    return pd.DataFrame(rows).assign(error_before=0.2, error_after=0.1, tries=5)


@pytest.fixture
def paths(tmp_path):
    paths = [tmp_path / f"seed{seed}.csv" for seed in range(2)]
    for path in paths:
        write_csv(path, rows_of(ACTIONS))
    return paths


@pytest.fixture
def found(paths, tmp_path):
    write_csv(tmp_path / "intervals.csv", collect_intervals(paths, BUDGET), form=None)
    return read_clustered(tmp_path / "intervals.csv").set_index(["method", "metric", "concept"])


def test_shares_are_those_of_the_metrics(paths, found):
    metrics = collect_recovery(paths, TREATMENTS, COSTS, BUDGET, ())
    for policy, metric, concept in found.index:
        share, samples = pool_share(metrics, policy, metric, concept)
        row = found.loc[policy, metric, concept]
        assert (row["value"], row["samples"]) == (pytest.approx(share), samples)
    assert {metric for _, metric, _ in found.index} == {
        "recovered_within_1", "recovered_within_2", "queued", "left_alone", "acted_nominal",
    }  # fmt: skip


def test_clusters_are_the_tables_of_each_seed(found):
    row = found.loc["gpca", "recovered_within_1", "all"]
    assert (row["seeds"], row["clusters"], row["samples"]) == (2, 6, 18)
    assert 0 <= row["low"] < row["value"] < row["high"] <= 1
    assert found.loc["gpca", "acted_nominal", "all"]["clusters"] == 8


def test_what_always_happens_has_wilsons_interval_of_tables(found):
    row = found.loc["always", "recovered_within_1", "all"]
    assert (row["value"], row["low"], row["high"]) == pytest.approx((1, *wilson_interval(6, 6)))


def test_the_same_files_give_the_same_bytes_and_none_are_a_fault(paths, found, tmp_path):
    write_csv(tmp_path / "again.csv", collect_intervals(paths, BUDGET), form=None)
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "intervals.csv").read_bytes()
    with pytest.raises(InputError, match="recovery: no files were given"):
        collect_intervals([], BUDGET)
