"""The files of single steps: what is in them, and that it is what the settings ask for."""

import numpy as np
import pandas as pd
import pytest

from baselines import analytical
from gpca.attribution.predictions import read_predictions, write_timings
from gpca.causes.dataset import LABELS
from gpca.causes.policy import RecoveryPolicy, Thresholds
from gpca.model.file import Model

from .by_words import main
from .command_lines import POLICY, STEP_OPTIONS, arguments


@pytest.mark.parametrize(
    ("rows", "seconds", "columns", "count"),
    [
        ("brossard_said.csv", "brossard_seconds.csv", "sample,method,seconds", 2),
        ("point_trials.csv", "point_seconds.csv", "sample,start,seconds", 2 * 3),
    ],
)
def test_seconds_are_in_a_file_of_their_own(made, rows, seconds, columns, count):
    rows, seconds = ((made / name).read_text().splitlines() for name in (rows, seconds))
    assert "seconds" not in rows[0]
    assert seconds[0] == columns
    assert len(rows) == len(seconds) == 1 + count


def test_a_diagnosis_scores_nominal_and_the_causes_of_every_sample(made):
    rows = read_predictions(made / STEP_OPTIONS["diagnose"]["--predictions"])
    assert [name for name in rows.columns if name.startswith("score_")] == [f"score_{label}" for label in LABELS]
    assert set(rows["split"]) == {"train", "test"}


def test_what_is_exchanged_follows_from_what_an_explainer_reads(made):
    rows = pd.read_csv(made / "exchange.csv")
    kinds = rows.groupby("explainer")["exchanged"].agg(set).to_dict()
    assert kinds == {"gpca": {"method"}, "shap_additive": {"estimator"}, "residuals_logistic": {"estimator"}}
    assert set(rows["split"]) == {"test"}


def test_curves_of_labels_are_of_every_backbone_the_pair_and_a_rare_concept(made):
    rows = [line.split(",") for line in (made / "frame_all_labels.csv").read_text().splitlines()[1:]]
    assert {(row[0], row[1]) for row in rows} == {("dgcnn", "overlap"), ("pair", "overlap")}
    # None, and the whole pool: of 12 known samples 6, and 4 new ones, which are 40 % of it.
    assert [row[2] for row in rows] == ["0", "10", "0", "10"]
    settings = [line.split(",")[0] for line in (made / "bald_kmeans.csv").read_text().splitlines()[1:]]
    assert set(settings) == {"pretrained", "unseen", "rare_20"}
    assert "rare_20" not in (made / "stream_bald.csv").read_text()


def test_an_explainer_measures_each_registration_once(registrations, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    registrations.save("registrations.npz")
    write_timings("icp.csv", registrations, *np.zeros((2, len(registrations))))
    measured, measure = [], analytical.analytical_features

    def counted(samples, *axes, **options):
        measured.extend(zip(samples.split, samples.sample, strict=True))
        return measure(samples, *axes, **options)

    monkeypatch.setattr(analytical, "analytical_features", counted)
    changes = {"--explainer": "analytical_gpc", "--embeddings": None, "--input-timings": "icp.csv"}
    assert main(arguments("attribute", changes)) == 0
    assert measured == list(zip(registrations.split, registrations.sample, strict=True))


def test_the_model_holds_the_policy_of_the_config_with_a_threshold_of_its_own(folder, made):
    assert Model.load(made / "model.pt").policy.thresholds.uncertain > 0
    declared = STEP_OPTIONS["model"]["--settings"] | {
        "recovery": POLICY | {"thresholds": POLICY["thresholds"] | {"uncertain": 0.125}}
    }
    assert main(arguments("model", {"--settings": declared, "--out": "declared.pt"})) == 0
    policy = Model.load(folder / "declared.pt").policy
    assert policy == RecoveryPolicy(Thresholds(0.125, 0.4, 0.1, 3), POLICY["treatments"])
