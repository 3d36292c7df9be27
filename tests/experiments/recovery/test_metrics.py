import pandas as pd
import pytest

from gpca.errors import InputError
from gpca.experiments.recovery.metrics import (
    collect_recovery,
    mean_seconds,
    metrics_at,
    policy_metrics,
    pool_share,
    read_recovery,
)
from gpca.io.csv_file import write_csv
from gpca.recovery.policy import NOTHING, QUEUE, TREATMENTS

COSTS = {"denoise": 0.02, "reinitialize": 0.01, "new_view": 0.03}
CURVE = (0.02, 0.05, 0.3)


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


@pytest.fixture
def files(tmp_path):
    paths = [tmp_path / f"seed{seed}.csv" for seed in (0, 1)]
    write_csv(paths[0], rows_of(*EPISODES))
    write_csv(paths[1], rows_of(EPISODES[0], EPISODES[0]))
    return paths


def test_the_metrics_of_a_policy_by_hand():
    values = policy_metrics(rows_of(*EPISODES), TREATMENTS, COSTS, 3)
    assert [values[f"recovered_within_{k}"] for k in (1, 2, 3)] == [0.25, 0.5, 0.5]
    assert values["wrong_first"] == pytest.approx(2 / 3)  # of the three that acted
    assert values["queued"] == 0.25
    assert values["actions"] == 6 / 4
    assert values["cost"] == pytest.approx((3 * 0.02 + 2 * 0.01 + 0.03) / 4)
    assert values["episodes"] == 4
    assert values["tries"] == 60
    assert [values[f"first_{a}"] for a in ("denoise", "reinitialize", "new_view", QUEUE)] == [1, 1, 1, 1]


def test_what_did_not_fail_counts_apart():
    fine = rows_of(("noise", ["denoise"], False), ("pose", [NOTHING], False)).assign(failed=False)
    values = policy_metrics(pd.concat([rows_of(*EPISODES), fine]), TREATMENTS, COSTS, 3)
    assert (values["nominal"], values["acted_nominal"], values["episodes"]) == (2, 0.5, 4)
    assert values["cost_nominal"] == pytest.approx(0.02 / 2)
    left = policy_metrics(rows_of(("pose", [NOTHING], False)), TREATMENTS, COSTS, 3)
    assert (left["left_alone"], left["queued"], left["recovered_within_3"]) == (1, 0, 0)


def test_by_another_limit_only_failures_by_it_count():
    values = metrics_at(rows_of(*EPISODES), 3, CURVE)
    assert [values[f"failures_at_{limit}"] for limit in (2, 5, 30)] == [4, 4, 0]
    assert [values[f"recovered_within_{k}_at_2"] for k in (1, 2, 3)] == [0.25, 0.5, 0.5]
    assert [values[f"recovered_within_{k}_at_5"] for k in (1, 2, 3)] == [1, 1, 1]  # 4 % is right by that limit
    assert "recovered_within_1_at_30" not in values


def test_shares_are_pooled_over_the_failures_of_all_seeds(files):
    metrics = collect_recovery(files, TREATMENTS, COSTS, 3, CURVE)
    assert pool_share(metrics, "gpca", "recovered_within_1") == (pytest.approx(3 / 6), 6)
    assert pool_share(metrics, "gpca", "recovered_within_2", "noise") == (pytest.approx(1), 4)
    assert pool_share(metrics, "gpca", "recovered_within_2", "pose") == (0, 1)
    assert pool_share(metrics, "gpca", "wrong_first") == (pytest.approx(2 / 5), 5)
    assert pool_share(metrics, "random", "recovered_within_1") is None
    assert "wrong_first" not in set(metrics[metrics["concept"] == "overlap"]["metric"])  # none of them acted


def test_seconds_are_summed_over_a_failure_and_averaged_over_failures(tmp_path):
    path = tmp_path / "seed0.csv"
    columns = {
        "episode": [0, 0, 1],
        "failed": True,
        "policy": "gpca",
        "explanation_seconds": 0.5,
        "action_seconds": [1.0, 2.0, 3.0],
    }
    write_csv(path, pd.DataFrame(columns))
    assert mean_seconds([path]) == {"gpca": pytest.approx((4.0 + 3.5) / 2)}
    with pytest.raises(InputError, match="no timing files were given"):
        mean_seconds([])


def test_faulty_files_are_refused(files, tmp_path):
    write_csv(tmp_path / "less.csv", rows_of(EPISODES[0]).drop(columns="tries"))
    with pytest.raises(InputError, match="column 'tries' is missing"):
        read_recovery(tmp_path / "less.csv")
    files[0].rename(tmp_path / "first.csv")
    with pytest.raises(InputError, match=r"is not named …/seed\{number\}.csv"):
        collect_recovery([tmp_path / "first.csv"], TREATMENTS, COSTS, 3, CURVE)
    with pytest.raises(InputError, match="no files were given"):
        collect_recovery([], TREATMENTS, COSTS, 3, CURVE)
