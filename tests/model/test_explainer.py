"""Explanations: pose, scores, methods, estimators and refused inputs."""

import re
import subprocess
import sys

import numpy as np
import pytest

from gpca import CanonicalFrame
from gpca.alignment.icp import ICP, ICPSettings
from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.encoders.inference import TrainedEncoder
from gpca.errors import InputError
from gpca.process.code_files import ROOT
from gpca.rigid import exp, inverse, transform
from gpca.uncertainty.settings import UncertaintySettings


def scores(explanation):
    return np.array(list(explanation.scores.values()))


def test_pose_fitness_and_residual_are_those_of_open3d(explainer, pair):
    source, target = pair
    frame = CanonicalFrame.of(target)
    expected = ICP(target, None, ICPSettings(correspondence_distance=0.1 * frame.diameter)).register(source, np.eye(4))
    explanation = explainer.explain(source, target)
    np.testing.assert_allclose(explanation.T_target_source, expected.T_target_source, atol=1e-6)
    assert explanation.fitness == pytest.approx(expected.fitness)
    assert explanation.inlier_rmse == pytest.approx(expected.inlier_rmse, rel=1e-5)


def test_scores_are_those_of_the_workflow_on_the_same_embedding(explainer, model, registrations):
    """A cloud of as many points as the encoder sees has one embedding, whatever the draws are called."""
    aligned = registrations.cloud(0)[:64]
    h_1_d = model.encoder(aligned[None])
    np.testing.assert_allclose(explainer.embed(aligned), h_1_d, atol=1e-5)
    explanation = explainer.explain(aligned, aligned, frame=CanonicalFrame(np.zeros(3), 1.0))
    expected, variances, bald = model.gpc.attribute(h_1_d)
    np.testing.assert_allclose(scores(explanation), expected[0], atol=1e-3)
    np.testing.assert_allclose(list(explanation.variances.values()), variances[0], atol=1e-3)
    assert explanation.bald == pytest.approx(bald[0], abs=1e-3)
    assert explanation.concept == model.gpc.classes[expected[0].argmax()]
    assert sum(explanation.scores.values()) == pytest.approx(1)


def test_larger_and_smaller_clouds_are_embedded_as_the_mean_of_draws(explainer, registrations, monkeypatch):
    larger, smaller = registrations.cloud(0)[:100], registrations.cloud(0)[:40]
    seen, call = [], TrainedEncoder.__call__
    monkeypatch.setattr(TrainedEncoder, "__call__", lambda *given: seen.append(given[1]) or call(*given))
    assert explainer.embed(larger).shape == explainer.embed(smaller).shape == (1, 32)
    assert [tuple(clouds.shape) for clouds in seen] == [(2, 64, 3)] * 2
    assert len(np.unique(seen[0][0], axis=0)) == 64
    assert not np.array_equal(seen[0][0], seen[0][1])


def test_unit_and_place_of_the_target_change_no_score(explainer, pair):
    source, target = pair
    here = explainer.explain(source, target)
    in_mm = explainer.explain(1e3 * source, 1e3 * target, unit="mm")
    np.testing.assert_allclose(scores(in_mm), scores(here), atol=1e-6)
    np.testing.assert_allclose(in_mm.T_target_source[:3, 3], 1e3 * here.T_target_source[:3, 3], atol=1e-6)
    assert in_mm.inlier_rmse == pytest.approx(1e3 * here.inlier_rmse)
    shift = np.array([2.0, -1.0, 0.5])
    there = explainer.explain(source + shift, target + shift)
    np.testing.assert_allclose(scores(there), scores(here), atol=1e-6)
    np.testing.assert_allclose(
        transform(there.T_target_source, source + shift), transform(here.T_target_source, source) + shift, atol=1e-6
    )


def test_the_initial_pose_is_where_icp_starts(explainer, pair):
    source, target = pair
    T_source_seen = exp(np.array([[1.0, -2.0, 0.5, 0.3, 0.4, -1.0]]))[0]  # as from a camera elsewhere
    here = explainer.explain(source, target)
    seen = explainer.explain(transform(inverse(T_source_seen), source), target, T_source_seen)
    np.testing.assert_allclose(scores(seen), scores(here), atol=1e-6)
    np.testing.assert_allclose(seen.T_target_source, here.T_target_source @ T_source_seen, atol=1e-6)
    assert not here.notes


def test_more_points_than_in_the_training_are_left_out_and_said_so(explainer, pair):
    source, target = pair
    explanation = explainer.explain(np.tile(source, (3, 1)), target)
    assert explanation.notes == (f"source: 256 of {3 * len(source)} points, drawn at random",)
    again = explainer.explain(np.tile(source, (3, 1)), target)
    assert explanation.scores == again.scores


def test_rows_without_a_measurement_are_left_out_and_said_so(explainer, pair):
    source, target = pair
    here = explainer.explain(source, target)
    missing = np.r_[source, np.zeros((40, 3)), np.full((2, 3), np.nan)]
    explanation = explainer.explain(missing, np.r_[target, np.full((5, 3), np.inf)])
    assert explanation.notes[:2] == (
        f"source: 42 of {len(source) + 42} points were left out: they are (0, 0, 0) or NaN or infinite, as where depth "
        "is missing",
        f"target: 5 of {len(target) + 5} points were left out: they are NaN or infinite, as where depth is missing",
    )
    np.testing.assert_array_equal(explanation.T_target_source, here.T_target_source)
    assert len(explainer.explain(np.r_[source, np.zeros((1, 3))], target).notes) == 1  # that may be a point


