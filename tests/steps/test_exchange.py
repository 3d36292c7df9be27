"""Explainers with other methods and estimators, on three objects."""

from functools import partial

import numpy as np
import pytest

from baselines.residuals import logistic
from baselines.sensitivity import sa_local_additive
from baselines.shap_kl import shap_over_knobs
from gpca.alignment.methods import registry
from gpca.alignment.methods.interface import FailedRegistration, MethodEntry
from gpca.classifier.scores import Attribution
from gpca.errors import InputError
from gpca.pairs.judge import Judges
from gpca.pairs.perturbation import CONCEPTS
from gpca.rigid import exp, transform
from gpca.seeds import generator
from gpca.steps.exchange import (
    OBSERVED,
    TOO_FEW,
    Exchange,
    ExchangeSettings,
    KnobbedRegistrar,
    registered_by,
    require_exchangeable,
)
from gpca.uncertainty.designs import ADDITIVE_KNOBS, evaluate_design
from gpca.uncertainty.estimators import registry as estimator_registry
from gpca.uncertainty.estimators.interface import EstimatorEntry, FailedEstimate
from gpca.uncertainty.settings import UncertaintySettings

from .six_objects import rival

UNCERTAINTY = UncertaintySettings(starts=13, icp_points=64)
SETTINGS = ExchangeSettings(train=9, test=3, points=64, estimated_train=9, estimated_test=3)
RIVALS = {
    "shap_additive": rival(partial(shap_over_knobs, "tiny", 100), "uncertainty/additive"),
    "sa_local_additive": rival(partial(sa_local_additive, "tiny", 100), "uncertainty/additive"),
    "residuals_logistic": rival(partial(logistic, "tiny", 100), "uncertainty/removal", observed_only=True),
}


class Nearest:
    """Answers the concept of the training registration with the nearest embedding, the mean of its cloud."""

    def fit(self, registrations):
        self.h, self.concept = registrations.embedding, registrations.concept

    def explain(self, registrations):
        named = self.concept[np.abs(registrations.embedding[:, None] - self.h[None]).sum(axis=2).argmin(axis=1)]
        return Attribution.of_scores(
            CONCEPTS, np.array([[name == c for c in CONCEPTS] for name in named], float), seconds=0
        )


def means(registrations, source):
    h = np.array([registrations.cloud(row).mean(axis=0) for row in range(len(registrations))])
    return h, h


def exchange(methods=(), estimators=(), rivals=RIVALS):
    named = {name: {} for name in methods}, {name: {} for name in estimators}
    return Exchange("tiny", 100, SETTINGS, *named, UNCERTAINTY, rivals, means)


@pytest.fixture(scope="module")
def judges(objects):
    return Judges(objects, "objects of tiny")


@pytest.fixture(scope="module")
def rows(registrations, judges):
    return exchange(estimators=("monte_carlo", "censi", "cello", "bonnabel")).run(registrations, judges)


def test_every_sample_has_a_row_no_concept_without_an_estimate_and_no_pose_without_a_start(rows):
    assert (rows["exchanged"] == "estimator").all() and (rows["learnt_from"] == rows["asked_of"]).all()
    counts = rows.groupby(["asked_of", "explainer"])["sample"].agg(list)
    assert len(counts) == 4 * 3
    assert all(samples == [0, 1, 2] for samples in counts)
    refused = rows[rows["asked_of"] == "bonnabel"]
    assert refused["abstained"].all() and (refused["concept_predicted"] == "").all()
    assert refused["failure"].str.startswith("the Hessian is no covariance of point-to-point").all()
    assert (rows.loc[rows["asked_of"] == "monte_carlo", "failure"] == "").all()
    # Censi's form is the same however far the starts spread.
    censi = rows[(rows["asked_of"] == "censi") & (rows["explainer"] == "shap_additive") & (rows["failure"] == "")]
    assert len(censi) and censi["score_pose"].abs().max() < 1e-9
    assert (censi["score_noise"] != 0).all()


