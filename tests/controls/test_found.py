"""What is said to have been found under the controls, held against the reference run on real objects.

The rows that the page prints are held to it by tests/test_documented_numbers.py.
"""

import pandas as pd

from gpca.code_files import ROOT
from tests.documents import unwrapped

TABLES = ROOT / "results/reference/real/tables"


def pooled():
    rows = pd.read_csv(TABLES / "table10_controls.csv")
    return rows[rows["source"] == "pooled"].set_index(["explainer", "control"])["mean"].unstack()


def test_what_the_readme_says_of_unseen_objects_stands_in_the_reference():
    by, readme = pooled(), unwrapped("README.md")
    gpca, pair = by.loc["gpca"], by.loc["gpca_pair"]
    assert (
        f"falls from {gpca['paper']:.1f} to {gpca['unseen_objects']:.0f} %, and on other datasets to "
        f"{gpca['transfer']:.0f} %" in readme
    )
    assert f"the same classifier keeps {pair['unseen_objects']:.1f} and {pair['transfer']:.1f} %" in readme


def test_what_is_said_of_density_and_of_doubt_stands_in_the_reference():
    by, found = pooled(), unwrapped("docs/controls.md")
    assert round(by.loc["gpca", "paper"] - by.loc["gpca", "density"]) == 1
    lost = by.loc["analytical_gpc", "paper"] - by.loc["analytical_gpc", "density"]
    assert f"while classic features lose {lost:.0f}." in found
    own, of_pair = (by.loc[name, "unseen_objects_auroc"] for name in ("gpca", "gpca_pair"))
    assert f"an AUROC of {own:.2f}, on the pair with {of_pair:.2f}" in found
    shuffled = by["shuffled"].dropna()
    assert abs(shuffled.mean() - 100 / 3) < 2


def test_learning_what_to_measure_of_the_pair_does_not_pay():
    costs = pd.read_csv(TABLES / "table10_costs.csv").set_index(["explainer", "metric"])["mean"].unstack()
    for learned in ("gpca_pair_dgcnn", "gpca_pair_attention"):
        assert costs.loc[learned, "learning_seconds"] > 5 * costs.loc["gpca_pair", "learning_seconds"]
        for control in ("paper", "unseen_objects", "transfer"):
            assert costs.loc[learned, control] <= costs.loc["gpca_pair", control]


def test_other_trainings_of_the_encoder_change_nothing_beyond_the_interval():
    rows = pd.read_csv(TABLES / "table10_encoders.csv")
    changes = rows[(rows["source"] == "pooled") & (rows["objects"] == "unseen_objects_change")]
    assert set(changes["training"]) == {"random_draws", "two_layer_head"}
    assert (changes["ci_low"] <= 0).all() and (changes["ci_high"] >= 0).all()
