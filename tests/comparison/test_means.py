"""Means over the seeds: of what kind each quantity is, and that those of the kept references can be read."""

import pytest

from gpca.code_files import ROOT
from gpca.comparison import reference
from gpca.comparison.means import KINDS, kind_of, read_means
from gpca.errors import InputError

from .conftest import SETTINGS


@pytest.mark.parametrize(
    ("file", "quantity", "kind"),
    [
        ("metrics.csv", "accuracy", "share"),
        ("metrics.csv", "predicted_as_pose", "count"),
        ("active_learning.csv", "labels_to_target", "count"),
        ("diagnostics.csv", "rho_max_score_knn_analytical_low", "correlation"),
        ("diagnostics.csv", "nll", "nats"),
        ("kernels.csv", "elbo", "nats"),
        ("recovery.csv", "recovered_within_3", "share"),
        ("recovery.csv", "first_queue", "count"),
        ("tables/table8_recovery.csv", "actions", "count"),
        ("tables/table4_grid.csv", "ece", "percent"),
        ("tables/table5_learners.csv", "ece", "share"),
        ("tables/table5_shift.csv", "ece_severity", "share"),
        ("tables/table5_learners.csv", "rho", "correlation"),
        ("tables/table1_single_baselines.csv", "gpca_paper", "percent"),
    ],
)
def test_every_quantity_is_of_a_kind(file, quantity, kind):
    assert kind_of(file, quantity) == kind
    assert {of for *_, of in KINDS} == set(SETTINGS["tolerances"])


@pytest.mark.parametrize("run", ["real", "embedded"])
def test_the_kept_references_can_be_read(run):
    folder = ROOT / "results/reference" / run
    files = [path for path in folder.rglob("*.csv") if str(path.relative_to(folder)) not in reference.NOT_COMPARED]
    assert len(files) >= 8
    for path in files:
        assert len(read_means(path)) > 5
    with pytest.raises(InputError, match="neither tidy"):
        read_means(ROOT / "gpca/comparison/reasons.csv")
