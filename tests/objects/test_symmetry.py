import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from gpca.objects.bop import angle_up_to_symmetry, find_symmetries, read_symmetries, symmetric_turn
from gpca.objects.canonical import canonical_cloud
from gpca.objects.surface import Surface

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


def turn(axis, angle_deg):
    return Rotation.from_rotvec(np.deg2rad(angle_deg) * np.asarray(axis, float)).as_matrix()


def discrete(*turns):
    """As BOP writes them, row by row."""
    return {"symmetries_discrete": [np.pad(R, (0, 1)).ravel().tolist() for R in turns]}


def test_an_angle_without_symmetries_is_that_of_the_rotation():
    assert angle_up_to_symmetry(turn([0, 0.6, 0.8], 70), {}) == pytest.approx(np.deg2rad(70))
    assert angle_up_to_symmetry(np.eye(3), {}) == pytest.approx(0, abs=1e-7)


def test_an_angle_is_counted_from_the_nearest_turn_that_changes_nothing():
    square_bar = discrete(turn([0, 0, 1], 90), turn([1, 0, 0], 180))
    for angle, expected in ((80, 10), (-80, 10), (130, 40), (45, 45)):  # three quarters too, which no list has
        assert angle_up_to_symmetry(turn([0, 0, 1], angle), square_bar) == pytest.approx(np.deg2rad(expected))
    over_a_diagonal = turn(np.array([1, 1, 0]) / 2**0.5, 180)  # the two after each other
    assert angle_up_to_symmetry(over_a_diagonal, square_bar) == pytest.approx(0, abs=1e-6)
    assert angle_up_to_symmetry(turn([1, 0, 0], 90), square_bar) == pytest.approx(np.pi / 2)


def test_turns_about_an_axis_of_revolution_do_not_count():
    cone = {"symmetries_continuous": [{"axis": [0.0, 0.0, 1.0], "offset": [0.0, 0.0, 0.0]}]}
    tilted = turn([1, 0, 0], 25)
    angles = [angle_up_to_symmetry(tilted @ turn([0, 0, 1], angle), cone) for angle in (0, 77, 180)]
    np.testing.assert_allclose(angles, np.deg2rad(25))
    cylinder = cone | discrete(turn([1, 0, 0], 180))
    assert angle_up_to_symmetry(turn([0, 1, 0], 170), cone) == pytest.approx(np.deg2rad(170))
    assert angle_up_to_symmetry(turn([0, 1, 0], 170), cylinder) == pytest.approx(np.deg2rad(10))


def test_the_closed_form_is_the_least_over_all_turns_about_the_axis():
    axis = np.array([2.0, -1.0, 2.0]) / 3
    found = {"symmetries_continuous": [{"axis": axis.tolist()}]}
    random = np.random.default_rng(0)
    for R in Rotation.random(5, rng=random):
        least = min((R * Rotation.from_rotvec(angle * axis)).magnitude() for angle in np.linspace(0, 2 * np.pi, 2001))
        assert angle_up_to_symmetry(R.as_matrix(), found) == pytest.approx(least, abs=1e-3)


def test_a_ball_has_no_angle():
    ball = {"symmetries_continuous": [{"axis": [1.0, 0.0, 0.0]}, {"axis": [0.0, 1.0, 0.0]}]}
    assert angle_up_to_symmetry(turn([0, 0, 1], 50), ball) == 0


def test_the_turn_that_leaves_the_least_angle_is_a_symmetry():
    cone = {"symmetries_continuous": [{"axis": [0.0, 0.0, 1.0], "offset": [0.0, 0.0, 0.0]}]}
    shapes = {"none": {}, "bar": discrete(turn([0, 0, 1], 90), turn([1, 0, 0], 180)), "cone": cone}
    shapes["cylinder"] = cone | discrete(turn([1, 0, 0], 180))
    for name, symmetries in shapes.items():
        for R in Rotation.random(5, rng=np.random.default_rng(0)).as_matrix():
            S = symmetric_turn(R, symmetries)
            left = Rotation.from_matrix(R @ S).magnitude()
            assert left == pytest.approx(angle_up_to_symmetry(R, symmetries), abs=1e-6), name
            assert angle_up_to_symmetry(S, symmetries) == pytest.approx(0, abs=1e-6), name
    ball = {"symmetries_continuous": [{"axis": [1.0, 0.0, 0.0]}, {"axis": [0.0, 1.0, 0.0]}]}
    R = turn([0, 0, 1], 50)
    np.testing.assert_allclose(R @ symmetric_turn(R, ball), np.eye(3), atol=1e-12)
