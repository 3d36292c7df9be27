"""The step that lets SHAP register: its values are those of the table, and it refuses what is not its own."""

import pandas as pd
import pytest

from gpca.evaluation.measures import read_metrics
from tests.steps.by_words import main

from .command_lines import arguments

WORDS = {
    "--source": "tiny", "--seeds": "0", "--registrations": "registrations.npz", "--outcomes": "additive.npz",
    "--settings": '{"live_shap": {"samples": 3}, "additive": {"starts": 13, "icp_points": 40, "samples": 6}, '
                  '"icp": {"max_iterations": 20}}',
    "--out": "live_shap.csv",
}  # fmt: skip


@pytest.fixture
def outcomes(folder):
    changes = {"--design": "additive", "--outcomes": "additive.npz", "--tables": "additive.csv"}
    assert main(arguments("uncertainty", changes | {"--timings": "additive_timings.csv"})) == 0
    return folder


def live(**changes):
    words = WORDS | {f"--{name}": value for name, value in changes.items()}
    return main(["live_shap", *(word for pair in words.items() for word in pair)])


def test_the_table_gives_what_the_explainer_finds_by_registering(outcomes):
    assert live() == 0
    rows = read_metrics(outcomes / "live_shap.csv")
    values = rows.set_index("metric")["value"]
    assert values["largest_difference"] < 1e-8 < values["largest_value"]
    assert values[["named_alike", "test_samples", "icp_calls"]].tolist() == [1, 3, 8 * 13]
    assert values["live_icp_calls"] >= 9 * 13
    assert set(rows["source"]) == {"tiny"}
    assert (outcomes / "live_shap.csv.provenance.json").is_file()


def test_other_settings_than_the_tables_show(outcomes):
    other = WORDS["--settings"].replace('"icp_points": 40', '"icp_points": 30')
    assert live(settings=other) == 0
    metrics = pd.read_csv(outcomes / "live_shap.csv").set_index("metric")["value"]
    assert metrics["largest_difference"] > 1e-6


def test_outcomes_of_another_seed_are_refused(outcomes, capfd):
    assert live(seeds="1", registrations="registrations.npz") == 2
    assert "seed" in capfd.readouterr().err
