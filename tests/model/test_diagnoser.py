"""What is said of a pair of clouds: by its descriptors, the same whatever is around it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.rigid import exp, transform
from gpca.causes.descriptors import WIDTHS
from gpca.model.diagnoser import REENACTED, REMEDIED, Diagnoser
from gpca.model.diagnosis import Diagnosis
from gpca.model.file import FEATURE_COUNTS
from gpca.reenactment.features import FEATURES
from gpca.reenactment.settings import ReenactmentSettings

SMALL_MOTION = exp(np.array([[0.05, -0.02, 0.03, 0.01, 0.02, -0.01]]))[0]


@pytest.fixture(scope="module")
def cloud():
    points = np.random.default_rng(3).normal(size=(400, 3))
    return points * np.array([0.5, 0.3, 0.2]) / np.sqrt(np.square(points).sum(axis=1, keepdims=True))


def test_descriptors_do_not_depend_on_where_icp_was_started_but_for_the_motion(diagnoser, cloud):
    older = replace(diagnoser, points=1024, reads=REMEDIED)
    here, _ = older.measured(cloud, cloud[::2], np.eye(4))
    assert here.shape == (sum(WIDTHS.values()),)
    moved, _ = older.measured(transform(np.linalg.inv(SMALL_MOTION), cloud), cloud[::2], SMALL_MOTION)
    distances = WIDTHS["distances"]
    np.testing.assert_allclose(moved[:distances], here[:distances], atol=5e-3)
    rotation = distances + WIDTHS["planes"]
    assert moved[rotation] - here[rotation] == pytest.approx(np.sqrt(0.05**2 + 0.02**2 + 0.03**2), abs=0.01)


def test_what_is_read_is_what_the_reenactment_says(diagnoser, cloud):
    features, said = diagnoser.measured(cloud, cloud[::2], np.eye(4))
    assert features.shape == (FEATURE_COUNTS[REENACTED],)
    assert said.error == pytest.approx(np.exp(features[FEATURES.index("mean_error_7")]))
    assert said.noise == features[FEATURES.index("first_noise")]
    assert said.poses[0].probability == features[FEATURES.index("first_weight")]


def test_the_same_clouds_give_the_same_diagnosis_also_after_the_way_to_a_file(diagnoser, cloud):
    first = diagnoser.diagnose(cloud, cloud[::2], np.eye(4))
    again = Diagnoser.from_state(diagnoser.state()).diagnose(cloud, cloud[::2], np.eye(4))
    assert json.dumps(first.as_dict()) == json.dumps(again.as_dict())
    assert 0 <= first.failure <= 1
    assert set(first.causes) == set(first.variances) == {"noise", "pose", "overlap"}
    assert 1e-3 <= first.expected_error <= 0.5
    assert first.guarantee.states


def test_a_quick_diagnosis_reenacts_less_and_promises_nothing(diagnoser, cloud):
    large = replace(diagnoser, points=512, reenactment=ReenactmentSettings(hypotheses=4))
    quick = large.quick()
    assert (quick.points, quick.reenactment.hypotheses) == (384, 2)
    assert diagnoser.quick().points == diagnoser.points < 384
    said = quick.diagnose(cloud, cloud[::2], np.eye(4))
    assert said.guarantee is None
    assert 1 <= len(said.reenacted.poses) <= 2


def test_one_of_a_model_from_before_version_4_reads_what_it_learned(diagnoser, cloud):
    state = {**diagnoser.state(), "descriptors": {"starts": 1, "restarts": 2, "icp_points": 64}}
    for name in ("reads", "moved", "reenactment", "guarantee", "held_out"):
        del state[name]
    older = Diagnoser.from_state(state)
    features, said = older.measured(cloud, cloud[::2], np.eye(4))
    assert features.shape == (sum(WIDTHS.values()),)
    assert said is None
    assert older.guarantee is None


CAUSES = {"noise": 0.2, "pose": 0.9, "overlap": 0.6}
FAILED = Diagnosis(0.7, 0.5, CAUSES, dict.fromkeys(CAUSES, 0.0), bald=0.0, expected_error=0.1)


def test_below_the_threshold_nothing_is_named_and_above_it_what_is_likely_and_at_least_one():
    assert FAILED.state == "failed"
    assert FAILED.named == ("pose", "overlap")
    unlikely = replace(FAILED, causes={"noise": 0.2, "pose": 0.1, "overlap": 0.3})
    assert unlikely.named == ("overlap",)
    fine = replace(FAILED, failure=0.49)
    assert (fine.state, fine.named) == ("nominal", ())
    assert fine.as_dict()["state"] == "nominal"
