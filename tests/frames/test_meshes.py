import numpy as np
import pytest
import trimesh

from gpca.errors import InputError
from gpca.frames.dataset import datasets_of, simplified
from gpca.objects.surface import Surface


def test_a_scan_is_simplified_and_keeps_its_size():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    simple = simplified(Surface("ball", ball.vertices, ball.faces), most_faces=200)
    assert len(simple.triangles) == 200
    assert np.linalg.norm(simple.vertices_m, axis=1) == pytest.approx(0.05, rel=0.05)
    assert simplified(Surface("ball", ball.vertices, ball.faces)).faces is ball.faces


def test_a_camera_sees_no_cloud_of_points():
    with pytest.raises(InputError, match="object 'cup': is a point cloud, but the virtual camera needs a mesh"):
        simplified(Surface("cup", np.zeros((70, 3)), None))


def test_of_rendered_scenes_every_frame_is_read(scenes, tmp_path):
    (rendered,) = datasets_of(None, None, tmp_path, scenes).values()
    assert rendered.most_frames is None
    assert len(rendered.frames()) == 6
