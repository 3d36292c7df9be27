"""What is said to have been found about learners, held against the reference run on real objects."""

import pandas as pd

from gpca.code_files import ROOT
from tests.documents import unwrapped

REFERENCE = ROOT / "results/reference/real"
PAGE = "docs/diagnostics.md"


def means(table):
    """Return the means of a table of learners: (learner, quantity) in rows, sources in columns."""
    rows = pd.read_csv(REFERENCE / f"tables/{table}.csv")
    return rows.set_index(["learner", "quantity", "source"])["mean"].unstack()


def of(quantity, table):
    return means(table).xs(quantity, level="quantity")


def test_what_was_found_of_the_papers_setting_stands_in_the_reference():
    accuracy, ece, found = of("accuracy", "table5_learners"), of("ece", "table5_learners"), unwrapped(PAGE)
    behind = accuracy.loc[["learner_forest", "learner_linear_svm"]] - accuracy.loc["gpca_paper"]
    assert behind["coffee_cup"].abs().max() < 1
    farther = behind[["linemod", "ycb"]]
    assert f"it is {farther.min(axis=None):.1f} to {farther.max(axis=None):.1f} points below" in found
    short, long = (ece.loc[name, ["linemod", "ycb"]] for name in ("gpca_paper", "gpca"))
    told = f"ECE is {short.min():.2f} to {short.max():.2f} on LINEMOD and YCB, and {long.min():.2f} to {long.max():.2f}"
    assert told in found


def test_what_was_found_of_shift_stands_in_the_reference():
    claims = pd.read_csv(REFERENCE / "claims.csv")
    verdicts = claims[claims["claim"] == "gpc_tracks_shift"].groupby("other")["verdict"].value_counts()
    forest, svm = verdicts["learner_forest"], verdicts["learner_linear_svm"]
    found = unwrapped(PAGE)
    assert "supported" not in forest and f"{forest['refuted']} of {forest.sum()} comparisons refute" in found
    assert f"{svm['supported']} of {svm.sum()} support" in found
    for quantity in ("rho_severity", "rho_source"):
        assert set(of(quantity, "table5_shift").idxmax()) == {"learner_dirichlet_gp"}


def test_what_was_found_of_unseen_objects_and_sources_stands_in_the_reference():
    objects, sources = (of(f"accuracy_{name}", "table5_shift") for name in ("objects", "source"))
    fallen = pd.concat([objects[["linemod", "ycb"]], sources])
    assert f"accuracy falls to {fallen.min(axis=None):.0f} to {fallen.max(axis=None):.0f} %" in unwrapped(PAGE)
