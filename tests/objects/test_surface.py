"""Clouds that a caller hands over."""

from types import SimpleNamespace

import numpy as np
import pytest

from gpca.errors import InputError
from gpca.objects.surface import as_points
from gpca.process.environment import open3d_cloud, require_open3d

POINTS = np.random.default_rng(0).normal(size=(5, 3))


def test_arrays_lists_tensors_and_clouds_of_open3d_give_their_points():
    import torch

    o3d = require_open3d()
    tensors = o3d.t.geometry.PointCloud(o3d.core.Tensor(POINTS.astype(np.float32)))
    clouds = (POINTS, POINTS.tolist(), torch.tensor(POINTS), open3d_cloud(POINTS), tensors, tensors.point.positions)
    for cloud in clouds:
        points = as_points(cloud, "source")
        assert points.dtype == np.float64
        np.testing.assert_allclose(points, POINTS, atol=1e-6)


@pytest.mark.parametrize(
    ("cloud", "message"),
    [
        (None, r"source: has the shape \(\), not \(N, 3\); give an \(N, 3\) array or a point cloud of Open3D"),
        ("scan.ply", "source: is a str, not a cloud of points"),
        ([[1, 2, 3], [4, 5]], "source: is a list, not a cloud of points"),
        (POINTS.T, r"source: has the shape \(3, 5\), not \(N, 3\); transpose it"),
        (SimpleNamespace(vertices=POINTS), "source: is a mesh .*; sample points on it first"),
        (SimpleNamespace(point={}), "source: is a SimpleNamespace without positions"),
    ],
)
def test_anything_else_is_one_line_and_no_type_error(cloud, message):
    with pytest.raises(InputError, match=message):
        as_points(cloud, "source")
