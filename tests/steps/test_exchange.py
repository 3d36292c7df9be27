"""The step ``exchange`` by hand, and what it says of faulty files and settings."""

import pandas as pd
import pytest

from .command_lines import STEP_OPTIONS, arrays_changed, refused, removed, settings, truncated, untouched

EXCHANGE = STEP_OPTIONS["exchange"]["--settings"]["exchange"]


def exchange(**changed):
    return settings("exchange", exchange=EXCHANGE | changed)


FAULTS = [
    (removed("weights.pt"), {}, r"weights.pt: no such weights; regenerate them with Snakemake"),
    (truncated("registrations.npz"), {}, r"registrations.npz: is not a readable npz archive"),
    (arrays_changed("objects.npz", names=lambda names: names[::-1]), {}, r"objects of tiny: object \d is not '\w+'"),
    (untouched, exchange(train=10), r"setting train: 10 is not a multiple of 3"),
    (
        untouched,
        settings("exchange", explainers={"shap_removal": {}}),
        r"'shap_removal': reads design 'removal'",
    ),
]


@pytest.mark.parametrize("fault", range(len(FAULTS)))
def test_a_fault_is_one_line_and_harms_nothing(folder, capsys, fault):
    refused(folder, capsys, "exchange", *FAULTS[fault])


def test_a_method_whose_package_is_missing_is_refused_by_name(folder, capsys, monkeypatch):
    monkeypatch.setattr("gpca.alignment.methods.registry.find_spec", lambda package: None)
    message = r"registration method 'gicp_small': needs the package small_gicp; install it or leave the method out"
    refused(folder, capsys, "exchange", untouched, exchange(methods=["point_to_point", "gicp_small"]), message)


def test_what_is_exchanged_follows_from_what_an_explainer_reads(made):
    rows = pd.read_csv(made / "exchange.csv")
    kinds = rows.groupby("explainer")["exchanged"].agg(set).to_dict()
    assert kinds == {"gpca": {"method"}, "shap_additive": {"estimator"}, "residuals_logistic": {"estimator"}}
    assert set(rows["split"]) == {"test"}
