"""Every estimator on the same registrations, on four objects whose causes are measured."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.rigid import inverse, transform
from gpca.alignment.twist import exp
from gpca.errors import InputError
from gpca.experiments.estimators.covariances import COVARIANCE, REFERENCE, covariance_of
from gpca.experiments.estimators.estimation import mahalanobis, predicted_spread, try_estimators
from gpca.experiments.estimators.settings import EstimatorPairSettings
from gpca.experiments.judge import Judges
from gpca.uncertainty.spread import divergence

SETTINGS = EstimatorPairSettings(
    **{"methods": {"point_to_point": 4, "point_to_plane": 2}, "train": 8, "train_starts": 7, "points": 64},
    **{"starts": 40, "start_rotation_deg": 10.0, "start_translation": 0.05, "floor": 1e-6, "failed": 0.03},
)
ESTIMATORS = {"censi": {}, "brossard": {}, "cello": {"steps": 2}}


@pytest.fixture(scope="module")
def judges(four):
    return Judges(four, "objects of four")


@pytest.fixture(scope="module")
def tried(causes, judges):
    return try_estimators(causes, judges, "four", 100, ESTIMATORS, SETTINGS)


def test_every_estimator_has_a_row_per_registration_and_so_has_the_reference(tried):
    rows, cases = tried
    assert list(rows) == [REFERENCE, *ESTIMATORS]
    for of_estimator in rows.values():
        assert of_estimator["method"].tolist() == ["point_to_point"] * 4 + ["point_to_plane"] * 2
        assert of_estimator["sample"].tolist() == [case.known["sample"] for case in cases]
        assert (of_estimator["seconds"] > 0).all()
    refusal = "the closed form is that of point-to-point, not of 'point_to_plane'"
    assert rows["censi"].loc[4:, "failure"].tolist() == [refusal] * 2
    assert rows["censi"].loc[4:, "mahalanobis"].isna().all()


def test_the_reference_is_the_covariance_of_its_results_and_does_not_diverge_from_itself(tried):
    rows, cases = tried
    for i, case in enumerate(cases):
        row = rows[REFERENCE].iloc[i]
        assert len(case.reference_twists) <= 40
        assert covariance_of(row) == pytest.approx(np.cov(case.reference_twists, rowvar=False))
        assert row["kl_rotation"] == row["kl_translation"] == pytest.approx(0, abs=1e-9)


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
        reference = np.cov(case.reference_twists, rowvar=False)
        assert row["kl_translation"] == pytest.approx(divergence(reference[3:, 3:], sigma[3:, 3:], SETTINGS.floor))


def test_the_true_twist_leads_to_the_truth(tried, causes, judges):
    """Up to a symmetry of the object, and the error is that of the pose."""
    _, cases = tried
    registrations = causes.registrations
    for case in cases:
        [row] = np.flatnonzero((registrations.sample == case.known["sample"]) & (registrations.split == "test"))
        T_true = exp(case.true_twist[None])[0] @ case.registered.T_target_source
        T_expected = registrations.T_target_source("icp", row) @ inverse(registrations.T_target_source("true", row))
        off = inverse(T_expected) @ T_true
        judge = judges.of(registrations, row)
        if not judge.symmetric:
            assert off == pytest.approx(np.eye(4), abs=1e-5)
        assert np.linalg.norm(off[:3, 3]) < 1e-5
        assert judge(inverse(T_true), inverse(T_expected))["add_relative"] < 0.02
        assert case.known["failed"] == (case.known["add_relative"] >= SETTINGS.failed)


def test_the_model_is_registered_to_what_was_observed(tried, causes):
    _, cases = tried
    registrations = causes.registrations
    for case in cases:
        [row] = np.flatnonzero((registrations.sample == case.known["sample"]) & (registrations.split == "test"))
        for cloud, whole in (
            (case.registered.pair.source, registrations.target(row)),
            (case.registered.pair.target, registrations.cloud(row)),
        ):
            assert len(cloud) == 64
            assert {tuple(p) for p in cloud.tolist()} <= {tuple(p) for p in whole.astype(float).tolist()}


def test_the_same_seed_gives_the_same_numbers_and_other_estimators_change_none(tried, causes, judges):
    again, _ = try_estimators(causes, judges, "four", 100, {"brossard": {}}, SETTINGS)
    for name in (REFERENCE, "brossard"):
        left, right = (rows[name].drop(columns="seconds") for rows in (tried[0], again))
        assert left.equals(right)


def test_objects_that_are_not_the_registrations_are_refused(causes, objects):
    with pytest.raises(
        InputError, match=r"objects of tiny: object .* give the objects that the registrations were made from"
    ):
        try_estimators(causes, Judges(objects, "objects of tiny"), "four", 100, {"censi": {}}, SETTINGS)


def test_registrations_that_fail_are_counted_and_raise_nothing(causes, judges):
    """From nowhere near: no start finds anything."""
    lost = replace(causes.registrations, T_target_source_init=causes.registrations.T_target_source_init.copy())
    lost.T_target_source_init[:, :3, 3] += 100
    few = replace(SETTINGS, methods={"point_to_point": 1})
    rows, cases = try_estimators(replace(causes, registrations=lost), judges, "four", 100, {"brossard": {}}, few)
    assert rows[REFERENCE]["failure"].tolist() == ["too few of the reference's runs found a correspondence"]
    assert rows["brossard"]["failure"].str.contains("no source point has a target point").all()
    assert rows["brossard"]["failed"].all()
    assert cases[0].reference_twists.shape == (0, 6)


def test_the_measures_by_hand():
    assert mahalanobis(np.array([1.0, 0, 0, 0, 0, 2]), np.diag([1.0, 1, 1, 1, 1, 3]), 1.0) == pytest.approx(0.5 + 1)
    points = np.array([[1.0, 0, 0], [-1, 0, 0]])
    assert predicted_spread(points, np.diag([0, 0, 0.09, 0.16, 0, 0])) == pytest.approx(0.5)


def test_a_predicted_spread_is_how_far_points_go():
    random = np.random.default_rng(0)
    factor = 0.01 * random.normal(size=(6, 6))
    points = random.normal(size=(30, 3))
    twists = random.normal(size=(4000, 6)) @ factor.T
    moved = [np.square(transform(T, points) - points).sum(axis=1).mean() for T in exp(twists)]
    assert predicted_spread(points, factor @ factor.T) == pytest.approx(np.sqrt(np.mean(moved)), rel=0.03)
    assert len(COVARIANCE) == 21
