"""Explanations by other registration methods, and what estimators say of their poses."""

from dataclasses import replace

import numpy as np
import pytest

from gpca import CanonicalFrame, Explainer
from gpca.alignment.icp import ICPSettings
from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.alignment.rigid import transform
from gpca.errors import InputError
from gpca.uncertainty.settings import UncertaintySettings


@pytest.mark.parametrize("method", ["point_to_plane", "generalized"])
def test_other_kinds_of_icp_estimate_the_normals(model, pair, method):
    source, target = pair
    explanation = Explainer(replace(model, icp=ICPSettings(method=method)), device="cpu").explain(source, target)
    assert explanation.fitness > 0


def test_a_method_finds_the_pose_and_the_scores_are_those_at_it(explainer, model, pair):
    source, target = pair
    frame = CanonicalFrame.of(target)
    explanation = explainer.explain(source, target, method="gicp")
    own = Pair(frame.coordinates(source), frame.coordinates(target)).with_normals()
    expected = make_method("gicp")(own).T_target_source
    np.testing.assert_allclose(explanation.T_target_source, frame.pose_outside(expected), atol=1e-9)
    [scores_C] = model.gpc.attribute(explainer.embed(transform(expected, own.source)))[0]
    np.testing.assert_allclose(list(explanation.scores.values()), scores_C, atol=1e-6)
    assert explanation.method == "gicp"
    assert explainer.explain(source, target).method == "point_to_point"


def test_a_global_method_needs_no_initial_pose_and_gives_the_same_numbers_again(explainer, pair):
    source, target = pair
    first, second = (explainer.explain(source, target, method="fpfh_ransac") for _ in range(2))
    assert np.array_equal(first.T_target_source, second.T_target_source)
    assert first.scores == second.scores


def test_a_failed_registration_is_noted(explainer, pair):
    source, target = pair
    lost = explainer.explain(source + 5, target, method="point_to_plane")
    assert lost.notes[0].startswith("point_to_plane failed: no source point has a target point within 0.1 diameters")
    assert any("so the scores are meaningless" in warning for warning in lost.warnings)
    assert lost.fitness == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "icp"}, "registration method 'icp': unknown"),
        ({"method": ""}, "registration method '': unknown"),
        ({"uncertainty": UncertaintySettings(), "estimator": "gauss"}, "estimator 'gauss': unknown"),
        ({"uncertainty": UncertaintySettings(), "estimator": "cello"}, "'cello': learns from registrations"),
    ],
)
def test_a_method_that_cannot_be_asked_is_refused(explainer, pair, arguments, message):
    with pytest.raises(InputError, match=message):
        explainer.explain(*pair, **arguments)


def test_the_spread_of_the_pose_is_measured_where_it_is_asked_for(explainer, pair):
    source, target = pair
    explanation = explainer.explain(1e3 * source, 1e3 * target, unit="mm", uncertainty=UncertaintySettings(starts=13))
    assert explainer.explain(source, target).spread is None
    assert explanation.spread.covariance_6_6.shape == (6, 6)
    assert 0 <= explanation.spread.rotation_deg < 60
    assert 0 <= explanation.spread.translation < 100
    assert "uncertainty" in explanation.seconds


def test_an_estimator_says_how_uncertain_the_pose_of_a_method_is(explainer, pair):
    asked = {"uncertainty": UncertaintySettings(starts=13, icp_points=64), "method": "gicp", "estimator": "brossard"}
    explanation = explainer.explain(*pair, **asked)
    spread = explanation.spread
    assert np.linalg.eigvalsh(spread.covariance_6_6).min() > 0
    assert spread.translation == pytest.approx(spread.diameter * np.sqrt(np.trace(spread.covariance_6_6[3:, 3:])))
    assert "(root mean square by brossard)" in explanation.text()
    assert explanation.as_dict()["spread"]["estimator"] == "brossard"
    assert explanation.as_dict()["spread"]["starts"] is None


def test_an_estimator_that_cannot_tell_leaves_a_note(explainer, pair):
    asked = {"uncertainty": UncertaintySettings(icp_points=64), "estimator": "bonnabel"}
    explanation = explainer.explain(*pair, **asked)
    assert explanation.spread is None
    assert [note for note in explanation.notes if note.startswith("bonnabel gives no covariance: the Hessian is no")]
