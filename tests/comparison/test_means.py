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
        ("estimators.csv", "kl_rotation_data", "nats"),
        ("estimators.csv", "nees_truth", "nats"),
        ("estimators.csv", "coverage_starts", "share"),
        ("tables/table12_uncertainty.csv", "coverage", "percent"),
        ("tables/table12_failures.csv", "spearman_error", "correlation"),
        ("tables/table12_failures.csv", "lead", "share"),
        ("registration_methods.csv", "add", "share"),
        ("registration_methods.csv", "rotation_deg", "degrees"),
        ("tables/table11_registration.csv", "rotation_deg", "degrees"),
        ("tables/table11_severity.csv", "pose_low", "percent"),
        ("tables/table4_grid.csv", "ece", "share"),
        ("tables/table9_causes.csv", "nominal_calibration", "share"),
        ("tables/table10_controls.csv", "paper_auroc_wrong", "count"),
        ("tables/table5_learners.csv", "ece", "share"),
        ("tables/table5_shift.csv", "ece_severity", "share"),
        ("tables/table5_learners.csv", "rho", "correlation"),
        ("tables/table1_single_baselines.csv", "gpca_paper", "percent"),
    ],
)
def test_every_quantity_is_of_a_kind(file, quantity, kind):
    assert kind_of(file, quantity) == kind
    assert {of for *_, of in KINDS} == set(SETTINGS["tolerances"])


@pytest.mark.parametrize("run", ["full", "default"])
def test_the_kept_references_can_be_read(run):
    folder = ROOT / "results/reference" / run
    files = [path for path in folder.rglob("*.csv") if str(path.relative_to(folder)) not in reference.NOT_COMPARED]
    assert len(files) >= 8
    for path in files:
        assert len(read_means(path)) > 5
    with pytest.raises(InputError, match="neither tidy"):
        read_means(ROOT / "gpca/comparison/reasons.csv")


def test_a_share_of_the_runs_is_one_of_as_many_as_there_are_seeds(tmp_path):
    head = "table,source,method,metric,concept,seed,value\n"
    rows = [f"active_learning/pretrained,ycb,random,{name},noise,{seed},1.0\n" for name in ("reached", "accuracy")
            for seed in (0, 1, 2)]  # fmt: skip
    (tmp_path / "active_learning.csv").write_text(head + "".join(rows))
    found = {mean.quantity: mean.samples for mean in read_means(tmp_path / "active_learning.csv", {"ycb": 90}).values()}
    assert found == {"reached": 3, "accuracy": 90}
    table = read_means(ROOT / "results/reference/full/tables/table3_extended.csv")
    assert {mean.samples for mean in table.values() if mean.quantity == "reached"} == {5}
