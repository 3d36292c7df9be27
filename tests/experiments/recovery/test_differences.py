import pandas as pd
import pytest

from gpca.experiments.recovery.differences import collect_differences, read_differences
from gpca.io.csv_file import write_csv

ACTIONS = ("reinitialize", "new_view", "denoise")
SOLVED = {  # policy -> of four failures, after how many actions each is recovered; 0 never
    "gpca_acting": (1, 1, 1, 2),
    "gpca_gated": (1, 1, 0, 0),
    "error_only_acting": (1, 2, 2, 2),
    "error_only": (1, 1, 0, 0),
    "always_denoise": (1, 1, 0, 0),
    "sequence_new_view_denoise": (2, 1, 2, 2),
}


def rows_of(solved):
    rows = []
    for policy, steps in solved.items():
        for episode, last in enumerate(steps):
            for step in range(1, (last or 2) + 1):
                row = {"episode": episode, "cause": "pose", "table": episode % 3, "policy": policy, "step": step}
                row |= {"action": "denoise", "failed": True, "error_before": 0.2, "error_after": 0.1}
                rows.append(row | {"recovered": step == last, "tries": 5})
    return pd.DataFrame(rows)


@pytest.fixture
def differences(tmp_path):
    paths = [tmp_path / f"seed{seed}.csv" for seed in range(4)]
    for path in paths:
        write_csv(path, rows_of(SOLVED))
    write_csv(tmp_path / "differences.csv", collect_differences(paths, ACTIONS, 2))
    return read_differences(tmp_path / "differences.csv").set_index(["policy", "metric", "against"])


def test_differences_are_paired_and_of_the_same_failures(differences):
    row = differences.loc["gpca_acting", "recovered_within_1", "error"]
    assert (row["rival"], row["seeds"], row["samples"]) == ("error_only_acting", 4, 16)
    assert row["difference"] == pytest.approx(2 / 4)
    assert 0 < row["low"] < row["difference"] < row["high"] <= 1


def test_the_best_sequence_is_the_best_by_that_number_of_actions(differences):
    for k, best in ((1, "always_denoise"), (2, "sequence_new_view_denoise")):
        of_number = differences.xs((f"recovered_within_{k}", "sequence"), level=("metric", "against"))
        assert set(of_number["rival"]) == {best}
        assert best not in of_number.index
    assert differences.loc["gpca_acting", "recovered_within_2", "sequence"]["difference"] == 0


def test_who_must_recognize_failures_is_compared_with_who_must_as_well(differences):
    row = differences.loc["gpca_gated", "recovered_within_2", "error"]
    assert (row["rival"], row["difference"]) == ("error_only", 0)
    assert row["low"] < 0 < row["high"]  # never of no width
    assert "error_only" not in differences.xs("error", level="against").index


def test_the_same_files_give_the_same_intervals(differences, tmp_path):
    paths = [tmp_path / f"seed{seed}.csv" for seed in range(4)]
    write_csv(tmp_path / "again.csv", collect_differences(paths, ACTIONS, 2))
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "differences.csv").read_bytes()
