import numpy as np
import pytest

from gpca.alignment.methods.interface import FailedRegistration
from gpca.alignment.methods.registry import make_method
from gpca.alignment.methods.stages import Stages, run_stages
from gpca.pairs.perturbation import CONCEPTS

from .pairs import perturbed, small_motion


@pytest.mark.parametrize("metric", ["point_to_point", "point_to_plane"])
@pytest.mark.parametrize("concept", CONCEPTS)
@pytest.mark.parametrize("index", [0, 2])
def test_with_everything_switched_off_it_is_plain_icp(objects, metric, concept, index):
    pair, _ = perturbed(objects, index, concept)
    T, _, _ = run_stages(pair, Stages(metric=metric, distance=0.1), 50)
    np.testing.assert_allclose(T, make_method(metric)(pair).T_target_source, rtol=0, atol=1e-6)


K = 0.05
WEIGHTS = {  # of a residual r, as the literature has them
    "huber": lambda r: np.where(r <= K, 1.0, K / np.maximum(r, 1e-300)),
    "cauchy": lambda r: 1 / (1 + (r / K) ** 2),
    "geman_mcclure": lambda r: 1 / (1 + (r / K) ** 2) ** 2,
    "tukey": lambda r: np.where(r <= K, (1 - np.minimum(r / K, 1) ** 2) ** 2, 0.0),
}


@pytest.mark.parametrize("kernel", WEIGHTS)
def test_weights_of_a_robust_kernel_give_open3ds_pose(objects, kernel):
    pair, _ = perturbed(objects, 0, "noise")

    def weigh(matches):
        offsets = pair.target[matches.rows] - matches.source
        return WEIGHTS[kernel](np.abs((offsets * pair.target_normals[matches.rows]).sum(axis=1)))

    T, _, _ = run_stages(pair, Stages(metric="point_to_plane", weigh=weigh, distance=0.1), 50)
    np.testing.assert_allclose(T, make_method(kernel)(pair).T_target_source, rtol=0, atol=1e-6)


def test_few_matches_and_no_weight_are_failures(objects):
    pair, _ = small_motion(objects)
    with pytest.raises(FailedRegistration, match="fewer than 3 correspondences"):
        run_stages(pair, Stages(reject=lambda matches: matches.kept(np.arange(2))), 50)
    with pytest.raises(FailedRegistration, match="no correspondence has any weight"):
        run_stages(pair, Stages(weigh=lambda matches: np.zeros(len(matches.distance))), 50)


def test_normals_of_the_source_turn_with_it(objects):
    pair, T_true = small_motion(objects)
    matches = Stages().match(pair, T_true)
    assert np.median(matches.cosines()) == pytest.approx(1, abs=1e-6)  # most neighbors lie on the same face
    assert np.median(Stages().match(pair, np.eye(4)).cosines()) < 0.999


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_search_that_knows_the_matches_before_finds_the_same(objects, share):
    pair, T_true = perturbed(objects, 0, "overlap")
    stages = Stages(share=share)
    for T in (np.eye(4), T_true):
        before = stages.match(pair, T)
        for T_next in (T, stages.step(before) @ T, np.linalg.inv(T_true)):
            bounded, free = stages.match(pair, T_next, before), stages.match(pair, T_next)
            for name in ("source_rows", "rows", "distance"):
                np.testing.assert_array_equal(getattr(bounded, name), getattr(free, name))


def test_a_share_counts_all_points_of_the_source(objects):
    pair, T_true = small_motion(objects)
    rows = np.arange(0, len(pair.source), 2)
    matches = Stages(rows=rows, share=0.5).match(pair, T_true)
    least = np.sort(pair.target_tree.query(matches.pair.source @ T_true[:3, :3].T + T_true[:3, 3])[0][rows])
    np.testing.assert_allclose(np.sort(matches.distance), least[: round(len(rows) / 2)])
    distance = float(np.median(matches.distance))
    assert 0 < len(Stages(share=0.5, distance=distance).match(pair, T_true).distance) <= len(pair.source) / 2
