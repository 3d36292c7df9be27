import numpy as np
import pytest
import trimesh

from gpca.objects.canonical import canonical_cloud
from gpca.objects.surface import Surface
from gpca.objects.symmetry import find_symmetries, read_symmetries

create = trimesh.creation


def symmetries(mesh):
    points, _, diameter = canonical_cloud(Surface("object", mesh.vertices, mesh.faces), "tests", 4096)
    return find_symmetries(points, diameter)


def test_a_brick_may_be_turned_over_but_not_by_a_quarter():
    found = symmetries(create.box((0.06, 0.09, 0.14)))
    assert set(found) == {"symmetries_discrete"}
    turns = [np.reshape(T, (4, 4)) for T in found["symmetries_discrete"]]
    assert sorted(np.diag(T).astype(int).tolist() for T in turns) == [[-1, -1, 1, 1], [-1, 1, -1, 1], [1, -1, -1, 1]]


def test_a_square_bar_may_be_turned_by_a_quarter_about_its_length_alone():
    turns = [np.reshape(T, (4, 4)) for T in symmetries(create.box((0.05, 0.05, 0.2)))["symmetries_discrete"]]
    assert len(turns) == 4
    assert [T[2, 2] for T in turns if T[0, 0] == 0] == [1.0]


@pytest.mark.parametrize("mesh", [create.cone(0.05, 0.13), create.cylinder(0.04, 0.12)], ids=["cone", "cylinder"])
def test_a_body_of_revolution_is_symmetric_about_its_axis(mesh):
    found = symmetries(mesh)
    assert found["symmetries_continuous"] == [{"axis": [0.0, 0.0, 1.0], "offset": [0.0, 0.0, 0.0]}]


def test_a_handle_takes_the_symmetry_away():
    handle = create.box((0.05, 0.015, 0.07))
    handle.apply_translation((0.06, 0, 0))
    found = symmetries(trimesh.util.concatenate([create.cylinder(0.04, 0.1), handle]))
    (over,) = found.pop("symmetries_discrete")  # turned over about the handle
    assert np.diag(np.reshape(over, (4, 4))).tolist() == [1, -1, -1, 1]
    assert found == {}


def test_what_the_file_lists_counts_for_all_of_its_objects():
    info = {1: {"diameter": 1.0}, 2: {"diameter": 1.0, "symmetries_discrete": [[1]]}}
    assert read_symmetries(info, 1) == {}
    assert read_symmetries(info, 2) == {"symmetries_discrete": [[1]]}
    assert read_symmetries({1: {"diameter": 1.0}}, 1) is None
