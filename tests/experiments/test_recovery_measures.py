"""Measures of policies of recovery, their intervals and paired differences."""

import pandas as pd
import pytest

from gpca.causes.policy import NOTHING, QUEUE, TREATMENTS
from gpca.declarations.plan import Run
from gpca.errors import InputError
from gpca.evaluation.measures import read_clustered
from gpca.experiments import recovery_measures
from gpca.io.csv_file import write_csv
from gpca.pairs.perturbation import CONCEPTS

COSTS = {"denoise": 0.02, "reinitialize": 0.01, "new_view": 0.03}


def run_of(*policies, budget=3):
    recovery = {
        "objects": "tiny", "policies": policies or ("gpca", "random", "oracle"), "actions": dict.fromkeys(COSTS),
        "treatments": TREATMENTS, "costs": COSTS, "needless": 0.2, "loop": {"budget": budget},
    }  # fmt: skip
    sources = {"tiny": {"title": "Tiny", "kind": "procedural", "stand_in": False}}
    return Run({"recovery": recovery, "sources": sources, "success": {"error": 0.03}})


def rows_of(*episodes, policy="gpca"):
    """Rows of episodes given as (cause, actions, recovered at the end)."""
    return pd.DataFrame(
        {
            "episode": number,
            "cause": cause,
            "policy": policy,
            "table": number % 2,
            "step": step,
            "action": action,
            "failed": True,
            "error_before": 0.2,
            "error_after": 0.01 if recovered and step == len(actions) else 0.04,
            "recovered": recovered and step == len(actions),
            "tries": {"noise": 10, "pose": 20, "overlap": 30}[cause],
        }
        for number, (cause, actions, recovered) in enumerate(episodes)
        for step, action in enumerate(actions, start=1)
    )


EPISODES = (
    ("noise", ["denoise"], True),
    ("noise", ["reinitialize", "denoise"], True),
    ("pose", ["new_view", "denoise", "reinitialize"], False),
    ("overlap", [QUEUE], False),
)


def test_the_metrics_of_a_policy_by_hand_count_apart_what_did_not_fail():
    values = recovery_measures.policy_metrics(rows_of(*EPISODES), COSTS, 3)
    assert [values[f"recovered_within_{k}"] for k in (1, 2, 3)] == [0.25, 0.5, 0.5]
    assert values["queued"] == 0.25
    assert values["cost"] == pytest.approx((3 * 0.02 + 2 * 0.01 + 0.03) / 4)
    assert values["episodes"] == 4
    assert values["tries"] == 60
    fine = rows_of(("noise", ["denoise"], False), ("pose", [NOTHING], False)).assign(failed=False)
    values = recovery_measures.policy_metrics(pd.concat([rows_of(*EPISODES), fine]), COSTS, 3)
    assert (values["nominal"], values["acted_nominal"], values["episodes"]) == (2, 0.5, 4)
    left = recovery_measures.policy_metrics(rows_of(("pose", [NOTHING], False)), COSTS, 3)
    assert (left["left_alone"], left["queued"], left["recovered_within_3"]) == (1, 0, 0)


def test_faulty_files_are_refused(tmp_path):
    write_csv(tmp_path / "less.csv", rows_of(EPISODES[0]).drop(columns="tries"))
    with pytest.raises(InputError, match="column 'tries' is missing"):
        recovery_measures.read_recovery(tmp_path / "less.csv")


TAKEN = {  # policy -> of nine failures, its actions; one that ends with "!" recovers the pose
    "gpca": [["denoise!"], ["queue"], ["nothing"], ["denoise", "new_view!"], *[["denoise!"]] * 5],
    "always": [["denoise!"]] * 9,
}


