"""Estimators by name: all of them on one pair, and what becomes of those that cannot tell."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.methods.interface import Outcome, Pair
from gpca.errors import InputError
from gpca.rigid import exp, transform
from gpca.uncertainty.estimators import registry
from gpca.uncertainty.estimators.interface import EstimatorEntry, Example, intrinsic_frame, inverse_hessian

from .cases import FAR, ellipsoid, registered

NAMES = {"monte_carlo", "censi", "bonnabel", "brossard", "bayesian_icp", "stein_icp", "cello", "learned"}
QUICK = {"monte_carlo": {"starts": 13}, "bayesian_icp": {"steps": 20, "burn_in": 5}, "stein_icp": {"steps": 5}}
QUICK |= {"cello": {"steps": 2}, "learned": {"steps": 2}}
RANDOM = np.random.default_rng(0)
EXAMPLES = [Example(RANDOM.normal(size=5), RANDOM.normal(size=(13, 6)), np.zeros(6), np.eye(4)) for _ in range(10)]


def described(**changes):
    return registered(describe=lambda: np.zeros(5), noise=0.01, **changes)


def test_every_estimator_has_an_entry():
    assert set(registry.estimators()) == NAMES
    assert {registry.estimator_module(name).rsplit(".", 1)[1] for name in NAMES} == {"analytic", "learned", "posterior"}
    assert {name for name in NAMES if registry.estimator_entry(name).learn} == {"cello", "learned"}


@pytest.mark.parametrize("name", sorted(NAMES))
def test_an_estimate_is_a_covariance_and_without_correspondences_it_fails(name):
    estimate = registry.make_estimator(name, QUICK.get(name), EXAMPLES)
    method = "point_to_plane" if name == "bonnabel" else "point_to_point"
    said = estimate(described(method=method))
    assert said.failure == ""
    assert said.covariance_6_6.shape == (6, 6)
    assert (said.covariance_6_6 == said.covariance_6_6.T).all()
    assert np.linalg.eigvalsh(said.covariance_6_6).min() > 0
    lost = replace(described(method=method), outcome=Outcome(FAR, 0.0, 0.0, "no source point is near"))
    assert estimate(lost).covariance_6_6 is None
    assert estimate(lost).failure == "no source point is near"
    # Nor where the method says that it has found some, but the pose has none.
    wrong = estimate(described(method=method, T_found=FAR))
    assert wrong.failure == "fewer than 3 correspondences at the pose" or name in ("monte_carlo", "cello", "learned")


def test_starts_from_which_nothing_is_found_a_method_without_a_start_and_missing_normals_are_failures():
    source, normals = ellipsoid(0)
    lost = replace(registered(), pair=Pair(source, source, FAR, normals, normals))
    bare = replace(registered("point_to_plane"), pair=replace(registered().pair, target_normals=None))
    for name in ("monte_carlo", "brossard"):
        assert registry.make_estimator(name)(lost).failure == "fewer than 7 runs found a correspondence"
    for name in ("bonnabel", "brossard", "monte_carlo"):
        assert registry.make_estimator(name)(bare).failure == "the target has no normals"
    said = registry.make_estimator("monte_carlo")(registered("fgr"))
    assert said.failure == "'fgr' reads no initial pose, so that its results do not spread"


def test_any_local_method_can_be_run_from_starts():
    batched, one_by_one = (
        registry.make_estimator("monte_carlo", {"starts": 8})(registered(method, noise=0.01)).covariance_6_6
        for method in ("point_to_plane", "huber")
    )
    assert np.sqrt(np.trace(one_by_one)) == pytest.approx(np.sqrt(np.trace(batched)), rel=0.5)


def test_a_covariance_that_is_not_finite_is_a_failure(monkeypatch):
    entry = EstimatorEntry("Wild", "starts", estimate=lambda registered: np.full((6, 6), np.nan))
    monkeypatch.setattr(registry.REGISTRY, "by_module", lambda: {"wild": {"wild": entry}})
    assert registry.make_estimator("wild")(registered()).failure == "the covariance is not finite"


def test_one_that_learns_needs_examples_and_fails_at_too_few():
    with pytest.raises(InputError, match=r"'cello': learns from registrations .* choose one of .*censi"):
        registry.make_estimator("cello")
    assert (
        registry.make_estimator("cello", {}, EXAMPLES[:5])(described()).failure
        == "5 registrations to learn from, not 8"
    )


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("icp", {}, r"estimator 'icp': unknown; choose one of .*brossard"),
        ("censi", {"sigma": 1}, r"estimator 'censi': setting sigma: unknown"),
        ("monte_carlo", {"starts": 2.5}, r"setting starts: 2.5 should be a valid integer"),
        ("cello", {"learning_rate": -1}, r"setting learning_rate: -1 should be greater than or equal to 0"),
        ("cello", {"steps": "many"}, r"setting steps: 'many' should be a valid integer"),
    ],
)
def test_unknown_names_and_settings_are_refused(name, settings, message):
    with pytest.raises(InputError, match=message):
        registry.require_estimator_settings(name, settings)


def test_the_inverse_of_a_hessian_or_why_there_is_none():
    assert inverse_hessian(np.diag([1.0, 2, 4, 1, 1, 1]))[2, 2] == 0.25
    for diagonal, message in (
        ([1, 1, 1, 0, 0, 1], "singular: 2 of 6"),
        ([0] * 6, "nothing holds the pose"),
        ([1, 1, 1, 1, 1, -1], "no minimum"),
    ):
        with pytest.raises(Exception, match=message):
            inverse_hessian(np.diag(np.array(diagonal, float)))


def test_the_intrinsic_frame_turns_with_the_cloud():
    cloud = ellipsoid(0)[0] ** 3 + 0.3 * ellipsoid(0)[0]
    T = exp(np.array([[0.4, -0.8, 0.5, 0.1, 0.2, 0.3]]))[0]
    frame = intrinsic_frame(cloud)
    assert np.linalg.det(frame[:3, :3]) == pytest.approx(1)
    assert intrinsic_frame(transform(T, cloud)) == pytest.approx(T @ frame, abs=1e-9)
