"""What a re-enactment says to a user: other poses in plain words, and what each cause does."""

import json
from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest

from gpca.causes.truth import ALL, shapley_values
from gpca.model.diagnosis import Reenacted, axis_in_words, outside, plain
from gpca.objects.canonical import CanonicalFrame
from gpca.reenactment.enactment import Enactment
from gpca.reenactment.hypotheses import Hypothesis
from gpca.reenactment.surface import ModelSurface
from gpca.rigid import exp, transform

ERRORS = np.arange(8) / 100
T_RESULT = exp(np.array([[0.2, -0.1, 0.3, 0.05, 0.02, -0.04]]))[0]


def moved(turn_deg=(0, 0, 0), shift=(0, 0, 0)):
    """The result, turned and shifted in the target's frame."""
    return exp(np.array([[*np.deg2rad(turn_deg), 0, 0, 0]]))[0] @ exp(np.array([[0, 0, 0, *shift]]))[0] @ T_RESULT


def enacted(T):
    """An enactment of this hypothesis, with noise of 2 %, a quarter outliers and half of the surface missing."""
    hypothesis = Hypothesis(T, np.ones(4), 0.0, 0.01, 1.0, 0.0, np.zeros(4))
    candidate = SimpleNamespace(severity={"noise": 0.02, "outliers": 0.25, "crop": 0.5})
    return Enactment(hypothesis, candidate, ERRORS, np.zeros(8), np.zeros, 0.0)


def said(points, *poses):
    weights = np.arange(len(poses), 0, -1) / (len(poses) * (len(poses) + 1) / 2)
    return Reenacted.of([enacted(T) for T in poses], weights, T_RESULT, ModelSurface(points))


@pytest.fixture(scope="module")
def drill(four):
    index = four.row("035_power_drill")
    return four.points(index)[:600].astype(float) / four.diameters_m[index]


@pytest.fixture(scope="module")
def cylinder():
    """Points of a cylinder around the z axis, of diameter 1, and of its two ends."""
    random = np.random.default_rng(0)
    turn, height, out = random.uniform(0, 2 * np.pi, 2000), random.uniform(-0.4, 0.4, 2000), np.full(2000, 0.3)
    out[:600], height[:600] = 0.3 * np.sqrt(random.random(600)), np.where(np.arange(600) % 2, 0.4, -0.4)
    return np.column_stack([out * np.cos(turn), out * np.sin(turn), height])


def test_poses_are_named_by_where_they_lie_from_the_result(drill):
    found = said(drill, T_RESULT, moved((0, 0, 90)), moved(shift=(0.1, 0, 0)), moved((30, 30, 30), (0, 0.05, 0)))
    assert [pose.registered for pose in found.poses] == [True, False, False, False]
    assert [round(pose.turn_deg) for pose in found.poses] == [0, 90, 0, 52]
    assert found.poses[3].shift == pytest.approx(0.05)
    assert sum(pose.probability for pose in found.poses) == pytest.approx(1)
    lines = outside(found, CanonicalFrame(np.zeros(3), 200.0), np.eye(4)).lines("mm")[1:]
    assert lines[0].startswith("pose 1    probability 0.40: the result, within ")
    assert lines[1].startswith("pose 2    probability 0.30: 90° about the target's z axis and ")
    assert lines[2] == "pose 3    probability 0.20: 20 mm away from the result"
    assert lines[3].endswith("52° about the target's axis (0.58, 0.58, 0.58) and 10 mm away from the result")
    # Where the likeliest pose is another, the text says so.
    [line] = said(drill, moved((180, 0, 0))).lines("m")[1:]
    assert line.startswith("pose 1    probability 1.00: 180° about the target's x axis and ")


def test_a_turn_that_leaves_a_symmetric_object_as_it_is_is_none(cylinder):
    same, along, over = said(cylinder, moved((0, 0, 37)), moved((0, 0, 73), (0, 0, 0.1)), moved((40, 0, 0))).poses
    assert same.registered
    assert same.turn_deg == pytest.approx(0, abs=1e-3)
    assert not along.registered
    assert along.turn_deg == pytest.approx(0, abs=1e-3)
    assert along.words("m") == "0.1 m away from the result"
    assert over.turn_deg == pytest.approx(40)
    upside_down = said(cylinder, moved((180, 0, 0))).poses[0]
    assert upside_down.registered


def test_effects_add_up_and_lengths_are_in_the_users_unit(drill):
    found = said(drill, T_RESULT, moved((0, 90, 0)))
    assert found.error == pytest.approx(ERRORS[ALL])
    np.testing.assert_allclose(list(found.effects.values()), shapley_values(ERRORS[None])[0])
    assert sum(found.effects.values()) == pytest.approx(ERRORS[ALL] - ERRORS[0])
    assert (found.noise, found.outliers, found.missing) == (0.02, 0.25, 0.5)
    converted = outside(found, CanonicalFrame(np.array([1.0, 2.0, 3.0]), 10.0), np.eye(4))
    assert converted.error == pytest.approx(0.7)
    assert converted.noise == pytest.approx(0.2)
    assert converted.effects["pose"] == pytest.approx(10 * found.effects["pose"])
    effects = "effects   noise 0.1, pose 0.2, overlap 0.4 mm (Shapley shares of the re-enacted error, 0.7 mm)"
    assert converted.effects_line("mm") == effects
    assert converted.lines("mm")[0] == "observed  noise σ 0.2 mm per axis, 25% outliers; 50% of the target unseen"
    assert replace(converted, noise=0.04).lines("mm")[0].startswith("observed  noise σ below 0.04 mm per axis, ")


def test_a_pose_takes_the_users_source_to_the_users_target(drill):
    frame = CanonicalFrame(np.array([1.0, 2.0, 3.0]), 10.0)
    T_init = exp(np.array([[0.1, 0.2, 0.3, 5.0, 6.0, 7.0]]))[0]
    T = moved((0, 90, 0))
    converted = outside(said(drill, T), frame, T_init)
    source = np.random.default_rng(1).normal(size=(5, 3))
    expected = transform(T, frame.coordinates(transform(T_init, source)))
    np.testing.assert_allclose(frame.coordinates(transform(converted.poses[0].T_target_source, source)), expected)
    values = json.loads(json.dumps(asdict(converted, dict_factory=plain)))
    assert np.array(values["poses"][0]["T_target_source"]).shape == (4, 4)
    assert set(values) == {
        "error",
        "effects",
        "noise",
        "noise_floor",
        "outliers",
        "missing",
        "poses",
        "scale",
        "undetermined",
    }


def test_an_axis_has_a_name_where_it_is_nearly_one_of_the_targets():
    assert axis_in_words((0.1, -0.99, 0.05)) == "the target's y axis"
    assert axis_in_words((0.6, 0.8, 0.0)) == "the target's axis (0.60, 0.80, 0.00)"
