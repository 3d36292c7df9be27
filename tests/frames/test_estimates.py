import numpy as np
import pytest

from gpca.errors import InputError
from gpca.frames.estimates import EstimatorErrors, choose_estimate, error_of, read_pose_errors

HEAD = "scene_id,im_id,obj_id,estimator,rx,ry,rz,tx,ty,tz"
SEEN = {
    "points_m": np.array([[0.0, 0, 1], [0.01, 0, 1], [0, 0.01, 1]]),
    "pixels": np.array([[50, 50], [51, 50], [50, 51]]),
    "camera_3_3": np.array([[100.0, 0, 50], [0, 100, 50], [0, 0, 1]]),
    "diameter_m": 0.1,
}


def pose(x_m, z_m=1.0):
    T = np.eye(4)
    T[:3, 3] = x_m, 0, z_m
    return T


def test_every_estimator_that_spoke_of_an_object_is_drawn():
    estimators = {"a": {(1, 2, 3): [pose(0.01)]}, "b": {(1, 2, 3): [pose(0.02)]}, "c": {}}
    drawn = [choose_estimate(estimators, (1, 2, 3), True, SEEN, np.random.default_rng(seed)) for seed in range(20)]
    assert {name for name, _ in drawn} == {"a", "b"}
    assert all(T[0, 3] == {"a": 0.01, "b": 0.02}[name] for name, T in drawn)
    assert choose_estimate(estimators, (1, 2, 4), True, SEEN, np.random.default_rng(0)) is None


def test_among_equal_objects_an_estimate_elsewhere_is_of_another_one():
    estimators = {"a": {(1, 2, 3): [pose(0.3)]}}
    random = np.random.default_rng(0)
    assert choose_estimate(estimators, (1, 2, 3), False, SEEN, random) is None
    assert choose_estimate(
        estimators, (1, 2, 3), True, SEEN, random
    )  # the only one of its kind: a bad estimate is one too


def test_errors_are_those_of_the_object_or_of_others_without_symmetry():
    errors = EstimatorErrors(symmetric={("a", 2)})
    for object_, x_m in ((("a", 1), 0.1), (("a", 2), 0.2), (("b", 1), 0.3)):
        errors.add(object_, pose(x_m))
    random = np.random.default_rng(0)

    def drawn(object_):
        return {errors.draw(object_, random)[0, 3] for _ in range(30)}

    assert drawn(("a", 2)) == {0.2}
    assert drawn(("b", 7)) == {0.1, 0.3}
    with pytest.raises(InputError, match="no estimator has a result for an object without symmetry"):
        EstimatorErrors(symmetric=()).draw(("a", 1), random)


def test_an_error_takes_the_true_pose_to_the_estimated_one():
    true, estimated = pose(0.1, 0.8), pose(0.3, 0.9)
    assert np.allclose(true @ error_of(true, estimated), estimated)


def test_a_file_of_errors_is_read_in_metres_and_of_known_objects(tmp_path):
    path = tmp_path / "errors.csv"
    path.write_text(f"{HEAD}\n48,1,1,x,0,0,{np.pi / 2},1.5,0,-20\n48,1,9,x,0,0,0,0,0,0\n")
    [(number, T)] = read_pose_errors(path, [1])
    assert number == 1
    assert np.allclose(T[:3, 3], [0.0015, 0, -0.02])
    assert np.allclose(T[:3, 0], [0, 1, 0])


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ("48,1,1.5,x,0,0,0,0,0,0", "'obj_id' contains values that are not whole numbers"),
        ("48,1,1,x,0,0,180,0,0,0", "contains a rotation of more than half a turn; give rotation vectors in radians"),
        ("48,1,1,x,0,0,0,0,0,1e9", "contains an error of more than 10 m; give translations in millimeters"),
        ("48,1,1,x,0,nan,0,0,0,0", "column 'ry' contains values that are not finite numbers"),
    ],
)
def test_a_faulty_file_of_errors_is_refused(tmp_path, row, expected):
    path = tmp_path / "errors.csv"
    path.write_text(f"{HEAD}\n{row}\n")
    with pytest.raises(InputError, match=expected):
        read_pose_errors(path, [1])
