"""What an explanation says of free directions and of the scale."""

import json
from html import unescape

import numpy as np
import pytest

from gpca import Explainer, explain_scans
from gpca.model.diagnosis import RESCALE
from gpca.model.location import SHIPPED
from gpca.model.undetermined import OUT_OF_PLANE
from gpca.rigid import exp, transform

TURN = "the pose is free to turn about the target's z axis"


def vase(count, seed):
    from benchmarks.undetermined import vase

    return 0.2 * vase(count, np.random.default_rng(seed))[0]


@pytest.fixture(scope="module")
def shipped():
    return Explainer.load(SHIPPED)  # few points, as of a tiny model, hold any pose


def test_a_free_direction_stands_in_the_state_of_a_right_result(shipped):
    said = shipped.explain(vase(1000, 100), vase(1500, 101), exp(np.array([[0.02, 0, 0, 0.001, 0, 0]]))[0])
    words = json.loads(json.dumps(said.as_dict()))["diagnosis"]
    assert words["caveat"] == TURN
    (turn,) = words["reenacted"]["undetermined"]["directions"]
    assert (turn["motion"], round(abs(turn["axis"][2]), 1)) == ("turn", 1.0)
    assert np.array(words["reenacted"]["undetermined"]["covariance"]).shape == (6, 6)
    if words["state"] == "nominal":
        assert f"nominal: nothing is wrong, but {TURN}" in said.text()
    assert "free      turn about the target's z axis ± " in said.text()
    assert TURN[1:] in unescape(said.html())


@pytest.mark.parametrize("size", [1.3, 0.7])
def test_a_wrong_scale_is_a_cause_and_the_advice_is_to_rescale(shipped, four, size):
    points = np.random.default_rng(0).permutation(four.points(four.row("035_power_drill")).astype(float))
    source, target, T_right = points[:1000], points[1000:2500], np.eye(4)
    center = source.mean(axis=0)
    said = shipped.explain(center + size * (source - center), target, T_right)
    assert said.diagnosis.reenacted.scale.factor == pytest.approx(size, rel=0.05)
    assert (said.diagnosis.state, said.diagnosis.named, said.action) == ("failed", ("scale",), RESCALE)
    assert said.diagnosis.reenacted.scale.words in said.reason
    assert said.diagnosis.reenacted.scale.words in said.text()
    assert "failed: scale" in said.html()


def test_a_wrong_scale_is_a_cause_between_scans():
    source, target = (10 * vase(3000, seed) for seed in (102, 103))
    said = explain_scans(1.3 * source, target)
    assert (said.state, said.causes, said.action) == ("failed", ("scale",), RESCALE)
    assert said.reenacted.scale.factor == pytest.approx(1.3, rel=0.05)
    assert explain_scans(source, target).reenacted.scale.factor == 1


def test_flat_scans_are_not_measured_out_of_their_plane():
    from benchmarks.undetermined import flat_room

    source, target = (10 * flat_room(800, np.random.default_rng(seed))[0] for seed in (100, 101))
    said = explain_scans(transform(exp(np.array([[0, 0, 0.03, 0.1, 0, 0]]))[0], source), target)
    assert said.state == "nominal"
    assert f"state     nominal, but {OUT_OF_PLANE}" in said.text()
    assert said.reenacted.undetermined.flat


def test_a_wrong_scale_is_no_repair_and_no_promise(shipped, four):
    points = np.random.default_rng(0).permutation(four.points(four.row("035_power_drill")).astype(float))
    source, target = points[:1000], points[1000:2500]
    large = source.mean(axis=0) + 1.15 * (source - source.mean(axis=0))
    repair = shipped.repair(large, target, np.eye(4), register=False)
    assert (repair.verdict, repair.status, repair.wrong) == ("unknown", 3, None)
    assert "1.15 times too large" in repair.text() and "multiply its points by 0.8" in repair.text()
    diagnosis = shipped.judge(large, target, np.eye(4)).diagnosis
    assert diagnosis.guarantee is None and "1.15 times too large" in diagnosis.caveat
    assert shipped.repair(source, target, np.eye(4), register=False).verdict == "good"
