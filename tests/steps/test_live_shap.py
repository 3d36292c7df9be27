"""The step that lets SHAP register: its values are those of the table, and it refuses what does not belong to it."""

import numpy as np
import pandas as pd
import pytest

from baselines.shap_kl import shapley_values
from gpca.classifier.scores import Attribution
from gpca.evaluation.measures import read_metrics
from gpca.pairs.perturbation import CONCEPTS
from gpca.steps.live_shap import compared, live_values
from gpca.uncertainty.designs import LiveUncertainty, evaluate_design
from gpca.uncertainty.interventions import MIDDLE, UNTOUCHED, Knobs
from gpca.uncertainty.settings import CORNERS, UncertaintySettings
from tests.steps.by_words import main

from .command_lines import arguments

SETTINGS = UncertaintySettings(starts=13, icp_points=60)

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


class Counted:
    """A function of the knobs that counts who asks for what."""

    def __init__(self, weights_3):
        self.asked = []
        self._weights_3 = weights_3

    def __call__(self, knobs):
        self.asked.append(knobs)
        return float(np.dot(self._weights_3, np.subtract(knobs, UNTOUCHED) / np.subtract(MIDDLE, UNTOUCHED)))


def test_of_a_sum_of_knobs_the_values_are_their_weights_and_every_coalition_is_asked_for():
    function = Counted([3.0, -1.0, 0.25])
    assert live_values(function) == pytest.approx([3, -1, 0.25])
    assert set(function.asked) == {Knobs(*np.where(corner, MIDDLE, UNTOUCHED)) for corner in CORNERS}


def test_registering_live_gives_the_values_of_the_table(registrations):
    tests = registrations.subset(registrations.rows("test")[:3])
    outcomes, *_ = evaluate_design("additive", tests, "tiny", 0, SETTINGS)
    expected_S_3 = shapley_values(outcomes.uncertainty[:, :8])
    for row in range(3):
        live = LiveUncertainty(tests, row, "tiny", 0, SETTINGS)
        assert live_values(live) == pytest.approx(expected_S_3[row], abs=1e-8)
        assert live.icp_calls >= 13 * (1 + len(CORNERS))
    assert np.abs(expected_S_3).max() > 0.01


def test_metrics_tell_how_far_both_are_apart():
    tabled = Attribution.of_scores(CONCEPTS, np.array([[1.0, 2, 0], [0, -4, 1]]), seconds=0.0, icp_calls=104)
    metrics = compared(np.array([[1.0, 2.5, 0], [3, -4, 1]]), np.array([117, 130]), tabled)
    assert metrics == {
        "largest_value": 4, "largest_difference": 3, "named_alike": 0.5, "live_icp_calls": 123.5, "icp_calls": 104,
        "test_samples": 2,
    }  # fmt: skip