def test_a_source_in_a_unit_of_its_own_gives_results_in_that_of_the_target(explainer, pair):
    source, target = pair
    in_mm = explainer.explain(1e3 * source, target, source_unit="mm")
    assert scores(in_mm) == pytest.approx(scores(explainer.explain(source, target)), abs=1e-6)
    assert in_mm.unit == "m"


def test_many_are_explained_as_one_by_one_and_a_fault_names_its_pair(explainer, pair):
    source, target = pair
    T_init = exp(np.array([[0.1, 0, 0, 0, 0, 0]]))[0]
    first, second = explainer.explain_many([(source, target), (source, target, T_init)])
    for many, one in (
        (first, explainer.explain(source, target)),
        (second, explainer.explain(source, target, T_init)),
    ):
        assert many.scores == one.scores
        np.testing.assert_array_equal(many.T_target_source, one.T_target_source)
    with pytest.raises(InputError, match="pair 1: source: has 10 points"):
        list(explainer.explain_many([(source, target), (source[:10], target)]))


FAR = "initial pose: puts the source .* diameters .* translation in m"
SPREAD = UncertaintySettings()


def moved(x):
    T = np.eye(4)
    T[0, 3] = x
    return T


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s, t: {"source_points": s[:10]}, "source: has 10 points; give 64"),
        (lambda s, t: {"target_points": t[:10]}, "target: has 10 points"),
        (lambda s, t: {"source_points": s * np.nan}, "source: all of its .* points are NaN or infinite"),
        (lambda s, t: {"source_points": s[:, :2]}, "source: has the shape .*, not \\(N, 3\\)"),
        (lambda s, t: {"source_points": s.T}, "source: has the shape .* transpose it"),
        (lambda s, t: {"target_points": "cloud.ply"}, "target: is a str, not a cloud of points"),
        (lambda s, t: {"source_points": 10 * s}, "source: is .* times as large as the target; give both"),
        (lambda s, t: {"source_points": s / 10}, "source: is 0.* times as large as the target"),
        (lambda s, t: {"unit": "mm"}, "target: its diameter is"),
        (lambda s, t: {"unit": "feet"}, "unit 'feet'"),
        (lambda s, t: {"source_unit": "feet"}, "unit 'feet'"),
        (lambda s, t: {"source_points": 1e3 * s}, "source: looks .* larger .*: pass source_unit='mm', unit='m'"),
        (lambda s, t: {"T_target_source_init": 2 * np.eye(4)}, "initial pose: the pose is not a rigid transform"),
        (lambda s, t: {"T_target_source_init": moved(1e16)}, "initial pose: the pose has a translation of 1e\\+16"),
        (lambda s, t: {"T_target_source_init": moved(1e15)}, FAR),
        (lambda s, t: {"T_target_source_init": moved(200.0)}, FAR),
        (lambda s, t: {"source_points": (s + 1e6).astype(np.float32)}, "source: at .* float32 has steps of"),
        (lambda s, t: {"target_points": (t + 1e6).astype(np.float32)}, "target: at .* subtract an offset"),
        (lambda s, t: {"source_points": s + 1e15}, "source: at .* float64 has steps of"),
        (lambda s, t: {"T_target_source_init": np.eye(3)}, r"initial pose: the pose has shape \(3, 3\)"),
        (lambda s, t: {"method": "icp"}, "registration method 'icp': unknown"),
        (lambda s, t: {"method": ""}, "registration method '': unknown"),
        (lambda s, t: {"uncertainty": SPREAD, "estimator": "gauss"}, "estimator 'gauss': unknown"),
        (lambda s, t: {"uncertainty": SPREAD, "estimator": "cello"}, "'cello': learns from registrations"),
    ],
)
def test_bad_input_is_one_line(explainer, pair, change, message):
    with pytest.raises(InputError, match=message):
        explainer.explain(**dict(zip(("source_points", "target_points"), pair, strict=True)) | change(*pair))


def test_the_package_offers_the_explainer_without_loading_it():
    code = "import sys, gpca; print('Explainer' in gpca.__all__, {'torch', 'numpy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "True set()\n"
    with pytest.raises(ImportError, match="Nothing"):
        from gpca import Nothing  # noqa: F401


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
    by_points = explainer.explain(source, target)
    assert by_points.method == "point_to_point"
    again = model.diagnoser.by_method("gicp").diagnose(own.source, own.target, expected)[0]
    assert explanation.diagnosis.start == pytest.approx(again.start) != pytest.approx(by_points.diagnosis.start)
    assert model.diagnoser.by_method("fpfh_ransac") is model.diagnoser is model.diagnoser.by_method(None)


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
    assert re.search("spread    pose uncertainty .*, by brossard\n", explanation.text())
    assert explanation.as_dict()["spread"]["estimator"] == "brossard"
    assert explanation.as_dict()["spread"]["starts"] is None
