"""What is said of a pair of clouds: by its descriptors, the same whatever is around it."""

from dataclasses import replace

import numpy as np
import pytest

from gpca.alignment.rigid import transform
from gpca.alignment.twist import exp
from gpca.features.dataset import WIDTHS
from gpca.model.diagnoser import Diagnoser, Diagnosis

SMALL_MOTION = exp(np.array([[0.05, -0.02, 0.03, 0.01, 0.02, -0.01]]))[0]


@pytest.fixture(scope="module")
def cloud():
    points = np.random.default_rng(3).normal(size=(400, 3))
    return points * np.array([0.5, 0.3, 0.2]) / np.sqrt(np.square(points).sum(axis=1, keepdims=True))


def test_descriptors_do_not_depend_on_where_icp_was_started_but_for_the_motion(diagnoser, cloud):
    diagnoser = replace(diagnoser, points=1024)
    here = diagnoser.features(cloud, cloud[::2], np.eye(4))
    assert here.shape == (sum(WIDTHS.values()),)
    moved = diagnoser.features(transform(np.linalg.inv(SMALL_MOTION), cloud), cloud[::2], SMALL_MOTION)
    distances = WIDTHS["distances"]
    np.testing.assert_allclose(moved[:distances], here[:distances], atol=5e-3)
    rotation = distances + WIDTHS["planes"]
    assert moved[rotation] - here[rotation] == pytest.approx(np.sqrt(0.05**2 + 0.02**2 + 0.03**2), abs=0.01)


def test_the_same_clouds_give_the_same_diagnosis_also_after_the_way_to_a_file(diagnoser, cloud):
    first = diagnoser.diagnose(cloud, cloud[::2], np.eye(4))
    assert first == Diagnoser.from_state(diagnoser.state()).diagnose(cloud, cloud[::2], np.eye(4))
    assert 0 <= first.failure <= 1
    assert set(first.causes) == set(first.variances) == {"noise", "pose", "overlap"}
    assert 1e-3 <= first.expected_error <= 0.5


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
