import numpy as np
import pytest
import trimesh

from gpca.errors import InputError
from gpca.objects.surface import Surface
from gpca.pairs.perturbation import CONCEPTS
from gpca.recovery.virtual_tables import register_situations, simplified

from .conftest import LOOP


def test_the_classifier_learns_from_all_causes(situations):
    registrations = register_situations(situations, 6, 3, LOOP)
    assert registrations.concept.tolist() == list(CONCEPTS) * 3
    assert registrations.split.tolist() == ["train"] * 6 + ["test"] * 3


def test_a_scan_is_simplified_and_keeps_its_size():
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    simple = simplified(Surface("ball", ball.vertices, ball.faces), most_faces=200)
    assert len(simple.triangles) == 200
    assert np.linalg.norm(simple.vertices_m, axis=1) == pytest.approx(0.05, rel=0.05)
    assert simplified(Surface("ball", ball.vertices, ball.faces)).faces is ball.faces


def test_a_cloud_of_points_stands_on_no_table():
    with pytest.raises(InputError, match=r"recovery\.objects: object 'cup' is a point cloud"):
        simplified(Surface("cup", np.zeros((70, 3)), None))
