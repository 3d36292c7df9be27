import pandas as pd

from gpca.declarations.plan import Run
from gpca.evaluation.measures import TIDY_COLUMNS
from gpca.experiments.live_shap import live_shap, names

SOURCES = {"tiny": {"title": "Tiny", "stand_in": True}}


def test_without_the_table_or_its_explainer_nothing_is_compared():
    own, sources = {"sources": 1, "seeds": 1}, dict.fromkeys(["tiny", "other"])
    whole = {"live_shap": own, "explainers": {"shap_additive": {}}, "uncertainty": {"additive": {}}, "seeds": [4, 5]}
    assert names(whole, sources) == {"live_source": ["tiny"], "live_seed": [4]}
    for key in ("explainers", "uncertainty"):
        assert names(whole | {key: {}}, sources)["live_source"] == []


def test_the_table_shows_differences_in_units_in_which_they_can_be_seen():
    values = {"largest_value": 2.0, "largest_difference": 2.5e-9, "named_alike": 1.0, "live_icp_calls": 130.0,
              "icp_calls": 104.0, "test_samples": 3.0}  # fmt: skip
    rows = [("live_shap", "tiny", "shap_additive", name, "all", 0, value) for name, value in values.items()]
    table = live_shap(Run({"sources": SOURCES}), pd.DataFrame(rows, columns=list(TIDY_COLUMNS)))
    assert "| 2.000 | 2.500 | 100.0 | 130 | 104 | 3 |" in table.markdown()
    assert "procedural stand-in" in table.markdown()
