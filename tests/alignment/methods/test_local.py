"""The local methods against Open3D's own functions, called here as its documentation does."""

import numpy as np
import open3d
import pytest

from gpca.alignment.methods import local
from gpca.alignment.methods.registry import make_method
from gpca.pairs.perturbation import CONCEPTS

from .pairs import perturbed

REGISTRATION = open3d.pipelines.registration
TO_POINTS, TO_PLANES = (
    REGISTRATION.TransformationEstimationPointToPoint,
    REGISTRATION.TransformationEstimationPointToPlane,
)
REFERENCES = {
    "point_to_point": (TO_POINTS, None),
    "point_to_point_open3d": (TO_POINTS, None),
    "point_to_plane": (TO_PLANES, None),
    "gicp": (REGISTRATION.TransformationEstimationForGeneralizedICP, None),
    "huber": (TO_PLANES, REGISTRATION.HuberLoss(0.05)),
    "cauchy": (TO_PLANES, REGISTRATION.CauchyLoss(0.05)),
    "geman_mcclure": (TO_PLANES, REGISTRATION.GMLoss(0.05**2)),
    "tukey": (TO_PLANES, REGISTRATION.TukeyLoss(0.05)),
}


def cloud(points, normals=None):
    result = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    if normals is not None:
        result.normals = open3d.utility.Vector3dVector(normals)
    return result


def by_open3d(pair, name):
    estimation, kernel = REFERENCES[name]
    align = REGISTRATION.registration_generalized_icp if name == "gicp" else REGISTRATION.registration_icp
    return align(
        cloud(pair.source),
        cloud(pair.target, None if estimation is TO_POINTS else pair.target_normals),
        0.1,
        np.eye(4),
        estimation(*([kernel] if kernel else [])),
        REGISTRATION.ICPConvergenceCriteria(max_iteration=50),
    )


@pytest.mark.parametrize("name", REFERENCES)
@pytest.mark.parametrize("concept", CONCEPTS)
@pytest.mark.parametrize("index", [0, 2])
def test_a_local_method_ends_where_open3d_ends(objects, name, concept, index):
    pair, _ = perturbed(objects, index, concept, seed=index)
    outcome, expected = make_method(name)(pair), by_open3d(pair, name)
    np.testing.assert_allclose(outcome.T_target_source, expected.transformation, rtol=0, atol=1e-6)
    assert outcome.fitness == pytest.approx(expected.fitness, abs=1e-12)
    assert outcome.inlier_rmse == pytest.approx(expected.inlier_rmse, abs=1e-6)
    assert np.abs(outcome.T_target_source - np.eye(4)).max() > 0.003  # it did move


def test_kernels_end_at_poses_of_their_own_unless_they_are_wide(objects, monkeypatch):
    pair, _ = perturbed(objects, 0, "noise")
    poses = [make_method(name)(pair).T_target_source for name in ("point_to_plane", *list(REFERENCES)[4:])]
    assert len(np.unique(np.round(poses, 4), axis=0)) == 5
    monkeypatch.setattr(local, "SCALE", 1e4)
    for name in ("huber", "geman_mcclure"):
        np.testing.assert_allclose(make_method(name)(pair).T_target_source, poses[0], atol=1e-6)
