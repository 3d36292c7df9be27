import numpy as np
import pytest
import trimesh

from gpca.errors import InputError
from gpca.frames.rgbd_scene import stable_poses
from gpca.objects.surface import Surface


def surface(mesh, name="thing"):
    return Surface(name, np.asarray(mesh.vertices), np.asarray(mesh.faces))


def test_a_brick_rests_most_often_on_its_largest_side():
    poses_n, probabilities_n = stable_poses(surface(trimesh.creation.box((0.3, 0.2, 0.1))))
    assert len(poses_n) == 6
    assert probabilities_n.sum() == pytest.approx(1)
    height_n = np.abs(poses_n[:, 2, :3] @ [0.3, 0.2, 0.1])
    assert height_n[np.argmax(probabilities_n)] == pytest.approx(0.1)


def test_an_open_scan_with_its_centre_of_mass_outside_still_rests():
    """Of a bowl without a lid whose integral ends outside of it: trimesh alone would look for a centre without end."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    ball.apply_translation((0, 0, 1.0))
    bowl = ball.slice_plane((0, 0, 1.0), (0, 0, -1))
    assert not bowl.is_watertight
    assert bowl.center_mass[2] < bowl.vertices[:, 2].min()
    poses_n, probabilities_n = stable_poses(surface(bowl))
    assert probabilities_n.sum() == pytest.approx(1)
    for pose in poses_n:
        assert trimesh.transform_points(bowl.vertices, pose)[:, 2].min() == pytest.approx(0, abs=1e-9)


def test_a_flat_object_is_refused():
    square = trimesh.Trimesh([(0, 0, 0), (0.1, 0, 0), (0.1, 0.1, 0), (0, 0.1, 0)], [(0, 1, 2), (0, 2, 3)])
    with pytest.raises(InputError, match="object 'card': is flat and cannot be stood on a table; leave it out"):
        stable_poses(surface(square, "card"))