def test_an_explainer_that_learns_needs_estimates_of_training_registrations(registrations, judges, monkeypatch):
    def of_test_pairs(registered):
        if registered.pair.seed not in asked:
            raise FailedEstimate("nothing")
        return 1e-4 * np.eye(6)

    registrar = KnobbedRegistrar(registrations, "tiny", 100, UNCERTAINTY)
    asked = {next(registrar.under(row, OBSERVED)).pair.seed for row in registrations.rows("test")[:3]}
    entries = {"m": {"late": EstimatorEntry("Late", "starts", of_test_pairs)}}
    monkeypatch.setattr(estimator_registry.REGISTRY, "by_module", lambda: entries)
    rows = exchange(estimators=("late",)).run(registrations, judges).set_index("explainer")
    assert set(rows.loc["residuals_logistic", "failure"]) == {TOO_FEW}
    assert rows.loc["residuals_logistic", "abstained"].all()
    # One covariance whatever the knobs: nothing sets a concept apart.
    assert set(rows.loc["shap_additive", "failure"]) == {""} and rows.loc["shap_additive", "abstained"].all()


def test_the_conditions_are_those_of_the_design(registrations):
    """The same clouds: a Monte-Carlo of the design's own starts says the same of them."""
    one = registrations.subset(registrations.rows("test")[:1])
    outcomes, *_ = evaluate_design("additive", one, "tiny", 100, UNCERTAINTY)
    registrar = KnobbedRegistrar(one, "tiny", 100, UNCERTAINTY)
    axes = ("tiny", 100, "uncertainty", "test", one.sample[0])
    unit_n_6 = generator(*axes, "starts").normal(size=(UNCERTAINTY.starts, 6))
    for k, registered in enumerate(registrar.under(0, ADDITIVE_KNOBS)):
        poses = exp(registered.twists_from(unit_n_6 * registered.deviation_6)) @ registered.T_target_source
        spread = np.cov(poses[:, :3, 3], rowvar=False)
        if outcomes.degenerate[0, k]:
            continue
        # The translation of a twist differs from that of the origin by half the turn, so both are only close.
        np.testing.assert_allclose(np.trace(spread), np.trace(outcomes.covariance[0, k, 3:, 3:]), rtol=0.3, atol=1e-5)


def test_registrations_by_another_method_are_the_same_pairs_at_its_poses(registrations):
    few = registrations.subset(np.arange(3))
    found = registered_by(few, {"point_to_point": {}, "point_to_plane": {}}, "tiny", 100, 64)
    for anew, failure_S in found.values():
        assert failure_S.shape == (3,)
        for row in range(3):
            np.testing.assert_allclose(anew.source(row), few.source(row), atol=1e-5)
            np.testing.assert_array_equal(anew.target(row), few.target(row))
            moved = transform(anew.T_target_source("icp", row), few.source(row))
            np.testing.assert_allclose(anew.cloud(row), moved, atol=1e-5)
    poses = [anew.T_target_source_icp for anew, _ in found.values()]
    assert np.abs(poses[0] - poses[1]).max() > 1e-4


def test_each_method_is_learned_from_and_asked_about_and_a_failed_registration_counts(
    registrations, judges, monkeypatch
):
    def fails(pair):
        raise FailedRegistration("no match")

    entries = {"point_to_point": registry.method_entry("point_to_point"), "blind": MethodEntry("Blind", fails)}
    monkeypatch.setattr(registry.REGISTRY, "by_module", lambda: {"m": entries})
    rows = exchange(methods=tuple(entries), rivals={"nearest": rival(Nearest, "embeddings")}).run(registrations, judges)
    assert rows.groupby(["learnt_from", "asked_of"]).size().to_dict() == {(a, b): 3 for a in entries for b in entries}
    assert set(rows.loc[rows["asked_of"] == "blind", "failure"]) == {"no match"}
    assert not rows["abstained"].any() and (rows["split"] == "test").all()


def test_explainers_of_designs_other_than_additive_are_refused():
    for name in ("shap_additive", "residuals_forest", "gpca_pair", "gpca"):
        require_exchangeable(name)
    with pytest.raises(InputError, match=r"'shap_removal': reads design 'removal', which estimators do not provide"):
        require_exchangeable("shap_removal")
