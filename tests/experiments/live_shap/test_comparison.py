import numpy as np
import pytest

from baselines.shap_kl import shapley_values
from gpca.attribution.scores import Attribution
from gpca.evaluation.measures import TIDY_COLUMNS
from gpca.experiments.live_shap.comparison import compared, live_values
from gpca.experiments.live_shap.experiment import names
from gpca.experiments.live_shap.tables import live_shap
from gpca.pairs.perturbation import CONCEPTS
from gpca.uncertainty.designs import LiveUncertainty, evaluate_design
from gpca.uncertainty.interventions import MIDDLE, UNTOUCHED, Knobs
from gpca.uncertainty.settings import CORNERS, UncertaintySettings

SETTINGS = UncertaintySettings(starts=13, icp_points=60)
SOURCES = {"tiny": {"title": "Tiny", "stand_in": True}}


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


def test_without_the_table_or_its_explainer_nothing_is_compared():
    own, sources = {"sources": 1, "seeds": 1}, dict.fromkeys(["tiny", "other"])
    whole = {"live_shap": own, "explainers": {"shap_additive": {}}, "uncertainty": {"additive": {}}, "seeds": [4, 5]}
    assert names(whole, sources) == {"live_source": ["tiny"], "live_seed": [4]}
    for key in ("explainers", "uncertainty"):
        assert names(whole | {key: {}}, sources)["live_source"] == []


def test_the_table_shows_differences_in_units_in_which_they_can_be_seen():
    import pandas as pd

    values = {"largest_value": 2.0, "largest_difference": 2.5e-9, "named_alike": 1.0, "live_icp_calls": 130.0,
              "icp_calls": 104.0, "test_samples": 3.0}  # fmt: skip
    rows = [("live_shap", "tiny", "shap_additive", name, "all", 0, value) for name, value in values.items()]
    table = live_shap(pd.DataFrame(rows, columns=list(TIDY_COLUMNS)), SOURCES)
    assert "| 2.000 | 2.500 | 100.0 | 130 | 104 | 3 |" in table.markdown()
    assert "procedural stand-in" in table.markdown()
