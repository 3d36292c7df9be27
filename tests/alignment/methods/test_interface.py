import numpy as np
import pytest
from scipy.spatial import cKDTree

from gpca.alignment.methods.interface import FailedRegistration, Outcome, Pair
from gpca.errors import InputError
from gpca.rigid import transform

from .pairs import clouds, perturbed

CLOUD = np.random.default_rng(0).uniform(size=(20, 3))


@pytest.mark.parametrize(
    ("faulty", "words"),
    [
        ({"source": CLOUD[:2]}, "source cloud.*at least 3 finite points"),
        ({"target": np.where(CLOUD > 0.9, np.nan, CLOUD)}, "target cloud.*at least 3 finite points"),
        ({"target": CLOUD[:, :2]}, r"target cloud: has shape \(20, 2\)"),
        ({"source_normals": CLOUD[:5]}, "source normals.*one finite vector per point"),
        ({"target_normals": np.full((20, 3), np.inf)}, "target normals.*one finite vector per point"),
        ({"T_target_source_init": np.diag([1.0, 1.0, -1.0, 1.0])}, "initial pose.*mirrored"),
        ({"T_target_source_init": np.eye(3)}, "initial pose.*has shape"),
    ],
)
def test_a_faulty_pair_is_named(faulty, words):
    with pytest.raises(InputError, match=words):
        Pair(**{"source": CLOUD, "target": CLOUD} | faulty)


def test_normals_are_estimated_where_there_are_none(objects):
    source, target, _, target_normals = clouds(objects, 2)
    pair = Pair(source, target, target_normals=target_normals).with_normals()
    assert pair.target_normals is target_normals
    np.testing.assert_allclose(np.linalg.norm(pair.normals("source"), axis=1), 1)
    with pytest.raises(FailedRegistration, match="the target has no normals"):
        Pair(source, target).normals("target")


def test_a_pose_is_measured_over_all_points_of_the_source_and_may_be_a_start(objects):
    pair, T_true = perturbed(objects, 0, "noise")
    outcome = Outcome.at(pair, T_true, 0.03)
    distance = cKDTree(pair.target).query(transform(T_true, pair.source))[0]
    assert 0.2 < outcome.fitness < 1
    assert outcome.fitness == (distance < 0.03).mean()
    assert outcome.inlier_rmse == pytest.approx(np.sqrt(np.square(distance[distance < 0.03]).mean()))
    assert outcome.converged
    assert not Outcome.at(pair, T_true, 0.03, "some reason").converged

    started = pair.started_at(T_true)
    assert started.T_target_source_init is T_true
    assert started.source is pair.source and started.source_normals is pair.source_normals
    far = T_true.copy()
    far[0, 3] += 5
    with pytest.raises(FailedRegistration, match=r"within 0\.1 diameters"):
        Outcome.at(pair, far, 0.1)
