"""What the documentation says of explainers with something else beneath them, held against the reference."""

import pandas as pd

from gpca.code_files import ROOT
from tests.documents import unwrapped

TABLES = ROOT / "results/reference/real/tables"
LOCAL = ["point_to_point", "point_to_plane", "gicp", "trimmed"]


def span(values, joint="to"):
    return f"{values.min():.0f} {joint} {values.max():.0f} %"


def test_what_was_found_of_estimators_stands_in_the_reference():
    tidy = pd.read_csv(TABLES / "table14_estimator_explanations.csv")
    rows = tidy.pivot(index=["explainer", "estimator"], columns="metric", values="mean")
    found = unwrapped("docs/estimators.md")
    assert f"{tidy['n_test'].max()} test samples" in found
    assert f"classifier keeps {span(rows.loc['residuals_logistic', 'all'])}" in found
    shap = rows.loc["shap_additive"]
    assert f"SHAP stays at {span(shap['all'])}" in found
    others = shap.drop("monte_carlo")["agreement"]
    alike = others[["brossard", "stein_icp"]]
    assert f"in {span(alike, 'and')} of the cases, with the four others in {span(others.drop(alike.index))}" in found


def test_what_was_found_of_methods_stands_in_the_reference():
    rows = pd.read_csv(TABLES / "table14_method_matrix.csv")
    cells = rows[rows["asked_of"] != "another"].set_index(["explainer", "learnt_from", "asked_of"])["mean"]
    found = unwrapped("docs/registration.md")
    assert f"{span(cells['gpca'])} in every cell" in found
    pair = cells["gpca_pair"]
    assert (
        f"among the local methods, {span(pair.loc[LOCAL, LOCAL])}, but falls to {span(pair.loc[LOCAL, 'fgr'])}" in found
    )
    assert f"keeps {span(pair['fgr'])} everywhere" in found
