"""Every entry of the package is found by its name, and does what its kind has to do."""

import numpy as np

from gpca.active_learning.acquisition import Pool, select
from gpca.alignment.methods.interface import Pair
from gpca.alignment.methods.registry import make_method
from gpca.causes.policy import RecoveryPolicy
from gpca.encoders.registry import make_encoder
from gpca.explainers.registry import CAUSES, CONCEPTS, explainers
from gpca.objects.source import resolve, surfaces
from gpca.recovery.policies import Case, Means, policy_entry
from gpca.uncertainty.estimators.interface import RegisteredPair
from gpca.uncertainty.estimators.registry import make_estimator

ACTIONS = ("denoise", "reinitialize", "new_view")


def clouds():
    """A box's surface, twice and moved: source (200, 3) and target (300, 3)."""
    random = np.random.default_rng(0)
    points = random.uniform(-0.5, 0.5, (500, 3))
    points[np.arange(500), random.integers(3, size=500)] = 0.5
    return points[:200] + 0.02, points[200:]


def test_explainers():
    for kind in (CONCEPTS, CAUSES):
        assert explainers(kind)["my_nearest_quality"].title == "Nearest quality (mine)"


def test_a_method():
    source, target = clouds()
    outcome = make_method("my_centers")(Pair(source, target))
    np.testing.assert_allclose(outcome.T_target_source[:3, 3], target.mean(axis=0) - source.mean(axis=0))


def test_an_estimator():
    pair = Pair(*clouds()).with_normals()
    registered = RegisteredPair(pair, make_method("point_to_point")(pair), "point_to_point", np.full(6, 0.03))
    covariance_6_6 = make_estimator("my_residuals")(registered).covariance_6_6
    assert (np.diag(covariance_6_6) > 0).all()


def test_an_encoder():
    import torch

    assert make_encoder("my_pointwise", {"width": 8})(torch.zeros(2, 16, 3)).shape == (2, 8)


def test_a_strategy():
    scores_N_2 = np.array([[0.9, 0.1], [0.5, 0.5], [0.7, 0.3]])
    pool = Pool(np.zeros((3, 1)), scores_N_2, np.zeros(3), np.zeros((1, 1)), np.zeros(3))
    assert select("my_least_confident", pool, 2, np.random.default_rng(0)).tolist() == [1, 2]


def test_a_policy():
    case = Case(("new_view",), None, None, None, None, "", np.random.default_rng(0))
    decision = policy_entry("my_last_first", ACTIONS).decide(case, Means(RecoveryPolicy(), ACTIONS))
    assert decision.action == "reinitialize"


def test_a_kind_of_source(tmp_path):
    (tmp_path / "boxes").mkdir()
    (tmp_path / "boxes/boxes.txt").write_text("0.1 0.2 0.3\n")
    entry = resolve({"title": "Boxes", "kind": "my_boxes", "location": "boxes"}, str(tmp_path))
    [box] = surfaces(entry, tmp_path)
    assert box.vertices_m.max() == 0.15
