"""Every estimator on the same registrations, on four objects whose causes are measured."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.causes.drawing import draw_causes
from gpca.causes.settings import CauseSettings
from gpca.errors import InputError
from gpca.pairs.judge import Judges
from gpca.rigid import exp, inverse
from gpca.steps.estimates import DrawnCauses, compared, try_estimators
from gpca.uncertainty.estimates import COVARIANCE, KINDS, MILLI, REFERENCES, SIXTH, EstimatorPairSettings
from gpca.uncertainty.spread import divergence
from tests.conftest import FEW_CAUSES

SETTINGS = EstimatorPairSettings(
    **{"methods": {"point_to_plane": 2, "point_to_point": 4}, "train": 8, "train_starts": 7, "points": 64},
    **{"repeats": 20, "start_rotation_deg": 10.0, "start_translation": 0.05, "floor": 1e-6, "failed": 0.03},
)
ESTIMATORS = {"censi": {}, "brossard": {}, "cello": {"steps": 2}}


SEED = 101  # of which no registration is so far off that it, or a reference, finds no correspondence


@pytest.fixture(scope="module")
def causes(four):
    return draw_causes(four, "four", SEED, CauseSettings(**FEW_CAUSES))[0]


@pytest.fixture(scope="module")
def situations(causes, four):
    return DrawnCauses("four", SEED, causes, CauseSettings(**FEW_CAUSES), four, Judges(four, "objects of four"))


@pytest.fixture(scope="module")
def tried(situations):
    """Its few training samples suffice to learn from."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gpca.uncertainty.estimators.learned.FEWEST_EXAMPLES", 6)
        return try_estimators(situations, ESTIMATORS, SETTINGS)


def test_every_estimator_has_a_row_per_registration_and_so_have_the_references(tried):
    rows, cases = tried
    assert list(rows) == [*REFERENCES, *ESTIMATORS]
    for name in (*REFERENCES, *ESTIMATORS):
        assert rows[name]["method"].tolist() == ["point_to_plane"] * 2 + ["point_to_point"] * 4
        assert rows[name]["sample"].tolist() == [case.columns["sample"] for case in cases]
        assert (rows[name]["seconds"] > 0).all()
    refusal = "the closed form is that of point-to-point, not of 'point_to_plane'"
    assert rows["censi"].loc[:1, "failure"].tolist() == [refusal] * 2
    assert rows["censi"].loc[:1, "mahalanobis"].isna().all()


def covariance_of(row):
    upper_6_6 = np.zeros((6, 6))
    upper_6_6[SIXTH] = row[list(COVARIANCE)].to_numpy(float) / MILLI**2
    return upper_6_6 + np.triu(upper_6_6, 1).T


def test_a_reference_is_the_covariance_of_its_results_and_does_not_diverge_from_itself(tried):
    rows, cases = tried
    for i, case in enumerate(cases):
        for kind in KINDS:
            row, twists = rows[f"reference_{kind}"].iloc[i], case.references[kind][0]
            assert len(twists) <= SETTINGS.repeats
            assert covariance_of(row) == pytest.approx(np.cov(twists, rowvar=False))
            for name in ("kl_rotation", "kl_translation"):
                assert row[f"{name}_{kind}"] == pytest.approx(0, abs=1e-9)
            assert row[f"error_ratio_{kind}"] == pytest.approx(1)
            assert row[f"mahalanobis_{kind}"] == pytest.approx(6)


def test_what_is_measured_is_what_the_estimate_says(tried):
    rows, cases = tried
    for i, case in enumerate(cases):
        row = rows["brossard"].iloc[i]
        if row["failure"]:
            continue
        sigma = covariance_of(row)
        e = case.true_twist
        floored = sigma + SETTINGS.floor * np.eye(6)
        assert row["mahalanobis"] == pytest.approx(e @ np.linalg.inv(floored) @ e)
        assert row["error_ratio"] == pytest.approx(e @ e / np.trace(floored))
        for kind in KINDS:
            reference = np.cov(case.references[kind][0], rowvar=False)
            expected = divergence(reference[3:, 3:], sigma[3:, 3:], SETTINGS.floor)
            assert row[f"kl_translation_{kind}"] == pytest.approx(expected)