def rows_of_taken(actions):
    rows = []
    for policy, cases in actions.items():
        for episode, taken in enumerate(cases):
            case = {"episode": episode, "cause": CONCEPTS[episode % 3], "table": episode // 3, "policy": policy}
            for step, action in enumerate(taken, start=1):
                taken_one = {"step": step, "action": action.rstrip("!"), "failed": True}
                rows.append(case | taken_one | {"recovered": action.endswith("!")})
        for good in range(4):
            case = {"episode": 9 + good, "cause": "", "table": good, "policy": policy, "step": 1}
            action = "nothing" if policy == "gpca" and good else "denoise"
            rows.append(case | {"action": action, "failed": False, "recovered": False})
    return pd.DataFrame(rows).assign(error_before=0.2, error_after=0.1, tries=5)


def test_shares_are_those_of_the_metrics(tmp_path):
    taken_files = [tmp_path / f"seed{seed}.csv" for seed in range(2)]
    for path in taken_files:
        write_csv(path, rows_of_taken(TAKEN))
    write_csv(tmp_path / "intervals.csv", recovery_measures.collect_intervals(run_of(budget=2), taken_files), form=None)
    shares = read_clustered(tmp_path / "intervals.csv").set_index(["method", "metric", "concept"])
    metrics = recovery_measures.collect(run_of(budget=2), taken_files)
    for policy, metric, concept in shares.index:
        wide = metrics.query("method == @policy and concept == @concept").pivot(
            index="seed", columns="metric", values="value"
        )
        count_R = wide["nominal" if metric == "acted_nominal" else "episodes"]
        row = shares.loc[policy, metric, concept]
        assert row["value"] == pytest.approx((wide[metric] * count_R).sum() / count_R.sum())
        assert row["samples"] == count_R.sum()
    assert {metric for _, metric, _ in shares.index} == {
        "recovered_within_1", "recovered_within_2", "queued", "left_alone", "acted_nominal",
    }  # fmt: skip


SOLVED = {  # policy -> of four failures, after how many actions each is recovered; 0 never
    "gpca_acting": (1, 1, 1, 2),
    "gpca_gated": (1, 1, 0, 0),
    "error_only_acting": (1, 2, 2, 2),
    "error_only": (1, 1, 0, 0),
    "always_denoise": (1, 1, 0, 0),
    "sequence_new_view_denoise": (2, 1, 2, 2),
}


def rows_solved(solved):
    rows = []
    for policy, steps in solved.items():
        for episode, last in enumerate(steps):
            for step in range(1, (last or 2) + 1):
                row = {"episode": episode, "cause": "pose", "table": episode % 3, "policy": policy, "step": step}
                row |= {"action": "denoise", "failed": True, "error_before": 0.2, "error_after": 0.1}
                rows.append(row | {"recovered": step == last, "tries": 5})
    return pd.DataFrame(rows)


@pytest.fixture
def measured_differences(tmp_path):
    paths = [tmp_path / f"seed{seed}.csv" for seed in range(4)]
    for path in paths:
        write_csv(path, rows_solved(SOLVED))
    write_csv(tmp_path / "differences.csv", recovery_measures.collect_differences(run_of(budget=2), paths), form=None)
    return read_clustered(tmp_path / "differences.csv").set_index(["method", "metric", "against"])


def test_differences_are_paired_and_from_the_best_sequence_of_as_many_actions(measured_differences):
    row = measured_differences.loc["gpca_acting", "recovered_within_1", "error"]
    assert (row["other"], row["seeds"], row["samples"]) == ("error_only_acting", 4, 16)
    assert row["value"] == pytest.approx(2 / 4)
    assert 0 < row["low"] < row["value"] < row["high"] <= 1
    for k, best in ((1, "always_denoise"), (2, "sequence_new_view_denoise")):
        of_number = measured_differences.xs((f"recovered_within_{k}", "sequence"), level=("metric", "against"))
        assert set(of_number["other"]) == {best}
        assert best not in of_number.index
    assert measured_differences.loc["gpca_acting", "recovered_within_2", "sequence"]["value"] == 0


def test_who_must_recognize_failures_is_compared_with_who_must_as_well_each_time(measured_differences, tmp_path):
    row = measured_differences.loc["gpca_gated", "recovered_within_2", "error"]
    assert (row["other"], row["value"]) == ("error_only", 0)
    assert row["low"] < 0 < row["high"]  # never of no width
    assert "error_only" not in measured_differences.xs("error", level="against").index
    paths = [tmp_path / f"seed{seed}.csv" for seed in range(4)]
    write_csv(tmp_path / "again.csv", recovery_measures.collect_differences(run_of(budget=2), paths), form=None)
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "differences.csv").read_bytes()