def test_a_covariance_is_compared_with_results_about_their_mean():
    """As often within its region as the quantile says, and half as wide as it should be: four times the square."""
    random = np.random.default_rng(0)
    twists = 3.0 + random.normal(size=(20_000, 6))
    right = compared(np.eye(6), twists, 1e-9)
    assert right["covered"] == pytest.approx(0.95, abs=0.01)
    assert (right["error_ratio"], right["mahalanobis"]) == pytest.approx((1, 6), rel=0.02)
    sure = compared(np.eye(6) / 4, twists, 1e-9)
    assert (sure["error_ratio"], sure["mahalanobis"]) == pytest.approx((4, 24), rel=0.02)
    assert sure["covered"] < 0.4
    assert sure["kl_rotation"] == pytest.approx(0.5 * (3 * 4 - 3 * np.log(4) - 3), rel=0.03)
    assert compared(np.eye(6), np.empty((0, 6)), 1e-9) == {}


def test_the_true_twist_leads_to_the_truth(tried, causes, situations):
    """Up to a symmetry of the object, and the error is that of the pose."""
    _, cases = tried
    registrations = causes.registrations
    for case in cases:
        [row] = np.flatnonzero((registrations.sample == case.columns["sample"]) & (registrations.split == "test"))
        T_true = exp(case.true_twist[None])[0] @ case.registered.T_target_source
        T_expected = registrations.T_target_source("icp", row) @ inverse(registrations.T_target_source("true", row))
        off = inverse(T_expected) @ T_true
        judge = situations.judges.of(registrations, row)
        if not judge.symmetric:
            assert off == pytest.approx(np.eye(4), abs=1e-5)
        assert np.linalg.norm(off[:3, 3]) < 1e-5
        assert judge(inverse(T_true), inverse(T_expected))["add_relative"] < 0.02
        assert case.columns["failed"] == (case.columns["add_relative"] >= SETTINGS.failed)


def test_the_model_is_registered_to_what_was_observed(tried, causes):
    _, cases = tried
    registrations = causes.registrations
    for case in cases:
        [row] = np.flatnonzero((registrations.sample == case.columns["sample"]) & (registrations.split == "test"))
        assert case.columns["cluster"] == registrations.cluster[row]
        for cloud, whole in (
            (case.registered.pair.source, registrations.target(row)),
            (case.registered.pair.target, registrations.cloud(row)),
        ):
            assert len(cloud) == 64
            assert {tuple(p) for p in cloud.tolist()} <= {tuple(p) for p in whole.astype(float).tolist()}


def test_settings_that_the_causes_were_not_drawn_with_are_refused(situations):
    other = CauseSettings(**FEW_CAUSES | {"points": (128, 200)})
    with pytest.raises(InputError, match=rf"sample \d+ of four, seed {SEED}: is not reproduced by these settings"):
        try_estimators(replace(situations, drawn_by=other), {"censi": {}}, SETTINGS)


def test_registrations_that_fail_are_counted_and_raise_nothing(situations):
    """From nowhere near: no start finds anything."""
    registrations = situations.causes.registrations
    lost = replace(registrations, T_target_source_init=registrations.T_target_source_init.copy())
    lost.T_target_source_init[:, :3, 3] += 100
    nowhere = replace(situations, causes=replace(situations.causes, registrations=lost))
    few = replace(SETTINGS, methods={"point_to_point": 1})
    rows, cases = try_estimators(nowhere, {"brossard": {}}, few)
    for kind in KINDS:
        assert rows[f"reference_{kind}"]["failure"].tolist() == [
            "too few of the reference's runs found a correspondence"
        ]
        assert cases[0].references[kind][0].shape == (0, 6)
    assert rows["brossard"]["failure"].str.contains("no source point has a target point").all()
    assert rows["brossard"]["failed"].all()
